"""Which motion a scenario is planned with: by default, by its keys, by what it says; and places of all kinds."""

from __future__ import annotations

from typing import Any

import pytest

from problems.tasks import Joints, Position
from tpbso_casadi import ScenarioError, builtin, parse_scenario
from tpbso_casadi.cli.commands.solve import overridden, parser
from tpbso_casadi.scenario import built

ARM = {"link_lengths": [0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
POINTS = {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.0]}
PATH = {"kind": "path", "accuracy": 0.05, "points": [[1.0, 0.0], [1.0, 0.5], [0.5, 1.0]]}
POSTURES = POINTS | {"start": {"joints": [0.1, 0.2, 0.3]}, "goal": {"joints": [0.5, 0.2, 0.1]}}
VIA = {"via": [{"joints": [0.1, 0.2, 0.3]}]}


def parsed(task: dict[str, Any], **model: Any) -> Any:
    return parse_scenario({"arm": ARM, "task": task, "model": model})


def error_of(task: dict[str, Any], **model: Any) -> str:
    with pytest.raises(ScenarioError) as caught:
        parsed(task, **model).problem()
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("task", "model", "motion"),
    [
        (POINTS, {}, "spline"),
        (POINTS, {"pieces": 8}, "spline"),
        (POINTS, {"motion": "paper"}, "paper"),
        (POINTS, {"formulation": "paper"}, "paper"),
        (POINTS, {"formulation": "reduced"}, "paper"),
        (POINTS | {"segment_time": [0.2, 1.0]}, {}, "paper"),
        (POINTS | VIA, {}, "spline"),
        (PATH, {}, "spline"),
        (PATH, {"knots": 3}, "paper"),
        (POSTURES | {"start_acceleration": [1.0, 0.0, 0.0]}, {}, "time-spline"),
        (POSTURES | {"start_acceleration": [1.0, 0.0, 0.0], "start_velocity": [0.1, 0.0, 0.0]}, {}, "time-spline"),
        (POSTURES | {"total_time": [0.5, 3.0]}, {"motion": "time-spline", "pieces": 4}, "time-spline"),
    ],
)
def test_the_motion_follows_from_the_keys(task: dict[str, Any], model: dict[str, Any], motion: str) -> None:
    scenario = parsed(task, **model)
    assert scenario.model.motion == motion
    assert parse_scenario(scenario.model_dump(mode="json")) == scenario


@pytest.mark.parametrize(
    ("task", "model", "retime"),
    [
        (POINTS, {}, True),
        (POINTS, {"motion": "paper"}, False),
        (POINTS | {"objective": "length"}, {"motion": "paper"}, True),
        (POINTS | {"objective": "rotation"}, {"motion": "paper", "retime": False}, False),
        (POINTS, {"motion": "paper", "retime": True}, True),
    ],
)
def test_plans_are_timed_anew_where_their_objective_leaves_time_free(
    task: dict[str, Any], model: dict[str, Any], retime: bool
) -> None:
    assert parsed(task, **model).model.retime is retime


