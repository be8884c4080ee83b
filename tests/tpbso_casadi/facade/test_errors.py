"""What is wrong with an argument is said in one line that names the argument and what to do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.facade.arguments import as_argument

LIMITS = {"max_speed": 4.0, "max_acceleration": 20.0}
ARM = tp.robot([0.7, 0.7, 0.6], **LIMITS)
TASK: dict[str, Any] = {"start": [1.0, 0.0], "goal": [0.5, 1.5]}


def planned(**keys: Any) -> Callable[[], object]:
    return lambda: tp.plan(ARM, **TASK | {"evaluations": 50} | keys)


MISTAKES: list[tuple[Callable[[], object], str]] = [
    (lambda: tp.plan(ARM, goal=[1.0, 0.5]), r"start: missing; say where the robot is at t = 0"),
    (lambda: tp.plan(ARM, start=[1.0, 0.5]), r"goal: missing; say where it is to be"),
    (
        lambda: tp.plan(ARM, path=[[1.0, 0.2], [1.2, 0.6]]),
        r"accuracy: missing; say how far the tool may leave the path",
    ),
    (lambda: tp.plan(ARM, path="none.csv", accuracy=0.1), r"path: none.csv: cannot be read: No such file"),
    (lambda: tp.plan(ARM, path=[[1.0, 0.2], [1.2]], accuracy=0.1), r"path\[?.*numbers"),
    (lambda: tp.plan("none.toml"), r"none.toml: cannot be read: No such file"),
    (lambda: tp.plan("none.urdf", **TASK), r"urdf: none.urdf: cannot be read: No such file"),
    (lambda: tp.plan("pandaa", **TASK), r"'pandaa': is no robot, no scenario and no file.*did you mean panda\?"),
    (lambda: tp.plan([0.5, 0.5], **TASK), r"max_speed: missing; say how fast the joints may turn"),
    (lambda: tp.robot([0.5, -0.5], **LIMITS), r"link_lengths\[1\]: .* greater than 0"),
    (lambda: tp.robot(ARM, max_speed=3.0), r"max_speed: the robot is complete"),
    (lambda: tp.plan("time-3", goal=[9.0, 9.0]), r"task\.goal: .* out of reach"),
    (planned(goal=[9.0, 9.0]), r"goal: \(9\.0, 9\.0\) is 12\.7279 m from the base, out of reach"),
    (planned(goal=[np.nan, 1.0]), r"goal\[0\]: .*, not nan"),
    (planned(goal=[1.0] * 5), r"goal: 5 numbers; 3 joint values are needed, or 2 coordinates"),
    (planned(via=[1.0, 0.5]), r"via: a list of places is needed"),
    (planned(obstacles=tp.Rectangle((0.9, 0.9), (0.1, 0.1))), r"obstacles: a list is needed"),
    (planned(obstacles=[3]), r"obstacles: 3 is none; say tp\.Box"),
    (planned(obstacles=[{"shape": "sphre"}]), r"obstacles\[0\] shape: .*did you mean sphere\?"),
    (planned(obstacles=[tp.Rectangle((0.5, 1.5), (0.1, 0.1))]), r"goal: .* lies inside the obstacle"),
    (planned(objective="tim"), r"objective: .*did you mean time\?"),
    (planned(solver="bsoo"), r"solver: no solver 'bsoo'; did you mean bso\?"),
    (planned(solver=3), r"solver: 3 is none"),
    (planned(evaluations=0), r"evaluations: .* greater than 0"),
    (planned(evaluations=10.5), r"evaluations: a whole number is needed, not 10\.5"),
    (planned(seed=-1), r"seed: "),
]


@pytest.mark.parametrize(("call", "expected"), MISTAKES, ids=[expected[:30] for _, expected in MISTAKES])
def test_the_argument_and_what_to_do(call: Callable[[], object], expected: str) -> None:
    with pytest.raises(tp.ScenarioError, match=f"^{expected}") as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (planned(obstacle=[]), "there is no keyword 'obstacle'; did you mean 'obstacles'?"),
        (planned(qwxyz=1), "there is no keyword 'qwxyz'"),
        (lambda: tp.robot([0.5, 0.5], max_spead=1.0), "there is no keyword 'max_spead'; did you mean 'max_speed'?"),
        (lambda: tp.robot("panda", paylod=1.0), "there is no keyword 'paylod'; did you mean 'payload'?"),
    ],
)
def test_unknown_keywords(call: Callable[[], object], expected: str) -> None:
    with pytest.raises(TypeError) as caught:
        call()
    assert str(caught.value) == expected


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("task.points.3: a number is needed", "path[3]: a number is needed"),
        ("task.points: missing key", "path: missing key"),
        ("solver.settings.w: out of range", "w: out of range"),
        ("solver.polish_starts: too many", "polish: too many"),
        ("obstacles.2.center: a list is needed", "obstacles[2] center: a list is needed"),
        ("--rate 3: too much", "rate 3: too much"),
        ("file.toml: task.goal: missing key", "file.toml: task.goal: missing key"),
        ("points: 1 is not enough", "points: 1 is not enough"),
    ],
)
def test_keys_and_options_become_arguments(message: str, expected: str) -> None:
    assert as_argument(message) == expected


# What a user brings along


def test_everything_may_be_of_numpy() -> None:
    arm = tp.robot(np.array([0.7, 0.7, 0.6]), max_speed=np.full(3, 4.0), max_acceleration=np.float64(20.0))
    boxes = (tp.Rectangle(tuple(np.array([x, 0.9])), (0.1, 0.1)) for x in np.linspace(1.6, 1.8, 2))
    scenario = tp.scenario_of(
        arm, start=np.array([1.0, 0.0]), goal=np.array([0.5, 1.5]), obstacles=boxes,
        objective={"time": np.float64(1.0), "rotation": np.float32(0.5)}, evaluations=np.int64(50), seed=np.int32(2),
    )  # fmt: skip
    assert scenario.problem().task.obstacles[1].center == (1.8, 0.9)
    assert (scenario.solver.evaluations, scenario.solver.seed) == (50, 2)
    assert scenario.robot_table.build() == ARM.model


def test_a_file_of_points(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y\n1.0,0.2\n1.2,0.6\n")
    scenario = tp.scenario_of(ARM, path=tmp_path / "path.csv", accuracy=0.1)
    assert scenario.problem().task.path.points == ((1.0, 0.2), (1.2, 0.6))


@dataclass(frozen=True)
class MyArm(tp.PlanarArm):
    """A robot of one's own."""


