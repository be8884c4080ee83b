"""Sequences in space and in the plane: what is where, which postures, what is proven, what is refused."""

from __future__ import annotations

import copy
import csv
import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.running import refusal, status
from helpers.slow import slow_except

import tpbso_casadi as tp
from problems.base import FloatArray, as_array
from problems.certify import CertificateStatus
from problems.certify import check_certificate as checker
from problems.timing import retime
from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.planning import BOUND
from tpbso_casadi.planning.ways import led_along
from tpbso_casadi.scenario import Cell, pieces_in
from tpbso_casadi.scenario.stages import AttachStage
from tpbso_casadi.storage import checked

HOME = [0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.785]
DOWN = (1.0, 0.0, 0.0, 0.0)
ABOVE, OVER_THERE = tp.Pose((0.5, -0.3, 0.2), DOWN), tp.Pose((0.45, 0.35, 0.22), DOWN)
PANDA = tp.robot("panda", tip_link="panda_hand_tcp")
TABLE = {"shape": "box", "name": "table", "center": [0.6, 0.0, -0.05], "size": [0.8, 1.4, 0.1]}
PART = {"shape": "box", "name": "part", "center": [0.5, -0.3, 0.05], "size": [0.04, 0.04, 0.1]}
HAND_AND_PART, PART_AND_TABLE = [("panda_hand", "part")], [("part", "table")]
STAGES = [
    tp.MoveTo(ABOVE),
    tp.Line(by=[0.0, 0.0, -0.13], may_touch=HAND_AND_PART),
    tp.Output("gripper", "close"),
    tp.Wait(0.2),
    tp.Attach("part", mass=0.4),
    tp.Line(by=[0.0, 0.0, 0.13], may_touch=PART_AND_TABLE),
    tp.MoveTo(OVER_THERE),
    tp.Detach("part"),
    tp.MoveTo(HOME, may_touch=HAND_AND_PART),
]


@pytest.fixture(scope="module")
def picked() -> tp.Plan:
    return tp.sequence(PANDA, start=HOME, stages=STAGES, obstacles=[TABLE, PART], cyclic=True)


def tool_of(robot: Any, theta: FloatArray) -> FloatArray:
    position, rotation = robot.tool.pose(ca.DM(theta).T)
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = as_array(rotation).reshape(3, 3), as_array(position)[0]
    return frame


def test_every_stage_is_proven_and_the_arm_stands_between_them(picked: tp.Plan) -> None:
    assert picked.certified
    assert [stage.kind for stage in picked.stages] == [
        "move", "line", "output", "wait", "attach", "line", "move", "detach", "move"
    ]  # fmt: skip
    assert picked.stages[0].start == 0.0
    assert picked.stages[-1].end == pytest.approx(picked.duration)
    for before, after in zip(picked.stages[:-1], picked.stages[1:], strict=True):
        assert before.end == after.start
        assert np.abs(picked.trajectory(before.end, 1)).max() < 1e-9
    for stage in picked.stages:
        assert all(verdict.status is CertificateStatus.CERTIFIED for verdict in stage.verdicts)
        assert bool(stage.verdicts) == (stage.kind in ("move", "line"))
    assert picked.stages[3].duration == pytest.approx(0.2)
    assert picked.stages[2].signal == ("gripper", "close")


def test_a_cycle_ends_where_it_began_and_is_little_above_the_bound(picked: tp.Plan) -> None:
    assert np.allclose(picked.trajectory(0.0), picked.trajectory(picked.duration), atol=1e-12)
    (bound,) = picked.motion.quantities[BOUND]
    assert bound <= picked.duration <= 1.05 * bound


def test_the_tool_is_where_the_stages_say(picked: tp.Plan) -> None:
    robot, ends = picked.planned.criteria.robot, [stage.end for stage in picked.stages]
    grasp = tool_of(robot, picked.trajectory(ends[1]))
    assert np.allclose(grasp[:3, 3], [0.5, -0.3, 0.07], atol=1e-8)
    assert np.allclose(grasp[:3, :3], np.diag([1.0, -1.0, -1.0]), atol=1e-7)
    for time in np.linspace(ends[4], ends[5], 50):
        frame = tool_of(robot, picked.trajectory(time))
        assert np.allclose(frame[:2, 3], [0.5, -0.3], atol=1e-3)
        assert np.allclose(frame[:3, :3], grasp[:3, :3], atol=0.01)