@pytest.mark.parametrize(
    ("task", "model", "expected"),
    [
        (POINTS | VIA, {"motion": "paper"}, "task.via: needs motion = 'spline' in [model]"),
        (POINTS | VIA, {"formulation": "paper"}, "task.via: needs motion = 'spline' in [model]"),
        (POINTS | {"start": {"joints": [0.0, 0.0, 0.0]}}, {"motion": "paper"}, "task.start: needs motion = 'spline'"),
        (POINTS | {"goal": [[0.5, 1.0], [0.6, 1.0]]}, {"motion": "paper"}, "task.goal: needs motion = 'spline'"),
        (POINTS | {"goal_velocity": [0.1, 0.0, 0.0]}, {"motion": "paper"}, "task.goal_velocity: needs motion"),
        (POINTS | {"total_time": [0.1, 2.0]}, {"motion": "paper"}, "task.total_time: needs motion"),
        (POINTS | {"segment_time": [0.1, 2.0]}, {"motion": "spline"}, "task.segment_time: needs motion = 'paper'"),
        (POINTS, {"motion": "spline", "formulation": "paper"}, "model.formulation: 'paper' needs motion = 'paper'"),
        (POINTS, {"motion": "spline", "knots": 5}, "model.knots: needs motion = 'paper'"),
        (POINTS, {"motion": "paper", "pieces": 5}, "model.pieces: needs motion = 'spline'"),
        (PATH, {"motion": "spline", "pieces": 5}, "model.pieces: the points of a path decide about its pieces"),
        (POINTS, {"motion": "splin"}, "model.motion: .*did you mean spline"),
        (POINTS, {"retime": 1}, "model.retime: true or false is needed"),
    ],
)
def test_what_does_not_belong_to_the_motion_is_one_line(
    task: dict[str, Any], model: dict[str, Any], expected: str
) -> None:
    message = error_of(task, **model)
    first, *rest = expected.split(".*")
    assert first in message
    assert all(part in message for part in rest)


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("start", "home", "task.start: [x, y], { joints = [...] } or { position = [...] } is needed, not 'home'"),
        ("start", {}, "task.start: [x, y], { joints"),
        ("start", {"joint": [1.0]}, "task.start: [x, y], { joints"),
        ("start", {"joints": [0.0], "position": [1.0, 0.0]}, "task.start: [x, y], { joints"),
        ("start", {"joints": [0.0, "x", 0.0]}, "task.start.joints.1: a number is needed, not 'x'"),
        ("start", {"joints": [0.0, 0.0]}, "task.start: 2 joints for a robot of 3"),
        ("start", {"joints": [0.0, 0.0, 1e7]}, "task.start: "),
        ("start", {"position": [1.0]}, "task.start.position.1: missing key"),
        ("start", [1.0, "y"], "task.start.1: a number is needed, not 'y'"),
        ("start", [1.0, True], "task.start.1: a number is needed"),
        ("start", {"position": [9.0, 0.0]}, "task.start: (9.0, 0.0) is 9 m from the base, out of reach"),
        ("goal", [], "task.goal"),
        ("goal", [[0.5, 1.0], [9.0, 0.0]], "task.goal: goal[1]: (9.0, 0.0)"),
        ("goal", [[0.5, 1.0], {"joints": ["x"]}], "task.goal.1.joints.0: a number is needed"),
        ("goal", [[0.5, 1.0], 3], "task.goal.1: [x, y], { joints"),
        ("goal", [[0.5, 1.0]] * 101, "task.goal: 101 places; at most 100"),
        ("via", [], "task.via: a list of [x, y], { joints"),
        ("via", [1.0, 0.5], "task.via.0: [x, y], { joints"),
        ("start_velocity", [0.1, 0.0], "task.start_velocity: 2 values for 3 joints"),
        ("start_velocity", [9.0, 0.0, 0.0], "task.start_velocity: joint 1: "),
    ],
)
def test_a_wrong_place_is_one_line(key: str, value: object, expected: str) -> None:
    assert error_of(POINTS | {key: value}).startswith(expected), error_of(POINTS | {key: value})


@pytest.mark.parametrize(
    ("task", "model", "expected"),
    [
        (POSTURES | {"start_acceleration": [1.0]}, {}, "task.start_acceleration: 1 values for 3 joints"),
        (POSTURES | {"start_acceleration": [21.0, 0.0, 0.0]}, {}, "task.start_acceleration: joint 1: 21 is not within"),
        (
            POSTURES | {"start_acceleration": [1.0, 0.0, 0.0]},
            {"motion": "spline"},
            "task.start_acceleration: needs motion = 'time-spline' in [model]",
        ),
        (
            POSTURES | {"start_acceleration": [1.0, 0.0, 0.0]},
            {"motion": "paper"},
            "task.start_acceleration: needs motion = 'time-spline' in [model]",
        ),
        (POSTURES, {"motion": "time-spline", "retime": True}, "model.retime: motion = 'time-spline' keeps the timing"),
        (POSTURES, {"motion": "time-spline", "knots": 4}, "model.knots: needs motion = 'paper' in [model]"),
        (POSTURES, {"motion": "time-spline", "formulation": "paper"}, "model.formulation: 'paper' needs motion"),
        (POSTURES | VIA, {"motion": "time-spline"}, "task.via: needs motion = 'spline' in [model]"),
        (POSTURES | {"goal_velocity": [0.1, 0.0, 0.0]}, {"motion": "time-spline"}, "task.goal_velocity: needs motion"),
        (POINTS, {"motion": "time-spline"}, "task.start: motion 'time-spline' needs joint angles there"),
        (PATH, {"motion": "time-spline"}, "model.motion: kind = 'path' is planned with"),
    ],
)
def test_what_a_spline_over_time_does_not_do(task: dict[str, Any], model: dict[str, Any], expected: str) -> None:
    assert error_of(task, **model).startswith(expected), error_of(task, **model)


