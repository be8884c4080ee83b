"""Constraints and objectives of a user's own from Python: planned, proven, stored, and computed again elsewhere."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from shutil import copytree
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np
import pytest

import tpbso_casadi as tp
from problems import Constraint, Limit, Robot
from problems.motions import Samples
from problems.objectives.catalogue import Energy, ExecutionTime
from tpbso_casadi.cli.commands import audit
from tpbso_casadi.facade.own import StatedConstraint, StatedCost
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.storage import sealed

LENGTHS = (0.8, 0.7, 0.6)
START, GOAL = [1.4, 0.3], [-1.4, 0.3]
ARM = tp.robot(list(LENGTHS), max_speed=2.0, max_acceleration=6.0)


def planned(**keys: Any) -> Plan:
    return tp.plan(ARM, start=START, goal=GOAL, **({"evaluations": 600, "seed": 1} | keys))


def tips(plan: Plan, times: np.ndarray) -> np.ndarray:
    """Where the tip is, by nothing of ours but the joint angles."""
    angles = np.cumsum(plan.trajectory(times), axis=1)
    return np.column_stack([np.cos(angles) @ LENGTHS, np.sin(angles) @ LENGTHS])


def densely(plan: Plan) -> np.ndarray:
    return np.linspace(0.0, plan.duration, 20_000)


CEILING = StatedConstraint(lambda m: m.tool[1], lower=0.2, upper=0.45, name="ceiling", unit="m")
CALM = StatedCost(lambda m: ca.sumsqr(m.speed), name="calm", unit="rad^2/s", terminal=lambda m: 2.0 * m.duration)


@pytest.fixture(scope="module")
def calm_plan() -> Plan:
    return planned(constraints=[CEILING], objective=[(1.0, "time"), (0.1, CALM)])


@pytest.fixture(scope="module")
def run_folder(calm_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return calm_plan.save(tmp_path_factory.mktemp("own") / "run", figures=())


def verdict_of(plan: Plan, name: str) -> Any:
    return next(verdict for verdict in plan.verdicts if verdict.name == name)


def test_an_active_ceiling_is_kept_and_proven(calm_plan: Plan) -> None:
    heights = tips(calm_plan, densely(calm_plan))[:, 1]
    assert calm_plan.certified
    assert heights.max() <= 0.45
    assert heights.min() >= 0.2
    assert verdict_of(calm_plan, "ceiling").worst == pytest.approx(heights.max(), abs=1e-4)
    assert heights.max() > 0.44  # it is what holds the motion back


def test_the_objective_is_the_integral(calm_plan: Plan) -> None:
    times = np.linspace(0.0, calm_plan.duration, 400_001)
    rate = (calm_plan.trajectory(times, 1) ** 2).sum(axis=1)
    calm = float(np.trapezoid(rate, times)) + 2.0 * calm_plan.duration
    assert calm_plan.objective == pytest.approx(calm_plan.duration + 0.1 * calm, rel=1e-8)


def test_what_breaks_it_is_called_violated() -> None:
    never = tp.Constraint(lambda m: m.tool[1], lower=0.5, name="too high", unit="m")  # the start is lower
    plan = planned(constraints=[never], polish=False, evaluations=60)
    assert not plan.certified
    assert verdict_of(plan, "too high").status == "violated"
    assert verdict_of(plan, "too high").worst == pytest.approx(0.3, abs=1e-6)


def test_a_run_folder_is_complete_without_python(
    run_folder: Path, calm_plan: Plan, capfd: pytest.CaptureFixture[str]
) -> None:
    content = json.loads((run_folder / "result.json").read_text())
    [constraint] = content["scenario"]["model"]["constraints"]
    assert constraint == {"name": "ceiling", "unit": "m", "lower": 0.2, "upper": 0.45, "expression": "= tool[1]"}
    assert audit.main([str(run_folder)]) == 0
    told = capfd.readouterr().out
    assert "certified" in told and "ceiling" in told and f"calm {calm_plan.objective:.6g}" in told


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"expression": "= tool[7]"}, r"'ceiling': tool[7] of 2"),
        ({"expression": "w0 = os_system(q[0])"}, "no operation 'os_system'"),
        ({"upper": 0.35}, "ceiling"),
    ],
)
def test_a_changed_run_is_refused(
    run_folder: Path, tmp_path: Path, changes: dict[str, Any], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copytree(run_folder, tmp_path / "run")
    content = json.loads((folder / "result.json").read_text())
    content["scenario"]["model"]["constraints"][0] |= changes
    resealed = sealed({key: value for key, value in content.items() if key != "seal"})
    (folder / "result.json").write_text(json.dumps(resealed))
    assert audit.main([str(folder)]) == 2
    told = capsys.readouterr().err
    assert reason in told
    assert told.count("\n") == 1


def test_own_constraints_and_objectives_have_short_names_and_are_written_where_there_are_any() -> None:
    assert repr(CEILING) == "<constraint 'ceiling': lower=0.2, upper=0.45, m>"
    assert repr(tp.Cost(lambda m: 1.0, name="clock", unit="s")) == "<objective 'clock', s>"
    content = tp.builtin("time-3").table()
    assert "constraints" not in content["model"] and "objectives" not in content["task"]


@dataclass(frozen=True)
class LowElbow(Limit):
    """The first joint stays below 2.8 rad."""

    name: ClassVar[str] = "low elbow"
    robot: Robot

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Any) -> Self:
        return cls(robot)

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        bound = ca.DM(2.8 - margin)
        row: dict[str, Any] = {"expression": samples.theta[:, 0], "lower": None, "upper": bound}
        return [Constraint(name=self.name, unit="rad", columns=("joint 1",), **row)]


def test_classes_are_stored_by_their_paths(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "own_limits", sys.modules[__name__])
    monkeypatch.setattr(LowElbow, "__module__", "own_limits")
    for given in (LowElbow, LowElbow(ARM.model)):
        plan = planned(constraints=[given, CEILING], objective=ExecutionTime(), evaluations=60, polish=False)
        assert plan.scenario.model.limits == ["own_limits:LowElbow"]
        assert {"low elbow", "ceiling"} <= {verdict.name for verdict in plan.verdicts}
        assert plan.scenario.task.stated_objective == "time"


# Errors: one line that names the constraint and what to do


FREE = ca.SX.sym("x")
CONSTRAINTS: list[tuple[Any, str]] = [
    (tp.Constraint(lambda m: m.tool[1], name="a"), "'a' has no bounds: say lower, upper, or both"),
    (tp.Constraint(lambda m: m.tool[1], lower=2, upper=1, name="a"), "'a': lower 2 is not below upper 1"),
    (tp.Constraint(lambda m: m.tool[1], lower=float("nan"), name="a"), "lower: a finite number"),
    (tp.Constraint(lambda m: m.tool[1], lower=[1, 2], name="a"), "'a': lower has 2 numbers, the expression 1"),
    (tp.Constraint(lambda m: m.tool[2], lower=1, name="a"), "constraint 'a': an index is out of range: 2 in all"),
    (tp.Constraint(lambda m: m.torque, lower=1, name="a"), "constraint 'a': torque: torques need masses"),
    (tp.Constraint(lambda m: m.rotation, lower=1, name="a"), "in space only"),
    (tp.Constraint(lambda m: 1 if m.q[0] > 0 else 2, lower=1, name="a"), "say ca.if_else"),
    (tp.Constraint(lambda m: "no", lower=1, name="a"), "gives str, where a number or vector"),
    (tp.Constraint(lambda m: ca.SX(2, 2), lower=1, name="a"), "gives a matrix of 2 x 2"),
    (tp.Constraint(lambda m: m.q[0] + FREE, lower=1, name="a"), "depends on x, which is nothing of the motion"),
    (tp.Constraint(lambda m: m.sped, lower=1, name="a"), "no attribute 'sped'; m has q, theta, speed"),
    (tp.Constraint(lambda m: m.q[0] * np.inf, lower=1, name="a"), "holds the number inf"),
    (tp.Constraint(lambda m: ca.erfinv(m.q[0]), lower=1, name="a"), "which is in no table"),
    (tp.Constraint(3, lower=1, name="a"), "constraint 'a': a function of one instant is needed"),  # type: ignore[arg-type]
    (3, "3 is no tp.Constraint"),
    (tp.Constraint(lambda m: m.q[0], lower=1, name="speed"), "'speed' is the name of one of ours"),
    (tp.Constraint(lambda m: m.q[0], lower=1, name=" "), "a name in printable characters"),
]


OBJECTIVES: list[tuple[Any, str]] = [
    (tp.Cost(lambda m: m.tool, name="c"), "'c': one number is needed"),
    (tp.Cost(name="c"), "'c': nothing is minimised"),
    (tp.Cost(terminal=lambda m: m.q[0], name="c"), "'c': terminal may depend on m.duration alone"),
    (tp.Cost(lambda m: m.q[0], name="time"), "'time' is the name of one of ours"),
    ([(1, "time"), (2, "time")], "two have the same name"),
    ([1], "pairs of a weight and an objective are needed"),
    ({tp.Cost(lambda m: 1.0): -1.0}, "objective.cost"),
    (5, "5 is no name, no tp.Cost"),
    (Energy, "'energy' needs masses"),
    ("calm", "not 'calm'"),
]
TWICE = [tp.Constraint(lambda m: m.q[0], lower=1)] * 2
ERRORS: list[tuple[dict[str, Any], str]] = [
    *(({"constraints": [given]}, reason) for given, reason in CONSTRAINTS),
    ({"constraints": TWICE}, "'constraint' is there twice; give each a name"),
    *(({"objective": given}, reason) for given, reason in OBJECTIVES),
]


@pytest.mark.parametrize(("keys", "reason"), ERRORS, ids=[reason for _, reason in ERRORS])
def test_errors_name_what_to_do(keys: dict[str, Any], reason: str) -> None:
    with pytest.raises(tp.ScenarioError) as error:
        planned(**keys, evaluations=30, polish=False).verdicts  # noqa: B018
    assert reason in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_a_panda_keeps_them() -> None:
    panda = tp.robot("panda")
    start, goal = [0.0, -0.5, 0.0, -2.2, 0.0, 1.8, 0.8], [1.4, 0.5, 0.2, -1.4, 0.3, 2.0, 0.2]
    kept = [
        tp.Constraint(lambda m: m.tool[2], upper=0.6, lower=0.25, name="height", unit="m"),
        tp.Constraint(lambda m: ca.norm_2(m.tool_velocity), upper=0.8, name="tool speed", unit="m/s"),
        tp.Constraint(lambda m: m.q[1] + m.q[3], lower=-2.75, upper=-0.85, name="coupling", unit="rad"),
        tp.Constraint(lambda m: m.rotation[2, 2], upper=-0.5, name="downwards"),
    ]
    ends = {"start": tp.Joints(tuple(start)), "goal": tp.Joints(tuple(goal))}
    plan = tp.plan(panda, **ends, constraints=kept, evaluations=800, polish=False)
    assert plan.certified
    times = densely(plan)
    theta = plan.trajectory(times)
    place, rotation = panda.model.tool.at(theta)  # type: ignore[attr-defined]
    assert 0.25 <= place[:, 2].min() <= place[:, 2].max() <= 0.6
    assert np.linalg.norm(np.diff(place, axis=0), axis=1).max() / times[1] <= 0.8
    assert rotation[:, 2, 2].max() <= -0.5
    assert (np.abs(theta[:, 1] + theta[:, 3] + 1.8) <= 0.95).all()