def test_the_part_moves_with_the_hand_and_stays_where_it_is_left(picked: tp.Plan) -> None:
    (part,) = [obstacle for obstacle in picked.planned.criteria.task.scenery if obstacle.moves]
    robot = picked.planned.criteria.robot
    grasped, left = picked.stages[4].start, picked.stages[7].start
    center = np.array([PART["center"]])
    held = np.linalg.solve(tool_of(robot, picked.trajectory(grasped)), np.append(center[0], 1.0))
    for time in (grasped, 0.5 * (grasped + left), left, picked.duration):
        expected = (tool_of(robot, picked.trajectory(min(time, left))) @ held)[:3]
        assert np.allclose(part.motion.placed(center, time)[0], expected, atol=2e-4)
    assert np.allclose(part.motion.placed(center, 0.0)[0], center[0], atol=1e-9)


def test_rows_are_no_farther_apart_than_if_they_were_even(picked: tp.Plan) -> None:
    assert np.diff(picked.times).max() <= picked.duration / 200.0 * (1.0 + 1e-6)
    assert np.isin(picked.trajectory.breakpoints, picked.times).all()


def test_masses_count_only_while_they_are_carried(picked: tp.Plan) -> None:
    free = tp.robot("panda", tip_link="panda_hand_tcp").model
    times = np.array([picked.stages[0].end / 2.0, (picked.stages[5].start + picked.stages[5].end) / 2.0])
    given = picked.motion.torques(times)
    assert given is not None
    states = [ca.DM(picked.trajectory.at(times, order)) for order in range(3)]
    empty = as_array(free.dynamics.torques(*states))
    assert np.allclose(given[0], empty[0])
    assert np.abs(given[1] - empty[1]).max() > 0.5


def test_contacts_that_are_allowed_are_said_with_their_stage(picked: tp.Plan) -> None:
    lines = picked.not_judged
    assert any("panda_hand and part" in line and "stage 2 (line)" in line for line in lines)
    assert any("part and table" in line and "stage 6 (line)" in line for line in lines)


def test_one_certificate_holds_all_stages_and_their_joints(picked: tp.Plan, tmp_path: Path) -> None:
    """Each stage's claims, that it begins where the one before ended, what is carried, rests; one file, one verdict."""
    content = json.loads(picked.certificate(tmp_path / "c.json").read_text())
    stages = content["stages"]
    checker.check(copy.deepcopy(content))
    assert sum(stage["breakpoints"][-1] + stage["pause"] for stage in stages) == pytest.approx(
        picked.trajectory.duration
    )
    carrying = ["part" in stage["robot"]["links"] for stage in stages]
    lying = ["part" in [obstacle["name"] for obstacle in stage["obstacles"]] for stage in stages]
    assert carrying == [not there for there in lying]
    first = carrying.index(True)

    def refused_by(number: int, change: Callable[[Any], None], kind: type[Exception] = checker.RefusedError) -> str:
        some = stages[max(number - 1, 0) : number + 1]
        other = copy.deepcopy({**content, "stages": some})
        change(other["stages"][-1])
        with pytest.raises(kind) as refused:
            checker.check(other)
        return str(refused.value)

    assert "its state at the end before" in refused_by(
        1, lambda stage: stage["start"][0].__setitem__(0, stage["start"][0][0] + 1e-6), ValueError
    )
    assert "the same arm" in refused_by(
        1, lambda stage: stage["robot"]["translations"][3].__setitem__(0, 0.1), ValueError
    )
    drifting = refused_by(1, lambda stage: stage["obstacles"][0].update(velocity=[0.0, 0.0, 1e-9]), ValueError)
    assert "rest" in drifting
    part = stages[first]["robot"]["links"].index("part")

    def swollen(stage: Any) -> None:
        roots = [n for n, parent in enumerate(stage["robot"]["ball_parents"]) if parent == n]
        for ball in stage["robot"]["balls"][roots[part] : [*roots, None][part + 1]]:
            ball[3] += 0.2

    assert refused_by(first + 1, swollen).startswith("clearance of 'part' from ")
    assert [len(place["places"]) for place in stages[0]["places"]] == [4]  # a pose; the start is in joints
    assert not any("condition: goal" in stage["not_covered"] for stage in stages)
    for point in (0, 3):

        def elsewhere(stage: Any, point: int = point) -> None:
            stage["places"][0]["places"][point][1] += 1.01e-6

        assert " m from its places" in refused_by(0, elsewhere)
    other_end = refused_by(0, lambda stage: stage["places"][0].update(at_goal=0))
    assert other_end.startswith("start of 'stage 1 (move)': ")
    without = {**content, "stages": [stages[0], stages[2]]}
    with pytest.raises(ValueError, match="its state at the end before"):
        checker.check(without)


