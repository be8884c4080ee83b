"""What is wrong with an argument is said in one line that names it and what to do; what users bring along is taken."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, reduce
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.facade.arguments import as_argument
from tpbso_casadi.facade.plan import Plan

LIMITS = {"max_speed": 4.0, "max_acceleration": 20.0}
ARM = tp.robot([0.7, 0.7, 0.6], **LIMITS)
TASK: dict[str, Any] = {"start": [1.0, 0.0], "goal": [0.5, 1.5]}
QUICK: dict[str, Any] = TASK | {"evaluations": 50, "polish": False}
ROWS = np.array([[0.0, 0.5], [0.6, 0.9], [1.0, 0.2], [1.5, 0.4]])
TWO = tp.PlanarArm((0.5, 0.5), (2.0, 3.0), (10.0, 8.0))
UNDEFINED = tp.Cost(lambda m: ca.sqrt(m.q[0] - 100.0))
ANY: Any = None  # what a type checker would refuse
NO_PATHS: list[Any] = [[[0.0, 0.0], [1.0]], [["a", "b"]], ROWS * 1j, object(), ROWS * 1e9, ROWS[:1], ROWS[[0, 0]]]


@cache
def made() -> Plan:
    return tp.plan(ARM, **QUICK)


def planned(**keys: Any) -> Callable[[], object]:
    return lambda: tp.plan(ARM, **QUICK | keys)


def limited(expression: Callable[[Any], Any], **bounds: Any) -> Callable[[], object]:
    return lambda: tp.scenario_of(ARM, **QUICK, constraints=tp.Constraint(expression, **bounds))


class Hidden(tp.PSO):
    """A solver that no other process can import."""


Hidden.__qualname__ = "function.<locals>.Hidden"


MISTAKES: dict[type[Exception], list[tuple[Callable[[], object], str]]] = {
    tp.ScenarioError: [
        (lambda: tp.plan(ARM, goal=[1.0, 0.5]), r"start: missing; say where the robot is at t = 0"),
        (lambda: tp.plan(ARM, start=[1.0, 0.5]), r"goal: missing; say where it is to be"),
        (lambda: tp.plan(ARM, path=[[1.0, 0.2], [1.2, 0.6]]), r"accuracy: missing; say how far the tool may leave"),
        (lambda: tp.plan(ARM, path="none.csv", accuracy=0.1), r"path: none.csv: cannot be read: No such file"),
        (lambda: tp.plan("none.toml"), r"none.toml: cannot be read: No such file"),
        (lambda: tp.plan("pandaa", **TASK), r"'pandaa': is no robot, no scenario and no file.*did you mean panda\?"),
        (lambda: tp.plan([0.5, 0.5], **TASK), r"max_speed: missing; say how fast the joints may turn"),
        (lambda: tp.robot(ARM, max_speed=3.0), r"max_speed: the robot is complete"),
        (lambda: tp.plan("time-3", goal=[9.0, 9.0]), r"task\.goal: .* out of reach"),
        (planned(via=[1.0, 0.5]), r"via: a list of places is needed"),
        (planned(goal=reduce(lambda inner, _: [inner], range(5000), [])), r"an argument: nested too deeply"),
        (planned(obstacles=tp.Rectangle((0.9, 0.9), (0.1, 0.1))), r"obstacles: a list is needed"),
        (planned(obstacles=[3]), r"obstacles: 3 is none; say tp\.Box"),
        (planned(solver=3), r"solver: 3 is none"),
        (planned(solver=Hidden), r"Hidden: a plan names its classes; define it in a module"),
        (planned(evaluations=10.5), r"evaluations: a whole number is needed, not 10\.5"),
        (lambda: tp.compare("time-3", ["bso"], runs=ANY or "3"), r"runs: a whole number is needed"),
        (lambda: tp.pareto("time-3", ("time", "tim")), r"objectives: no objective 'tim'; did you mean time"),
        (lambda: tp.pareto("time-3", ANY or ("time",)), r"objectives time: two different ones are needed"),
        (lambda: tp.pareto("time-3", method="x"), r"method: .* is needed, not 'x'"),
        (lambda: tp.pareto("time-3", points=1), r"points: 1 is not within 2 and 1000"),
        (lambda: tp.pareto("time-3", points=ANY or "3"), r"points: a whole number is needed"),
        (lambda: tp.retime(ROWS), r"robot: missing; say which robot runs the path"),
        (lambda: tp.retime(ROWS, tp.PlanarArm((1.0,) * 3, (1.0,) * 3, (1.0,) * 3)), r"path: rows of 2 joints for"),
        (lambda: tp.retime("none.csv", TWO), r"none.csv: cannot be read"),
        (lambda: tp.retime(ROWS, TWO, interpolation="cubic"), r"interpolation: .* 'spline', 'blend' or 'fit'"),
        (lambda: tp.retime(ROWS, TWO, interpolation="blend"), r"tolerance: missing; say how far"),
        (lambda: tp.retime(tp.JointPath.through(ROWS), TWO, tolerance=0.1), r"tolerance: the path is complete"),
        *((lambda path=path: tp.retime(path, TWO), r"path: ") for path in NO_PATHS),
    ],
    ValueError: [
        (lambda: made().to_numpy(ANY or 3), r"times: numbers \(n,\) are needed, in s, not an array of sh"),
        (lambda: made().to_numpy(np.zeros((2, 2))), r"times: numbers \(n,\) .* shape \(2, 2\)"),
        (lambda: made().to_numpy(ANY or ["a"]), r"times: numbers \(n,\) are needed, in s, not \['a'\]"),
        (lambda: made().to_numpy(np.array([0.0, 99.0])), r"times: 99 s is not within the motion, 0 to"),
        (lambda: made().to_dataframe(np.array([-1.0])), r"times: -1 s is not within the motion"),
        (lambda: made().trajectory(99.0), r"times: 99 s is not within the motion, 0 to"),
        (lambda: made().trajectory(0.1, 7), r"derivative: 7 is none; there are those from 0 to 4"),
        (lambda: made().trajectory(0.1, ANY or "a"), r"derivative: a is none"),
        (lambda: made().save("never", figures=ANY), r"figures: kinds are needed, of png, .*; not None"),
        (lambda: made().save("never", figures=ANY or [["png"]]), r"figures: there is no kind \['png'\]"),
        (lambda: made().save("never", export="ros"), r"export: there is no kind 'ros'; there are "),
        (lambda: made().save("never", rate=ANY or "a"), r"rate: a number above 0 is needed, in Hz, not 'a'"),
        (lambda: made().player(height=-5), r"height: a number above 0 is needed, in pixels, not -5"),
        (lambda: made().plot("foo"), r"kind: there is no figure 'foo' of this plan; there are path, joints, limits"),
        (planned(polish="yes"), r"polish: True, False or a whole number is needed, not 'yes'"),
        (lambda: tp.plan(ANY), r"what: a scenario, its file \(\.toml\) or its name, a task .* not None"),
        (lambda: tp.plan(ANY or {"arm": 3}), r"what: a scenario, .* is needed, not \{'arm': 3\}"),
        (lambda: tp.audit(ANY or 3), r"what: a plan, the folder of a run, a scenario, .* is needed, not 3"),
        (lambda: tp.compare(ANY), r"scenarios: a scenario, its file .* is needed, not None"),
        (lambda: tp.compare(["time-2", "time-2"], "pso"), r"scenarios: time-2 is there twice; say a table"),
        (lambda: tp.compare("time-2", ["pso", tp.PSO]), r"solvers: pso is there twice; say a table"),
        (lambda: tp.compare("time-2", []), r"solvers: one at least is needed"),
        (lambda: tp.compare("time-2", "psoo"), r"time-2: psoo: solver.name: no solver 'psoo'; did you mean pso"),
        (lambda: tp.compare("time-2", "pso", runs=10**6), r"runs: a campaign has at most"),
        (lambda: tp.compare("time-2", "pso", runs=1, workers=10**6), r"workers: more than"),
        (lambda: tp.compare("time-2", ["pso"], runs=0), r"runs: 0 are none"),
        (lambda: tp.pareto(ARM, figures=["jpg"], **TASK), r"figures: there is no kind 'jpg'; there are png, pdf, svg"),
        (planned(objective=UNDEFINED), r"objective: 'cost' is undefined \(nan\) along the motion"),
        (limited(lambda m: math.sin(m.q[0]), lower=0.0), r"constraint .* say ca\.sin in place of math\.sin"),
        (limited(lambda m: m.q[0], lower=-np.inf), r"constraints\[0\]: .* has no bounds: say lower, upper"),
        (limited(lambda m: m.q[0], lower=np.inf), r"constraints\[0\] lower: a finite number is needed"),
        (lambda: tp.plan(ARM, path=[[1.0, 0.2], [np.nan, 0.6]], accuracy=0.1), r"path\[1\]\[0\]: a finite number is"),
    ],
    TypeError: [
        (planned(obstacle=[]), r"there is no keyword 'obstacle'; did you mean 'obstacles'\?$"),
        (lambda: tp.robot([0.5, 0.5], max_spead=1.0), r"there is no keyword 'max_spead'; did you mean 'max_speed'\?$"),
        (lambda: tp.robot("panda", paylod=1.0), r"there is no keyword 'paylod'; did you mean 'payload'\?$"),
        (planned(warm_start=3), r"warm_start: a tp\.Plan or the folder of a run is needed, not 3$"),
        (planned(evaluation=3), r"evaluation: a tp\.EvaluationOptions is needed, not 3$"),
        (planned(progress=3), r"progress: a tp\.Progress is needed, not 3"),
        (lambda: tp.compare("time-3", progress=ANY or 3), r"progress: a function is needed, not 3"),
        (lambda: tp.read_run(ANY), r"folder: a path is needed, .*, not None"),
        (lambda: made().animate(ANY), r"path: a path is needed, .*, not None"),
        (lambda: made().save(ANY), r"folder: a path is needed, .*, not None"),
    ],
    tp.OutputError: [
        (
            lambda: made().save("never", ["csv"], rate=1e9),
            "rate: input should be less than or equal to 10000",
        ),
        (lambda: made().animate("motion.avi"), r"animate .*motion.avi: the name must end with"),
    ],
    tp.InvalidRun: [(lambda: tp.audit("."), r".*cannot be read"), (lambda: tp.read_run("none"), r".*cannot be read")],
}


@pytest.mark.usefixtures("in_an_empty_folder")
@pytest.mark.parametrize(
    ("error", "call", "message"),
    [pytest.param(error, *mistake, id=mistake[1][:30]) for error, mistakes in MISTAKES.items() for mistake in mistakes],
)
def test_a_mistake_takes_one_line(error: type[Exception], call: Callable[[], object], message: str) -> None:
    with pytest.raises(error, match=f"^{message}") as caught:
        call()
    assert "\n" not in str(caught.value)
    assert not list(Path().iterdir())


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
        ("arm.toml: arm.max_speed: missing key", "arm.toml: arm.max_speed: missing key"),
        ("points: 1 is not enough", "points: 1 is not enough"),
    ],
)
def test_keys_and_options_become_arguments(message: str, expected: str) -> None:
    assert as_argument(message) == expected


def test_everything_may_be_of_numpy() -> None:
    arm = tp.robot(np.array([0.7, 0.7, 0.6]), max_speed=np.full(3, 4.0), max_acceleration=np.float64(20.0))
    boxes = (tp.Rectangle(tuple(np.array([x, 0.9])), (0.1, 0.1)) for x in np.linspace(1.6, 1.8, 2))
    scenario = tp.scenario_of(
        arm, start=np.array([1.0, 0.0]), goal=np.array([0.5, 1.5]), obstacles=boxes,
        objective={"time": np.float64(1.0), "rotation": np.float32(0.5)}, evaluations=np.int64(50), seed=np.int32(2),
    )  # fmt: skip
    assert scenario.problem().criteria.task.obstacles[1].center == (1.8, 0.9)
    assert (scenario.solver.evaluations, scenario.solver.seed) == (50, 2)
    assert scenario.robot_table.build() == ARM.model


def test_a_file_of_points(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x,y\n1.0,0.2\n1.2,0.6\n")
    scenario = tp.scenario_of(ARM, path=tmp_path / "path.csv", accuracy=0.1)
    assert scenario.problem().criteria.task.path.points == ((1.0, 0.2), (1.2, 0.6))


@dataclass(frozen=True)
class MyArm(tp.PlanarArm):
    """A robot of one's own."""


