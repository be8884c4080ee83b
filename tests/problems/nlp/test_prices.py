"""Shadow prices against finite differences of programs that are solved again with one number changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest

from problems import Constraint, Ellipse, Objective, PlanarArm, PointToPoint, Problem, Robot, point_to_point
from problems.base import FloatArray, Matrix
from problems.families.splines import move
from problems.limits import Limit
from problems.motions import Samples
from problems.nlp import Sensitivity, ranking, settled
from problems.nlp.optimality import parameter_slopes
from problems.robots import Payload
from problems.scene import Obstacle
from problems.tasks import Joints, Move
from solvers import IPOPT, Descent, Solution, StopReason
from tpbso_casadi.audit_report import prices_of

STEPS = (0.005, 0.003, -0.003, -0.005)  # of a number
EXACT = IPOPT(tolerance=1e-8, acceptable=1e-8, max_iterations=1000)


def arm(**changes: Any) -> PlanarArm:
    """Two rods with a kilogram in the hand, which strong motors at the shoulder and weak ones at the elbow move."""
    settings: dict[str, Any] = {
        "link_lengths": (0.5, 0.5), "max_speed": (4.0, 5.0), "max_acceleration": (40.0, 60.0),
        "link_masses": (2.0, 2.0), "max_torque": (45.0, 12.0), "payload": Payload(mass=1.0),
    }  # fmt: skip
    return PlanarArm(**(settings | changes))


def turning(robot: Robot, objective: Any, limits: Sequence[type[Limit]] = (), **more: Any) -> Problem[Any]:
    task = Move(robot, Joints((0.4, -1.6)), (Joints((1.9, -1.6)),), **more)
    return move(task, objective, samples=40, pieces=6, limits=limits)


def spline(robot: Robot) -> Problem[Any]:
    return turning(robot, "time")


def paper(robot: Robot) -> Problem[Any]:
    return point_to_point(PointToPoint(robot, (0.6, -0.3), (0.3, 0.6), elbow="down"), "time", "reduced", 50)


FORMS: dict[str, Callable[[Robot], Problem[Any]]] = {"spline": spline, "paper": paper}


@dataclass(frozen=True)
class Solved:
    """A program, solved."""

    problem: Problem[Any]
    solution: Solution

    @property
    def objective(self) -> float:
        return self.solution.objective * self.problem.nlp().objective_size


def solved(problem: Problem[Any], start: FloatArray | None = None) -> Solved:
    program = problem.nlp()
    descent = Descent(program, EXACT)
    starts = program.starts(np.random.default_rng(1)) if start is None else iter([start])
    for _ in range(5):
        solution = descent(next(starts))
        if solution.stop_reason is StopReason.CONVERGED:
            return Solved(problem, solution)
    raise AssertionError(solution.status)


@cache
def base(form: str) -> tuple[Solved, tuple[Sensitivity, ...]]:
    found = solved(FORMS[form](arm()))
    return found, prices_of(found.problem.nlp(), found.solution, found.problem)


def slope_of(base: Solved, solve: Callable[[float, FloatArray], Solved], steps: Sequence[float] = STEPS) -> float:
    """The derivative of an optimum by finite differences, solved again from it.

    Where pieces of a motion vanish there are optima close by, 1e-4 apart, and a descent may end in another one than
    before; the median of several differences is of those that do not.
    """
    return float(np.median([(solve(h, base.solution.x).objective - base.objective) / h for h in steps]))


def slope(form: str, changed: Callable[[float], PlanarArm]) -> float:
    """The derivative of the optimum with respect to the logarithm of a number."""
    return slope_of(base(form)[0], lambda h, start: solved(FORMS[form](changed(1.0 + h)), start))


def scaled(values: tuple[float, ...], joint: int, factor: float) -> tuple[float, ...]:
    return tuple(value * (factor if place == joint else 1.0) for place, value in enumerate(values))


def price_of(form: str, constraint: str, column: str) -> Sensitivity:
    return next(price for price in base(form)[1] if (price.constraint, price.column) == (constraint, column))


@pytest.mark.parametrize(
    ("form", "limit", "joint", "tolerance"),
    [
        ("spline", "speed", 0, 0.02),
        ("spline", "torque", 0, 0.02),
        pytest.param("spline", "torque", 1, 0.02, marks=pytest.mark.slow),
        pytest.param("paper", "speed", 0, 0.05, marks=pytest.mark.slow),
        pytest.param("paper", "torque", 0, 0.05, marks=pytest.mark.slow),
        ("paper", "torque", 1, 0.05),  # between two samples the largest torque is seen by neither
    ],
)
def test_what_a_looser_limit_buys(form: str, limit: str, joint: int, tolerance: float) -> None:
    field = f"max_{limit}"
    bound = slope(form, lambda factor: arm(**{field: scaled(getattr(arm(), field), joint, factor)}))
    price = price_of(form, limit, f"joint {joint + 1}")
    assert price.per_cent == pytest.approx(0.01 * bound, rel=tolerance)
    assert price.per_unit == pytest.approx(bound / getattr(arm(), field)[joint], rel=tolerance)
    assert price.limit_unit == {"speed": "rad/s", "torque": "N m"}[limit] and price.unit == f"s / ({price.limit_unit})"


@pytest.mark.parametrize(("form", "tolerance"), [("spline", 0.01), pytest.param("paper", 0.03, marks=pytest.mark.slow)])
def test_what_a_lighter_payload_buys(form: str, tolerance: float) -> None:
    heavier = slope(form, lambda factor: arm(payload=Payload(mass=factor)))
    price = price_of(form, "payload", "mass")
    assert price.per_unit == pytest.approx(-heavier, rel=tolerance)
    assert price.unit == "s / (kg)" and price.size == 1.0


@pytest.mark.slow
def test_masses_of_links_have_slopes_too() -> None:
    found, _ = base("spline")
    robot = found.problem.robot
    slopes = parameter_slopes(
        found.problem.nlp(), found.solution.x, found.solution.row_multipliers, robot, "link_masses"
    )
    for joint in range(2):
        heavier = slope("spline", lambda factor, j=joint: arm(link_masses=scaled((2.0, 2.0), j, factor)))
        assert 2.0 * slopes[joint] == pytest.approx(heavier, rel=0.02)


def only(constraint: str, found: Solved) -> Sensitivity:
    [price] = [p for p in prices_of(found.problem.nlp(), found.solution, found.problem) if p.constraint == constraint]
    return price


def test_a_range_that_binds_is_worth_its_width() -> None:
    def planned(lowest: float, start: FloatArray | None = None) -> Solved:
        return solved(spline(arm(joint_limits=((-3.0, 3.0), (lowest, 1.0)))), start)

    found = planned(-1.75)
    price = only("joint range", found)
    assert price.column == "joint 2" and price.size == pytest.approx(2.75)
    steps = (0.005, 0.002, 0.001, -0.001, -0.002, -0.005)
    assert price.per_unit == pytest.approx(slope_of(found, lambda h, x: planned(-1.75 - h, x), steps), rel=0.06)


class Slow(Limit):
    """The second joint is slower than its motor allows; a limit that nothing else knows."""

    name = "slow elbow"

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Slow:
        return cls()

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        speed, most = samples.speed[:, 1], ca.DM([[2.0]])
        return [
            Constraint(
                name=self.name, unit="rad/s", expression=speed, lower=-most, upper=most, symmetric=True,
                columns=("joint 2",), scale=most,
            )
        ]  # fmt: skip


def test_a_limit_of_a_plug_in_is_ranked_by_existing() -> None:
    found = solved(turning(arm(), "time", [Slow]))
    ranked = ranking(prices_of(found.problem.nlp(), found.solution, found.problem))
    assert "slow elbow" in [price.constraint for price in ranked]
    assert [price.per_cent for price in ranked] == sorted(price.per_cent for price in ranked)


@pytest.mark.slow
def test_a_margin_around_an_obstacle() -> None:
    ball = Ellipse(center=(0.57, 0.28), semi_axes=(0.05, 0.05))

    def planned(margin: float, start: FloatArray | None = None) -> Solved:
        return solved(turning(arm(margin=margin), "time", obstacles=(ball,)), start)

    found = planned(0.02)
    prices = prices_of(found.problem.nlp(), found.solution, found.problem)
    kept = [price for price in prices if price.constraint.endswith("clearance")]
    assert kept and all(price.size == pytest.approx(0.02) and price.limit_unit == "m" for price in kept)
    worse = slope_of(found, lambda h, x: planned(0.02 + h, x), (2e-4, 1e-4, -1e-4, -2e-4))
    assert sum(price.per_unit for price in kept) == pytest.approx(-worse, rel=0.1)  # which lengthens steps, too


def test_a_longer_time_saves_effort() -> None:
    class Effort(Objective):
        name, symbol, unit = "effort", "E", "rad^2/s^3"

        def at(self, samples: Samples) -> Matrix:
            return ca.sum2(samples.acceleration**2) * samples.weights

    def planned(longest: float, start: FloatArray | None = None) -> Solved:
        return solved(turning(arm(), Effort(), total_time=(0.3, longest)), start)

    found = planned(0.8)
    price = only("total time", found)
    assert price.per_unit == pytest.approx(slope_of(found, lambda h, start: planned(0.8 + h, start)), rel=0.01)
    assert price.unit == "rad^2/s^3 / (s)"


def test_multipliers_of_an_interior_point_are_settled() -> None:
    values, bounds = np.array([0.0, 0.999, 1.0, 0.3]), (np.full(4, -1.0), np.full(4, 1.0))
    kept = settled(values, bounds, np.array([1e-7, 0.5, 1e-3, -1e-6]))
    assert kept.tolist() == [0.0, 0.5, 1e-3, 0.0]


@pytest.mark.slow
def test_what_a_lighter_payload_saves_of_energy() -> None:
    def planned(mass: float, start: FloatArray | None = None) -> Solved:
        return solved(turning(arm(payload=Payload(mass=mass)), "energy", total_time=(0.3, 0.8)), start)

    found = planned(1.0)
    price = only("payload", found)
    heavier = slope_of(found, lambda h, start: planned(1.0 + h, start), (0.005, 0.003, 0.001, -0.001, -0.003, -0.005))
    assert price.per_unit == pytest.approx(-heavier, rel=0.01)
    assert price.unit == "N^2 m^2 s / (kg)"