def test_rows_for_a_controller_are_proven_stage_by_stage(picked: tp.Plan) -> None:
    rows = picked.controller_rows
    assert rows.joined.feasible
    assert [stage.label for stage in rows.joined.stages] == [stage.label for stage in picked.motion.stages]
    ends = np.array([stage.end for stage in rows.joined.stages])
    np.testing.assert_allclose(
        ends, [stage.end * rows.time_scale for stage in picked.motion.stages], rtol=0.0, atol=1e-9
    )
    assert rows.joined.trajectory.duration == pytest.approx(ends[-1], abs=1e-9)
    assert rows.time_scale < 1.001


def test_a_run_folder_is_read_back_and_says_the_same(picked: tp.Plan, tmp_path: Path) -> None:
    folder = picked.save(tmp_path / "run", figures=())
    again = tp.read_run(folder)
    assert again.certified
    assert again.duration == picked.duration
    assert [(stage.name, stage.end) for stage in again.stages] == [(s.name, s.end) for s in picked.stages]
    with (folder / "stages.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["signal"] for row in rows if row["signal"]] == ["gripper"]
    assert again.result.stages[1].constraints[0].name == "speed"
    assert again.result.solution == picked.result.solution


def test_the_pieces_of_a_sequence_stand_beside_its_result(picked: tp.Plan, tmp_path: Path) -> None:
    folder = picked.save(tmp_path / "run", figures=())
    result, pieces = folder / "result.json", folder / "motion.npz"
    assert result.stat().st_size < 200_000
    with np.load(pieces) as arrays:
        np.testing.assert_array_equal(arrays["coefficients"], picked.trajectory.coefficients)
    again = tp.read_run(folder)
    whole, written, content = picked.result, result.read_text(), pieces.read_bytes()
    pieces.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    with pytest.raises(tp.InvalidRun, match=r"motion.npz: is not of this run$"):
        tp.read_run(folder)
    pieces.unlink()
    with pytest.raises(tp.InvalidRun, match=r"motion.npz: cannot be read"):
        tp.read_run(folder)
    files = {name: digest for name, digest in json.loads(written)["files"].items() if name != pieces.name}
    result.write_text(whole.replaced(files=files).to_json())  # as earlier versions wrote it
    assert tp.read_run(folder).result.solution == again.result.solution


@pytest.mark.parametrize(
    ("arrays", "line"),
    [
        ({"breakpoints": [0.0, 1.0]}, "is no NPZ of breakpoints and coefficients alone"),
        ({"breakpoints": [0.0, 1.0], "coefficients": np.ones((2, 2, 7))}, "do not fit each other"),
        ({"breakpoints": [0.0, np.nan], "coefficients": np.ones((2, 1, 7))}, "breakpoints: a number is not finite"),
        ({"breakpoints": [0.0, 1.0], "coefficients": np.array([[["a"]]])}, "coefficients: an array of numbers"),
    ],
)
def test_other_arrays_are_no_pieces(arrays: dict[str, Any], line: str) -> None:
    np.savez(file := io.BytesIO(), **arrays)
    with pytest.raises(ValueError, match=line):
        pieces_in(file.getvalue())


def test_the_closest_approach_is_that_of_the_stage_that_comes_nearest(picked: tp.Plan) -> None:
    stages = [stage for stage in picked.motion.stages if stage.criteria is not None]
    each = [stage.criteria.closest_approach(stage.motion(picked.trajectory), ()) for stage in stages]  # type: ignore[union-attr]
    found = picked.motion.closest_approach
    assert found is not None
    assert found.distance == min(one.distance for one in each if one is not None)


@pytest.mark.parametrize(
    ("stage", "by", "line"),
    [
        (1, -0.05, "task.stages.2: the arm does not stand for 0 s"),
        (3, -0.1, "task.stages.3: the arm does not stand for 0.2 s"),
        (8, 0.01, "9 increasing times are needed"),
    ],
)
def test_stages_that_end_at_other_times_are_refused(picked: tp.Plan, stage: int, by: float, line: str) -> None:
    result = picked.result
    quantities = dict(result.solution.quantities)
    quantities["stage_ends"] = [end + by * (number == stage) for number, end in enumerate(quantities["stage_ends"])]
    other = result.replaced(solution=result.solution.replaced(quantities=quantities))
    with pytest.raises((ValueError, tp.ScenarioError), match=line):
        checked(other)


def test_stages_that_are_too_fast_break_their_limits(picked: tp.Plan) -> None:
    criteria = picked.planned.criteria
    parts = tuple(replace(part, start=0.9 * part.start, end=0.9 * part.end) for part in criteria.stages)
    faster = type(picked.motion)(replace(criteria, stages=parts), picked.trajectory.time_scaled(0.9), {})
    broken = {verdict.name for verdict in faster.verdicts if verdict.status is CertificateStatus.VIOLATED}
    assert {"speed", "acceleration"} <= broken


def test_a_move_that_is_known_the_other_way_round_is_turned_round() -> None:
    there = [0.5, 0.1, 0.0, -1.5, 0.0, 1.6, 0.785]
    plan = tp.sequence(PANDA, start=HOME, stages=[there, HOME])
    first, second = (stage.trajectory for stage in plan.stages)
    assert first is not None
    assert second is not None
    times = np.linspace(0.0, first.duration, 30)
    assert np.allclose(first.at(times), second.at(second.duration - times), atol=1e-9)


def test_a_start_that_is_a_pose_begins_in_a_posture_that_touches_nothing() -> None:
    """A ball is where the elbow of the posture nearest to the middle is; four of eight postures are clear of it."""
    start, arm = tp.Pose((0.4, 0.2, 0.4), DOWN), tp.robot("ur5e")
    balls = [{"shape": "sphere", "center": [0.138, 0.0224, 0.564], "radius": 0.03}]
    nearest = arm.inverse(start)[0]
    assert arm.clearance(nearest, balls) < 0.0
    plan = tp.sequence(arm, start=start, stages=[tp.MoveTo(tp.Pose((0.4, -0.25, 0.4), DOWN))], obstacles=balls)
    assert plan.status is CertificateStatus.CERTIFIED


def test_a_free_order_is_the_quickest() -> None:
    def reached(turn: float) -> list[float]:
        return [turn, *HOME[1:]]

    stops = [tp.MoveTo(reached(turn)) for turn in (1.2, 0.4, 1.6, 0.8)]
    stages = [stage for stop in stops for stage in (stop, tp.Wait(0.05))]
    given, free = (tp.sequence(PANDA, start=HOME, stages=stages, order=order) for order in ("given", "free"))
    assert free.certified
    assert free.duration < given.duration
    assert [round(float(free.trajectory(s.end)[0]), 3) for s in free.stages if s.kind == "move"] == [0.4, 0.8, 1.2, 1.6]
    assert free.motion.quantities[BOUND][0] <= free.duration


CORNER, LAST = [0.8, 0.1, 0.1, -1.6, 0.1, 1.8, 0.9], [1.2, 0.5, -0.3, -1.8, 0.2, 2.3, 0.3]


@pytest.mark.parametrize(
    ("corner", "away"),
    slow_except(
        [
            (tp.Joints(tuple(CORNER)), lambda theta: np.linalg.norm(theta - CORNER, axis=1)),
            (
                ABOVE,
                lambda theta: np.linalg.norm(as_array(PANDA.model.tool.position(ca.DM(theta))) - ABOVE.point, axis=1),
            ),
        ],
        1,
    ),
    ids=["joints", "pose"],
)
def test_a_blended_corner_is_passed_nearly_without_a_stop(corner: Any, away: Any, tmp_path: Path) -> None:
    blend, plans = 0.05, []
    for stated in (None, blend):
        stages = [tp.MoveTo(corner, blend=stated), tp.MoveTo(LAST), tp.Wait(0.1)]
        plans.append(tp.sequence(PANDA, start=HOME, stages=stages, obstacles=[TABLE]))
    stopped, blended = plans
    assert blended.certified
    assert blended.duration < 0.9 * stopped.duration
    assert [str(stage)[1:].split(",")[0] for stage in blended.stages] == ["stages 1 to 2 (move)", "stage 3 (wait)"]
    moving = blended.stages[0].trajectory
    times = np.linspace(0.0, moving.duration, 20_001)
    nearest = int(np.argmin(away(moving.at(times))))
    assert away(moving.at(times))[nearest] <= blend + 1e-4
    assert np.abs(moving.at(times[[nearest]], 1)).max() > 0.1
    again = tp.read_run(blended.save(tmp_path / "run", figures=()))
    assert again.certified
    assert again.duration == blended.duration


@pytest.mark.slow
def test_a_line_makes_use_of_its_accuracy() -> None:
    arm, start = tp.robot("ur5e"), np.array([0.0, -1.2, 1.6, -1.0, 1.2, 0.3])
    by = np.array([-0.2, 0.2, 0.2])
    plan = tp.sequence(arm, start={"joints": start.tolist()}, stages=[tp.Line(by=by.tolist(), accuracy=2e-3)])
    robot, stated = Cell.at_first(plan.scenario).robot, plan.scenario.task.stages[0]  # type: ignore[attr-defined]
    exactly = retime(led_along(stated.tool_path(robot, start), robot, start, stated), robot.limits)
    assert plan.certified and plan.duration < 0.98 * exactly.duration
    frames = [tool_of(robot, theta) for theta in plan.trajectory.at(plan.trajectory.times(301))]
    first, direction = frames[0], by / np.linalg.norm(by)
    since = np.array([frame[:3, 3] - first[:3, 3] for frame in frames])
    away = np.linalg.norm(since - np.outer(since @ direction, direction), axis=1)
    cosines = [(np.trace(first[:3, :3].T @ frame[:3, :3]) - 1.0) / 2.0 for frame in frames]
    assert 1e-4 < away.max() <= 2e-3 and np.arccos(np.clip(cosines, -1.0, 1.0)).max() <= 0.01
    np.testing.assert_allclose(since[-1], by, atol=1e-8)


def test_in_the_plane_too() -> None:
    arm = tp.robot([0.5, 0.4, 0.3], max_speed=2.0, max_acceleration=10.0)
    start = {"joints": [0.3, 0.9, -0.4]}
    plan = tp.sequence(
        arm, start=start, stages=[tp.Line(by=[-0.1, 0.15]), tp.Wait(0.1), [0.6, 0.5, 0.2]], evaluations=100
    )
    assert plan.certified
    assert plan.stages[0].trajectory is not None


SEQUENCE = """
[robot]
model = "panda"
[task]
kind = "sequence"
start = {{ joints = [0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.785] }}
{task}
{stages}
[[obstacles]]
shape = "box"
name = "box"
center = [0.5, 0.5, 0.1]
size = [0.1, 0.1, 0.1]
{obstacle}
"""
THERE = '[[task.stages]]\nkind = "move"\ngoal = { joints = [0.4, -0.6, 0.0, -2.2, 0.0, 1.6, 0.785] }\n'


UP = '[[task.stages]]\nkind = "line"\nby = [0, 0, 0.1]'
SECOND_BOX = '[[obstacles]]\nshape = "box"\nname = "box"\ncenter = [0.5, -0.5, 0.1]\nsize = [0.1, 0.1, 0.1]'
FLOOR = '[[obstacles]]\nshape = "half-space"\nname = "floor"\ncenter = [0.0, 0.0, -0.2]\nnormal = [0.0, 0.0, 1.0]'
ATTACHED = '[[task.stages]]\nkind = "attach"\nname = "NAME"\n' + THERE
SEVERAL = THERE.replace("= {", "= [{").replace("}", "}]")
OF_ONE_STAGE = {  # its keys, and what is said of task.stages.0
    'kind = "jump"': ": needs kind = 'move'",
    'kind = ["move"]': ": needs kind = 'move'",
    'kind = "move"': ".goal: missing key",
    'kind = "line"': ".goal: one of goal, by and along is needed",
    'kind = "line"\ngoal = { joints = [0, 0, 0, -1, 0, 1, 0] }': ".goal: a line ends at a position or pose",
    'kind = "line"\nby = [0.0, 0.1]': ".by: 3 coordinates are needed",
    'kind = "line"\nby = [0.0, 0.0, 0.0]': ".goal: the tool is there",
    'kind = "line"\nby = [2.0, 0.0, 0.0]': ".goal: the tool cannot be led",
    'kind = "line"\nby = [0, 0, 0.1]\nspeed = 1': ".speed: unknown key",
    'kind = "wait"\nseconds = -1.0': ".seconds: ",
    'kind = "path"\naccuracy = 0.01\npoints = [[0.5, 0.0]]': ".points: points of 3 coordinates",
}
REFUSED: list[tuple[str, str, str, str]] = [  # stages, keys of the task, of the obstacle, what is said
    *((f"[[task.stages]]\n{keys}", "", "", f"task.stages.0{line}") for keys, line in OF_ONE_STAGE.items()),
    ('[[task.stages]]\nkind = "wait"\nseconds = 1.0', "", "", "task.stages: none of them moves the arm"),
    (ATTACHED.replace("NAME", "bax"), "", "", "task.stages.0.name: no obstacle is called 'bax'; did you mean box?"),
    (ATTACHED.replace("attach", "detach").replace("NAME", "box"), "", "", "task.stages.0.name: no carried body"),
    (ATTACHED.replace("NAME", "box"), "", SECOND_BOX, "task.stages.0.name: 2 are called 'box'"),
    (ATTACHED.replace("NAME", "floor"), "", FLOOR, "task.stages.0.shape: HalfSpace cannot be carried"),
    (THERE, "cyclic = true", "", "task.stages.0.goal: is not where the sequence begins"),
    (THERE + UP, "cyclic = true", "", "task.stages.1.kind: the last that moves ends a cycle"),
    (THERE + UP, 'order = "free"', "", "task.stages.1.kind: in a free order stages are move, wait or output"),
    (THERE + "blend = 0.1", "", "", "task.stages.0.blend: the last stage ends at rest"),
    (THERE + "blend = 0.0\n" + THERE, "", "", "task.stages.0.blend: input should be greater than 0"),
    (THERE + "blend = 0.1\n" + UP, "", "", "task.stages.0.blend: the stage behind it is to be kind = 'move'"),
    (THERE + "blend = 0.1\nmargin = 0.01\n" + THERE, "", "", "task.stages.0.blend: margin would have to be the same"),
    (SEVERAL + "blend = 0.1\n" + THERE, "", "", "task.stages.0.blend: a stage with several goals ends at rest"),
    (THERE + "blend = 0.1\n" + THERE, 'order = "free"', "", "task.stages.0.blend: in a free order moves end at rest"),
    (THERE.replace("] }", "], within = 0.1 }"), "", "", "task.stages.0.goal: within is how far a via"),
    (THERE, "", "velocity = [0.1, 0.0, 0.0]", "obstacles.0: moves; in a sequence obstacles stand still"),
    (THERE + 'may_touch = [["panda_hand", "bax"]]', "", "", "task.stages.0.may_touch.0: nothing is called 'bax'"),
]  # fmt: skip


@pytest.mark.usefixtures("in_an_empty_folder")
def test_what_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for stages, task, obstacle, line in REFUSED:
        Path("cell.toml").write_text(SEQUENCE.format(stages=stages, task=task, obstacle=obstacle))
        assert f"cell.toml: {line}" in refusal(capsys, main, "cell.toml", "--no-plots")


@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_stage_without_a_motion_ends_with_one_and_leaves_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    down = '[[task.stages]]\nkind = "line"\nby = [0.0, 0.0, -0.25]'
    floor = '[[obstacles]]\nshape = "box"\ncenter = [0.4, 0.0, 0.40]\nsize = [0.3, 0.3, 0.05]'
    Path("cell.toml").write_text(SEQUENCE.format(stages=down, task="", obstacle="") + floor)
    assert status(main, "cell.toml", "--no-plots") == 1
    said = capsys.readouterr().err
    assert "task.stages.0: no certified motion was found for stage 1 (line); " in said and ": clearance -0.0" in said
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("stage", "line"),
    [
        (3, r"stages\[0\]: a stage such as tp.Line"),
        (tp.MoveTo([1.0]), r"stages\[0\].goal: 1 numbers"),
        (tp.Attach("box", body=3), r"stages\[0\].body: 3 is none"),  # type: ignore[arg-type]
    ],
)
def test_wrong_stages_in_python(stage: Any, line: str) -> None:
    with pytest.raises(tp.ScenarioError, match=line):
        tp.sequence(PANDA, start=HOME, stages=[stage])


