"""Plans where obstacles move, or the robot itself when it is asked: judged by distances written out here."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import line_of, result_of

import tpbso_casadi as tp
from tpbso_casadi.storage import sealed

LINKS = (0.7, 0.7, 0.6)
ARM = {"link_lengths": LINKS, "max_speed": 4.0, "max_acceleration": 20.0}
MOVE = {"kind": "point-to-point", "start": [1.6, -0.6], "goal": [0.6, 1.6]}
PATH = {"kind": "path", "points": [[1.4, 0.0], [1.3, 0.4], [1.1, 0.7], [0.8, 1.0]], "accuracy": 0.02}
WAY = np.array([[-1.0, 0.5, 0.5], [0.0, 0.6, 0.3], [0.9, 0.8, 0.2]])
DISC = {"center": [1.9, 1.2], "semi_axes": [0.2, 0.2], "velocity": [-0.6, -0.2]}
CRATE = {"shape": "box", "center": [1.9, 1.2], "size": [0.2, 0.2], "velocity": [-0.6, -0.2]}
CART = {"shape": "box", "center": [0.0, 0.0], "size": [0.3, 0.2], "margin_rate": 0.01}
ROWS = [[0.0, 2.0, 0.2, 0.0], [1.0, 1.9, 0.5, 0.8], [3.0, 1.8, 0.9, 1.6]]


def planned(task: dict[str, Any], obstacles: list[dict[str, Any]], **tables: Any) -> tp.Plan:
    content: dict[str, Any] = {"arm": ARM, "task": task, "obstacles": obstacles, "solver": {"name": "pso"}}
    return tp.plan(tp.parse_scenario(content | tables))


def nearest_to_disc(plan: tp.Plan, center: list[float]) -> float:
    """The least distance of the three links from the disc, which moves: of points along the links, m."""
    times = np.linspace(0.0, plan.duration, 2001)
    angles = np.cumsum(plan.trajectory.at(times), axis=1)
    joints = np.zeros((times.size, 4, 2))
    joints[:, 1:] = np.cumsum(np.array(LINKS)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=2), axis=1)
    shares = np.linspace(0.0, 1.0, 101)[:, None, None, None]
    points = joints[:, :-1] + shares * (joints[:, 1:] - joints[:, :-1])
    centers = np.array(center) + times[:, None] * np.array([-0.6, -0.2])
    return float(np.linalg.norm(points - centers[:, None], axis=3).min()) - 0.2


def closest_of(plan: tp.Plan) -> float:
    closest = plan.motion.closest_approach
    assert closest is not None
    return closest.distance


FORMS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "move": (MOVE, {}),
    "paper": (MOVE, {"motion": "paper"}),
    "reduced": (MOVE, {"motion": "paper", "formulation": "reduced"}),
    "traced": (PATH, {}),
    "path, paper": (PATH, {"motion": "paper"}),
    "path, reduced": (PATH, {"motion": "paper", "formulation": "reduced"}),
}


@pytest.mark.slow
@pytest.mark.parametrize("solver", [{"name": "pso", "evaluations": 500}, {"name": "ipopt", "iterations": 3}])
@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_a_plane_motion_knows_the_time(form: str, solver: dict[str, Any], tmp_path: Path) -> None:
    task, model = FORMS[form]
    plan = planned(task, [DISC], model=model, solver=solver)
    nearest = nearest_to_disc(plan, [1.9, 1.2])
    assert nearest > 0.0
    assert closest_of(plan) == pytest.approx(nearest, abs=2e-3)
    goal = plan.result.at_goal
    assert goal is not None and (goal.clear_until is None or goal.clear_until > plan.duration)
    assert tp.read_run(plan.save(tmp_path / "run", figures=())).certified  # all is computed again


def test_a_given_path_is_judged_at_the_times_of_its_run() -> None:
    """The same path with the same disc; nothing waits, so that where they meet it is said."""
    arm = tp.robot(list(LINKS), max_speed=4.0, max_acceleration=20.0)
    plan = tp.retime(WAY, arm, obstacles=[DISC | {"center": [2.3, 1.4]}])
    assert plan.certified
    assert closest_of(plan) == pytest.approx(nearest_to_disc(plan, [2.3, 1.4]), abs=1e-3)
    # the disc is where the arm ends, at the time of its end
    meeting = [0.5 + 0.6 * plan.duration, 0.8 + 0.2 * plan.duration]
    other = tp.retime(WAY, arm, obstacles=[DISC | {"center": meeting}])
    assert not other.certified and other.result.at_goal is not None and other.result.at_goal.touched


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run among a crate and a cart."""
    obstacles = [CRATE, CART | {"motion_rows": ROWS}]
    plan = planned(MOVE | {"stay": 0.3}, obstacles, solver={"name": "pso", "evaluations": 300, "polish_starts": 0})
    assert [verdict.name for verdict in plan.verdicts][2:4] == ["clearance", "clearance at the goal"]
    return plan.save(tmp_path_factory.mktemp("stored") / "run", figures=())


