"""Torque limits in every encoding: what time cannot cure never looks feasible; costs, bits, and what is compiled."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import following, moving
from helpers.evaluation import has_compiler, same_bits

from problems import CertificateStatus, Joints, Move, Path, PlanarArm, Problem, closed_curve, move
from problems.base import FloatArray, as_array
from problems.evaluation import EvaluationOptions
from problems.evaluation.codegen import cpp
from problems.evaluation.kernel import kernels
from problems.families.traced import tracing
from problems.robots import planar_payload
from problems.tasks import PathTracing
from solvers import SOLVERS, Box, Budget, minimize

VM = EvaluationOptions("vm")
LIMITS: dict[str, Any] = {"max_speed": (4.0,) * 3, "max_acceleration": (40.0,) * 3, "link_masses": (2.0, 2.0, 1.0)}
FRICTION = {"viscous_friction": (0.5, 0.5, 0.1), "coulomb_friction": (0.5, 0.5, 0.1)}
ARM = PlanarArm((0.5, 0.5, 0.4), **LIMITS, **FRICTION, max_torque=(28.0, 12.0, 3.0))  # too weak when stretched out
SMOOTH = PlanarArm((0.5, 0.5, 0.4), **LIMITS, max_torque=(24.0, 12.0, 3.0))
CURVE = closed_curve((0.45, -0.3), 0.2, 0.0, 4, -0.35, 12)
LINE = Path(((0.3, -0.6), (0.6, -0.3), (0.6, 0.1)))


def problems(robot: PlanarArm = ARM, objective: str = "time") -> dict[str, Problem[Any]]:
    task = Move(robot, Joints((-1.2, 0.4, 0.3)), (Joints((0.9, -0.9, 0.4)),))
    return {
        "two segments, paper": moving(robot, (0.3, -0.6), (0.3, 0.6), objective, "free", "paper", samples=15),
        "two segments, reduced": moving(robot, (0.3, -0.6), (0.3, 0.6), objective, "free", "reduced", samples=15),
        "path, paper": following(robot, CURVE, 0.1, objective, "free", "paper", samples=24),
        "path, reduced": following(robot, CURVE, 0.1, objective, "free", "reduced", samples=24),
        "move": move(task, objective, samples=24),
        "tracing": tracing(PathTracing(robot, LINE, 0.02), objective, samples=24, redundancy_values=3),
    }


EVERY = problems()
RESTORED = {"speed", "acceleration", "torque"}


def candidates(problem: Problem[Any], count: int = 300) -> FloatArray:
    box, rng = Box(*problem.bounds), np.random.default_rng(3)
    near = box.clip(np.mean(problem.bounds, axis=0) + rng.normal(0.0, 0.1, (count // 3, box.dimension)))
    return np.concatenate([box.sample(rng, count - len(near)), near])


def rows(problem: Problem[Any], name: str, x: FloatArray) -> FloatArray:
    """The largest of a constraint's rows over its bounds, for each candidate (m, d): (m,)."""
    found = [constraint for constraint in problem.constraints if constraint.name == name]
    function = ca.Function("rows", [problem.model.x], [ca.densify(c.expression) for c in found], {"cse": True})
    shares = [
        [np.abs(as_array(part)) / c.bounds[1] for part, c in zip(function.call([ca.DM(row)]), found, strict=True)]
        for row in x
    ]
    return np.array([max(float(part.max()) for part in share) for share in shares])


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize(("robot", "objective"), [(ARM, "time"), (ARM, "rotation"), (SMOOTH, "time")])
def test_feasible_candidates_keep_the_torques_at_the_samples(name: str, robot: PlanarArm, objective: str) -> None:
    problem = problems(robot, objective)[name]
    x = candidates(problem)
    costs, used = problem.evaluator(VM)(x), rows(problem, "torque", x)
    feasible = costs <= problem.objective_upper_bound
    assert (used[feasible] <= 1.0 + 1e-9).all()
    if problem.encoding.scales_time:
        assert feasible.any()
    assert (used > 1.0 + 1e-9).any()


@pytest.mark.parametrize("name", EVERY)
def test_arms_that_cannot_be_held_are_never_feasible_and_the_weakest_costs_most(name: str) -> None:
    """Gravity on so weak motors cannot be overcome: the cost says by how much."""
    costs = []
    for share in (0.05, 0.02):
        problem = problems(ARM)[name]
        robot = replace(ARM, max_torque=tuple(share * torque for torque in ARM.max_torque or ()))
        weak = problems_unchecked(name, robot)
        costs.append(weak.evaluator(VM)(candidates(problem)))
        assert (costs[-1] > weak.objective_upper_bound).all()
        assert np.isfinite(costs[-1]).all()
    if weak.encoding.scales_time:
        assert (np.diff(costs, axis=0) > 0.0).mean() > 0.99


def problems_unchecked(name: str, robot: PlanarArm) -> Problem[Any]:
    """The problem for a robot with which it would be refused."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("problems.tasks.checks.can_hold", lambda robot, theta: np.ones(len(theta), dtype=bool))
        return problems(robot)[name]


# What is compiled


def source(problem: Problem[Any]) -> str:
    return cpp(kernels(problem.program), problem.program.sizes)


@pytest.mark.parametrize("name", EVERY)
def test_another_payload_and_other_motors_compile_nothing(name: str) -> None:
    carrying = replace(SMOOTH, payload=planar_payload(0.2, (0.01, 0.0), 0.001), max_torque=(28.0, 14.0, 4.0))
    other = replace(carrying, payload=planar_payload(0.1, (0.02, 0.0), 0.002), max_torque=(30.0, 15.0, 4.5))
    one, two = problems(carrying)[name], problems(other)[name]
    assert source(one) == source(two)
    assert source(one) != source(EVERY[name])
    x = candidates(one, 60)
    assert (one.evaluator(VM)(x) != two.evaluator(VM)(x)).any()


@pytest.mark.parametrize("name", ["path, reduced", "move"])
def test_backends_agree_to_the_bit(name: str) -> None:
    if not has_compiler():
        pytest.skip("no C++ compiler")
    x = candidates(EVERY[name], 60)
    assert same_bits(EVERY[name].evaluator(VM)(x), EVERY[name].evaluator(EvaluationOptions("native"))(x))


@pytest.mark.parametrize("name", SOLVERS)
def test_every_solver_finds_motions_that_the_motors_can_do(name: str) -> None:
    problem = problems(SMOOTH)["two segments, reduced"]
    found = minimize(problem.evaluator(VM), Box(*problem.bounds), SOLVERS[name](), Budget(400), 1)
    assert found.cost <= problem.objective_upper_bound
    assert rows(problem, "torque", found.x[None])[0] <= 1.0 + 1e-9
    motion = problem.trajectory(found.x)
    slowed = motion.time_scaled(max(1.0, problem.safe_time_scale(motion)))
    torque = next(verdict for verdict in problem.verify(slowed) if verdict.name == "torque")
    assert torque.satisfied
    assert torque.status is CertificateStatus.CERTIFIED