def test_a_body_that_is_put_down_is_where_it_was_held() -> None:
    scenario = tp.scenario_of("examples/pick-and-place.toml")
    cell, posture = Cell.at_first(scenario), np.array(HOME)
    taken = AttachStage(kind="attach", name="part", mass=0.4, touch=["table"])
    held = cell.attached(taken, posture)
    assert held.contacts == (("part", "table"),)
    assert [body.name for body in held.carried] == ["part"]
    assert "part" not in [obstacle.name for obstacle in held.obstacles]
    back = held.detached("part", posture)
    (part,) = [obstacle for obstacle in back.obstacles if obstacle.name == "part"]
    assert np.allclose(part.pose[0], PART["center"], atol=1e-12)
    with pytest.raises(tp.ScenarioError, match="carried already"):
        held.attached(taken, posture)
    assert back.contacts == ()
    with pytest.raises(tp.ScenarioError, match=r"touch.0: nothing is called 'tabel'; did you mean table?"):
        cell.attached(taken.replaced(touch=["tabel"]), posture)


def test_what_is_held_touches_what_is_said_once() -> None:
    """A part stands on a table: it is lifted, and put down again, with that contact stated where it is taken up."""
    table = tp.Box(center=(0.6, 0.0, -0.05), size=(0.8, 1.4, 0.1), name="table")
    part = tp.Box(center=(0.45, -0.3, 0.05), size=(0.04, 0.04, 0.1), name="part")
    arm, start = tp.robot("ur5e", tool={"position": [0.0, 0.0, 0.15]}), [0.0, -1.6, 1.4, -1.4, -1.57, 0.0]
    lift = tp.Line(by=[0.0, 0.0, 0.1])
    stages = [tp.MoveTo(tp.Pose((0.45, -0.3, 0.1), (1.0, 0.0, 0.0, 0.0))), tp.Attach("part"), lift]
    with pytest.raises(tp.ScenarioError, match=r"stages\[2\]: .*part, table"):
        tp.sequence(arm, start=start, stages=stages, obstacles=[table, part])
    stages[1] = tp.Attach("part", touch=["table"])
    stages += [tp.Line(by=[0.0, 0.0, -0.1]), tp.Detach("part"), lift]
    plan = tp.sequence(arm, start=start, stages=stages, obstacles=[table, part])
    assert plan.certified
    (contact,) = [line for line in plan.not_judged if "part and table" in line]
    assert contact.endswith("in stage 3 (line), stage 4 (line)")