def refused(run: Path, folder: Path, edit: Callable[[dict[str, Any]], object]) -> str:
    """What is said of a copy of the run as somebody would change it who computes its seal anew."""
    copy = Path(shutil.copytree(run, folder / "edited", dirs_exist_ok=True))
    result = result_of(copy)
    edit(result)
    text = json.dumps(sealed({key: value for key, value in result.items() if key != "seal"}))
    (copy / "result.json").write_text(text)
    with pytest.raises(tp.InvalidRun) as error:
        tp.read_run(copy)
    return str(error.value)


EDITS: dict[str, Callable[[dict[str, Any]], object]] = {
    "an angle": lambda r: r["scenario"]["obstacles"][1]["motion_rows"][1].__setitem__(3, 0.9),
    "clear for longer": lambda r: r["at_goal"].update(clear_until=r["at_goal"]["clear_until"] + 0.1),
    "another key": lambda r: r["at_goal"].update(more=1),
}


def test_an_edited_run_is_refused(stored: Path, tmp_path: Path) -> None:
    for name, edit in EDITS.items():
        line = refused(stored, tmp_path, edit)
        assert line.startswith(f"{tmp_path / 'edited' / 'result.json'}: ") and "\n" not in line, name


def test_nothing_is_invented_where_nothing_moves(stored: Path, tmp_path: Path) -> None:
    kept = result_of(stored)
    quick = {"name": "pso", "evaluations": 500}
    still = planned(MOVE, [DISC | {"velocity": None}], solver=quick).save(tmp_path / "still", figures=())
    assert "at_goal" not in result_of(still)
    said = refused(still, tmp_path, lambda result: result.update(at_goal=kept["at_goal"]))
    assert said.endswith("is stored, nothing is computed")
    assert "closest_approach" not in json.loads(planned(MOVE, [], solver=quick).result.to_json())


LEAVING = {
    "kind": "point-to-point",
    "start": {"joints": [-0.8, 0.6, 0.5]},
    "goal": {"joints": [0.8, 0.5, 0.6]},
    "start_velocity": [1.5, 0.0, -0.8],
    "start_acceleration": [4.0, -2.0, 3.0],
}


@pytest.mark.slow
def test_a_motion_that_leaves_as_the_robot_moves_is_read_back_and_not_timed_anew(tmp_path: Path) -> None:
    passing = {"shape": "box", "center": [2.3, 1.2], "size": [0.3, 0.5], "velocity": [-0.3, 0.0]}
    tables: dict[str, Any] = {"arm": ARM | {"max_jerk": 400.0}, "model": {"samples": 20}}
    plan = planned(LEAVING, [passing], **tables, solver={"name": "pso", "evaluations": 300})
    assert plan.certified
    for order, key in enumerate(("start", "start_velocity", "start_acceleration")):
        stated: Any = LEAVING[key]
        assert plan.trajectory(0.0, order) == pytest.approx(stated["joints"] if order == 0 else stated, abs=1e-9)
    assert plan.trajectory(plan.duration) == pytest.approx([0.8, 0.5, 0.6], abs=1e-9)
    times = np.linspace(0.0, plan.duration, 5000)
    for order, most in enumerate((4.0, 20.0, 400.0), start=1):
        assert np.abs(plan.trajectory(times, order)).max() <= most
    assert plan.result.retiming is None
    assert plan.scenario.model.motion == "time-spline"
    assert "start acceleration" in [verdict.name for verdict in plan.verdicts]
    folder = plan.save(tmp_path / "run", figures=())
    assert tp.read_run(folder).certified
    assert "fastest of its path" not in str(tp.read_run(folder).audit())
    assert "no nonlinear program" in str(tp.audit(plan.scenario))
    assert "an acceleration at an end" in line_of(lambda: tp.retime(folder))
    for keys, expected in (
        ({"within": 1}, "this task has no nonlinear program to descend"),
        ({"solver": "ipopt"}, "this task has no nonlinear program to descend"),
    ):
        assert expected in line_of(lambda keys=keys: tp.plan(plan.scenario, **keys))
