"""Torque limits in every encoding: what time cannot cure never looks feasible; costs, bits, what is compiled."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import following, moving
from helpers.searching import VM, source
from helpers.slow import slow_except

from problems import Joints, Move, Path, PlanarArm, Problem, Robot, closed_curve, move
from problems.base import FloatArray, as_array
from problems.families.traced import tracing
from problems.robots import planar_payload, read_urdf
from problems.tasks import PathTracing
from solvers import SearchBox

LIMITS: dict[str, Any] = {"max_speed": (4.0,) * 3, "max_acceleration": (40.0,) * 3, "link_masses": (2.0, 2.0, 1.0)}
FRICTION = {"viscous_friction": (0.5, 0.5, 0.1), "coulomb_friction": (0.5, 0.5, 0.1)}
ARM = PlanarArm((0.5, 0.5, 0.4), **LIMITS, **FRICTION, max_torque=(28.0, 12.0, 3.0))  # too weak when stretched out
SMOOTH = PlanarArm((0.5, 0.5, 0.4), **LIMITS, max_torque=(24.0, 12.0, 3.0))
CURVE = closed_curve((0.45, -0.3), 0.2, 0.0, 4, -0.35, 12)
LINE = Path(((0.3, -0.6), (0.6, -0.3), (0.6, 0.1)))


KINDS = ("two segments, paper", "two segments, reduced", "path, paper", "path, reduced", "move", "tracing")


@cache
def problem_of(kind: str, robot: PlanarArm = ARM, objective: str = "time") -> Problem[Any]:
    if kind == "move":
        task = Move(robot, Joints((-1.2, 0.4, 0.3)), (Joints((0.9, -0.9, 0.4)),))
        return move(task, objective, samples=24)
    if kind == "tracing":
        return tracing(PathTracing(robot, LINE, 0.02), objective, samples=24, redundancy_values=3)
    shape, formulation = kind.split(", ")
    if shape == "path":
        return following(robot, CURVE, 0.1, objective, "free", formulation, samples=24)
    return moving(robot, (0.3, -0.6), (0.3, 0.6), objective, "free", formulation, samples=15)


def candidates(problem: Problem[Any], count: int = 300) -> FloatArray:
    box, rng = SearchBox(*problem.bounds), np.random.default_rng(3)
    near = box.clip(np.mean(problem.bounds, axis=0) + rng.normal(0.0, 0.1, (count // 3, box.dimension)))
    return np.concatenate([box.sample(rng, count - len(near)), near])


def rows(problem: Problem[Any], name: str, x: FloatArray) -> FloatArray:
    """The largest of a constraint's rows over its bounds, for each candidate (m, d): (m,)."""
    found = [constraint for constraint in problem.model.constraints if constraint.name == name]
    function = ca.Function("rows", [problem.model.x], [ca.densify(c.expression) for c in found], {"cse": True})
    shares = [
        [np.abs(as_array(part)) / c.bounds[1] for part, c in zip(function.call([ca.DM(row)]), found, strict=True)]
        for row in x
    ]
    return np.array([max(float(part.max()) for part in share) for share in shares])


@pytest.mark.parametrize(
    ("kind", "robot", "objective"),
    slow_except([("move", SMOOTH, "rotation"), *((kind, ARM, "time") for kind in KINDS if kind != "move")], 2),
)
def test_feasible_candidates_keep_the_torques_at_the_samples(kind: str, robot: PlanarArm, objective: str) -> None:
    problem = problem_of(kind, robot, objective)
    x = candidates(problem, 40)
    costs, used = problem.evaluator(VM)(x), rows(problem, "torque", x)
    feasible = costs <= problem.objective_upper_bound
    assert (used[feasible] <= 1.0 + 1e-9).all()
    if problem.encoding.scales_time:
        assert feasible.any()
    assert (used > 1.0 + 1e-9).any()


@pytest.mark.parametrize("kind", slow_except(KINDS, ["two segments, paper", "move"]))
def test_arms_that_cannot_be_held_are_never_feasible_and_the_weakest_costs_most(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gravity on so weak motors cannot be overcome: the cost says by how much."""
    monkeypatch.setattr("problems.tasks.checks.can_hold", lambda robot, theta: np.ones(len(theta), dtype=bool))
    costs, x = [], candidates(problem_of(kind), 60)
    for share in (0.05, 0.02):
        weak = problem_of(kind, replace(ARM, max_torque=tuple(share * torque for torque in ARM.max_torque or ())))
        costs.append(weak.evaluator(VM)(x))
        assert (costs[-1] > weak.objective_upper_bound).all()
        assert np.isfinite(costs[-1]).all()
    if weak.encoding.scales_time:
        assert (np.diff(costs, axis=0) > 0.0).mean() > 0.99


# What is compiled


@pytest.mark.parametrize("kind", slow_except(["two segments, paper", "path, reduced", "move"], 1))
def test_another_payload_and_other_motors_compile_nothing(kind: str) -> None:
    carrying = replace(SMOOTH, payload=planar_payload(0.2, (0.01, 0.0), 0.001), max_torque=(28.0, 14.0, 4.0))
    other = replace(carrying, payload=planar_payload(0.1, (0.02, 0.0), 0.002), max_torque=(30.0, 15.0, 4.5))
    one, two = problem_of(kind, carrying), problem_of(kind, other)
    assert source(one) == source(two)
    assert source(one) != source(problem_of(kind))
    x = candidates(one, 60)
    assert (one.evaluator(VM)(x) != two.evaluator(VM)(x)).any()


# Torques that need not depend on angles: without gravity only friction is held, and sliding joints turn nothing


AFLOAT = PlanarArm(
    (0.5, 0.4), (4.0,) * 2, (40.0,) * 2, link_masses=(2.0, 1.0), max_torque=(20.0, 6.0), gravity=(0.0, 0.0)
)
RUBBING = replace(AFLOAT, viscous_friction=(0.2, 0.1), coulomb_friction=(0.5, 0.3))
INERTIA = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
GANTRY = f"""<robot name="gantry"><link name="base"/>
<link name="bridge"><inertial><mass value="5"/>{INERTIA}</inertial></link>
<link name="tool"><inertial><mass value="3"/>{INERTIA}</inertial></link>
<joint name="along" type="prismatic"><parent link="base"/><child link="bridge"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" velocity="2" effort="60"/></joint>
<joint name="up" type="prismatic"><parent link="bridge"/><child link="tool"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="2" effort="60"/></joint></robot>"""
SLIDING = read_urdf(GANTRY, None, None).arm(max_acceleration=40.0)


@pytest.mark.parametrize(
    ("robot", "objective"),
    [(AFLOAT, "work"), (RUBBING, "time"), (SLIDING, "energy")],
    ids=["afloat", "rubbing", "sliding"],
)
def test_candidates_can_be_evaluated_and_are_feasible_by_construction(robot: Robot, objective: str) -> None:
    problem = move(Move(robot, Joints((-0.4, 0.3)), (Joints((0.7, -0.2)),)), objective, samples=12)
    straight = np.mean(problem.bounds, axis=0)
    costs = problem.evaluator(VM)(straight[None, :])
    assert (costs <= problem.objective_upper_bound).all()
    [torque] = [constraint for constraint in problem.model.constraints if constraint.name == "torque"]
    used = as_array(ca.Function("used", [problem.model.x], [torque.expression])(straight))
    assert (np.abs(used) <= torque.bounds[1] * (1.0 + 1e-9)).all()
    assert np.abs(used).max() > 0.0