@dataclass(frozen=True)
class MySwarm(tp.PSO):
    """A solver of one's own."""


def test_ones_own_classes_are_given_as_objects_or_classes(tmp_path: Path) -> None:
    arm = MyArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3, margin=0.01)
    plan = tp.plan(arm, **TASK, solver=MySwarm(population=7), evaluations=50, polish=False)
    assert type(plan.motion.problem.robot) is MyArm
    assert plan.motion.problem.robot.margin == 0.01
    assert plan.scenario.solver.build() == MySwarm(population=7)
    assert tp.read_run(plan.save(tmp_path / "run", figures=())).motion.problem.robot == arm
    assert type(tp.scenario_of(arm, **TASK, solver=MySwarm).solver.build()) is MySwarm


def test_a_class_of_a_notebook_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    import __main__  # noqa: PLC0415 (what a notebook's cells are)

    noted = type("Noted", (MySwarm,), {"__module__": "__main__", "__doc__": "Of a cell."})
    monkeypatch.setattr(__main__, "Noted", noted, raising=False)
    assert tp.scenario_of(ARM, **TASK, solver=noted).solver.kind() is noted


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"warm_start": "time-3"}, r"^warm_start: a tp\.Plan is needed, not 'time-3'$"),
        ({"evaluation": 3}, r"^evaluation: a tp\.EvaluationOptions is needed, not 3$"),
    ],
)
def test_objects_of_another_kind_are_refused_by_name(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(TypeError, match=message):
        planned(**keys)()


@pytest.mark.parametrize("count", [0, -1, "3", 1.5])
def test_counts_are_whole_numbers(count: Any) -> None:
    with pytest.raises(tp.ScenarioError, match=r"^runs: (a whole number is needed|-?\d+ are none)"):
        tp.compare("time-3", solvers=["bso"], runs=count)
    with pytest.raises(tp.ScenarioError, match=r"^points: .* is not within 2 and 1000"):
        tp.pareto("time-3", points=count)


def test_own_constraints_and_objectives_have_short_names() -> None:
    height = tp.Constraint(lambda m: m.tool[1], lower=-0.05, name="height", unit="m")
    assert repr(height) == "<constraint 'height': lower=-0.05, upper=None, m>"
    assert repr(tp.Cost(lambda m: 1.0, name="clock", unit="s")) == "<objective 'clock', s>"


def test_a_class_inside_a_function_is_refused() -> None:
    class Hidden(tp.PSO):
        pass

    with pytest.raises(tp.ScenarioError, match=r"^Hidden: a plan names its classes; define it in a module"):
        tp.scenario_of(ARM, **TASK, solver=Hidden)


def test_a_robot_keeps_its_margin() -> None:
    assert tp.scenario_of(replace(ARM.model, margin=0.02), **TASK).problem().robot.margin == 0.02


def test_a_plan_a_name_and_a_scenario_alike() -> None:
    scenario = tp.scenario_of("time-3", evaluations=50)
    plan = tp.plan(scenario, polish=False)
    assert tp.scenario_of(plan) == plan.scenario
    assert tp.plan(plan).duration == plan.duration
    assert tp.scenario_of(plan, seed=5).solver.seed == 5


def test_obstacles_of_a_scenario_are_replaced_and_its_solver_stays_the_usual_one() -> None:
    free = tp.scenario_of("obstacle-3", obstacles=[])
    assert free.obstacles == []
    assert free.solver == tp.scenario_of("obstacle-3").solver
    assert len(tp.scenario_of("time-3", obstacles=[{"center": [1.6, 1.6], "semi_axes": [0.1, 0.1]}]).obstacles) == 1