def test_a_spline_over_time_keeps_its_timing() -> None:
    scenario = parsed(POSTURES | {"objective": "length"}, motion="time-spline")
    assert not scenario.model.retime
    assert scenario.model.formulation == "reduced"


def test_places_of_all_kinds_are_read_and_written_back() -> None:
    task = POINTS | {
        "start": {"joints": [0.1, 0.2, 0.3]},
        "goal": [[0.5, 1.0], {"position": [0.4, 1.0]}, {"joints": [0.0, 0.5, 0.5]}],
        "via": [[0.9, 0.2], {"joints": [0.2, 0.3, 0.4]}],
    }
    scenario = parsed(task)
    content = scenario.model_dump(mode="json")
    assert {key: content["task"][key] for key in ("start", "goal", "via")} == {
        key: task[key] for key in ("start", "goal", "via")
    }
    assert parse_scenario(content) == scenario
    assert built(scenario.task.start) == Joints((0.1, 0.2, 0.3))
    assert [built(goal) for goal in scenario.task.goal[:2]] == [Position((0.5, 1.0)), Position((0.4, 1.0))]


def test_two_plain_numbers_are_a_point_and_a_list_of_points_are_goals() -> None:
    assert parsed(POINTS).task.goal == (0.5, 1.0)
    assert parsed(POINTS | {"goal": [[0.5, 1.0]]}).task.goal == [(0.5, 1.0)]


def test_degrees_are_read_in_places_and_velocities() -> None:
    task = POINTS | {"start": {"joints": [180.0, 0.0, 0.0]}, "goal": [{"joints": [90.0, 0.0, 0.0]}]}
    task |= {"goal_velocity": [90.0, 0.0, 0.0]}
    scenario = parse_scenario({"unit": "deg", "arm": ARM, "task": task})
    assert scenario.task.start.joints[0] == pytest.approx(3.141592653589793)
    assert scenario.task.goal[0].joints[0] == pytest.approx(1.5707963267948966)
    assert scenario.task.goal_velocity[0] == pytest.approx(1.5707963267948966)


def options(*arguments: str) -> Any:
    return parser().parse_args(list(arguments))


def test_the_command_line_overrides_what_the_keys_would_say() -> None:
    stated = parsed(POINTS)
    assert overridden(stated, options("--motion", "paper")).model.motion == "paper"
    assert overridden(stated, options("--motion", "paper")).model.retime is False
    assert overridden(stated, options("--motion", "paper", "--retime")).model.retime is True
    assert overridden(stated, options("--no-retime")).model.retime is False
    assert overridden(stated, options("--formulation", "paper")).model.motion == "paper"
    assert overridden(builtin("time-3"), options("--objective", "length")).model.retime is True
    with pytest.raises(ScenarioError, match=r"model\.formulation: 'paper' needs motion = 'paper'"):
        overridden(parsed(POINTS, motion="spline"), options("--formulation", "paper"))


def test_another_number_of_links_does_not_fit_given_joints() -> None:
    stated = parsed(POINTS | {"start": {"joints": [0.0, 0.0, 0.0]}})
    with pytest.raises(ScenarioError, match=r"task\.start: 3 joints for a robot of 4"):
        overridden(stated, options("--links", "4")).problem()