@dataclass(frozen=True)
class MySwarm(tp.PSO):
    """A solver of one's own."""


def test_ones_own_classes_are_given_as_objects_or_classes(tmp_path: Path) -> None:
    arm = MyArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3, margin=0.01)
    plan = tp.plan(arm, **TASK, solver=MySwarm(population=7), evaluations=50, polish=False)
    assert type(plan.motion.criteria.robot) is MyArm
    assert plan.motion.criteria.robot.margin == 0.01
    assert plan.scenario.solver.build() == MySwarm(population=7)
    assert tp.read_run(plan.save(tmp_path / "run", figures=())).motion.criteria.robot == arm
    assert type(tp.scenario_of(arm, **TASK, solver=MySwarm).solver.build()) is MySwarm


def test_a_class_of_a_notebook_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    import __main__  # noqa: PLC0415 (what a notebook's cells are)

    noted = type("Noted", (MySwarm,), {"__module__": "__main__", "__doc__": "Of a cell."})
    monkeypatch.setattr(__main__, "Noted", noted, raising=False)
    assert tp.scenario_of(ARM, **TASK, solver=noted).solver.kind() is noted


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


def test_times_that_are_outside_by_rounding_are_ends() -> None:
    plan = made()
    beyond = np.array([-1e-13, plan.duration * (1.0 + 1e-13)])
    ends = np.array([0.0, plan.duration])
    np.testing.assert_array_equal(plan.trajectory(beyond), plan.trajectory.at(ends))
    np.testing.assert_array_equal(plan.to_numpy(beyond)["t"], ends)
    np.testing.assert_array_equal(plan.trajectory(0.1, 1), plan.trajectory.at(np.array(0.1), 1))


@pytest.mark.parametrize("none", [-np.inf, None, [-np.inf, -np.inf], np.full(2, -np.inf)])
def test_a_bound_at_infinity_is_none(none: Any) -> None:
    opposite = None if none is None else -np.asarray(none)
    for given, meant in (((none, 2.0), (None, 2.0)), ((2.0, opposite), (2.0, None))):
        one, other = (
            tp.scenario_of(ARM, **TASK, constraints=tp.Constraint(lambda m: m.tool, *bounds)).model.constraints[0]
            for bounds in (given, meant)
        )
        assert one == other


def test_a_motion_that_breaks_limits_says_that_its_cost_is_undefined() -> None:
    never = tp.Constraint(lambda m: m.q[0] - m.q[0] + m.time * 0.0 + 1.0, upper=-1.0, name="never")
    plan = tp.plan(ARM, **QUICK, objective=UNDEFINED, constraints=never)
    assert not plan.certified
    assert repr(plan).startswith("<plan: cost is undefined, violated, T = ")
