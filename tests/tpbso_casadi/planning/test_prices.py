"""What limits are worth at the optimum near a plan, against plans of scenarios in which they are stated otherwise.

The oracle shares no code with what is tested: IPOPT plans another scenario from its own starts, and the certified
objectives of two plans, one on each side, make a central difference.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np
import pytest

import tpbso_casadi as tp
from problems import Constraint, Limit, PlanarArm, Problem, Robot
from problems.base import STEP
from problems.families.splines import move
from problems.motions import Samples
from problems.scene import Obstacle
from problems.tasks import Joints, Move
from solvers import IPOPT
from tpbso_casadi.planning import JudgedMotion, PlannedMotion, nearest_optimum, plan
from tpbso_casadi.planning import optimum as optimum_module
from tpbso_casadi.planning.finishing import Refinement
from tpbso_casadi.planning.optimum import Price, Pricing, ProgramPlanner

FOREVER = float("inf")


@pytest.fixture(autouse=True)
def time_for_all_prices(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optimum_module, "LONGEST", FOREVER)


def by_gradients(content: dict[str, Any], starts: int) -> PlannedMotion:
    """A scenario without its last stage, planned by IPOPT alone."""
    model = {**content.get("model", {}), "retime": False}
    solver = {"name": "ipopt", "iterations": starts}
    return plan(tp.parse_scenario({**content, "model": model, "solver": solver}))


def stated(case: str) -> dict[str, Any]:
    return tp.builtin(case).table()


def with_limit(case: str, key: str, joint: int, starts: int) -> Callable[[float], PlannedMotion]:
    """A built-in case with another limit of a joint, by a factor."""

    def planned(factor: float) -> PlannedMotion:
        content = stated(case)
        links, value = len(content["arm"]["link_lengths"]), content["arm"][key]
        values = list(value) if isinstance(value, (list, tuple)) else [value] * links
        values[joint] *= factor
        return by_gradients({**content, "arm": {**content["arm"], key: values}}, starts)

    return planned


def with_accuracy(factor: float) -> PlannedMotion:
    content = stated("closed-curve-rotation")
    accuracy = 0.7 * content["task"]["accuracy"] * factor  # which is reached, too
    return by_gradients({**content, "task": {**content["task"], "accuracy": accuracy}}, 3)


def with_margin(factor: float) -> PlannedMotion:
    content = stated("obstacle-3")
    return by_gradients({**content, "model": {**content["model"], "margin": 0.02 * factor}}, 4)


WIDTH = 0.25  # m, between the bounds of the tip's height


def under_a_ceiling(factor: float) -> PlannedMotion:
    """An own constraint, as wide on both sides; a factor of 1.01 widens each by a hundredth of the width."""
    wider = (factor - 1.0) * WIDTH
    ceiling = tp.Constraint(lambda m: m.tool[1], lower=0.2 - wider, upper=0.2 + WIDTH + wider, name="ceiling", unit="m")
    arm = tp.robot([0.8, 0.7, 0.6], max_speed=2.0, max_acceleration=6.0)
    ends = {"start": [1.4, 0.3], "goal": [-1.4, 0.3], "elbow": "up"}
    how = {"motion": "paper", "solver": "ipopt", "iterations": 3, "retime": False}
    return tp.plan(arm, constraints=[ceiling], **ends, **how).planned


def price_of(motion: JudgedMotion, problem: Problem[Any], limit: str, of: str) -> Price | None:
    own = ProgramPlanner(problem, False, FOREVER)
    ends = own.optimum(motion)
    assert ends is not None
    criteria = problem.criteria
    stated = [*criteria.task.relaxations, *(each for kept in criteria.limits for each in kept.relaxations)]
    [relaxation] = [each for each in stated if (each.limit, each.of) == (limit, of)]
    return Pricing(own, *ends, (motion,)).price(relaxation)


@dataclass(frozen=True)
class Case:
    """A limit, plans by factors of it, the factors on both sides, and how far the price may be off."""

    limit: str
    of: str
    planned: Callable[[float], PlannedMotion]
    away: float = 0.02
    tolerance: float = 0.05


CASES: Mapping[str, Case] = {
    "point to point": Case("acceleration", "joint 1", with_limit("time-2", "max_acceleration", 0, 4)),
    "own constraint": Case("ceiling", "value", under_a_ceiling),
    "obstacle": Case("clearance", "margin", with_margin, away=0.2),
    "path": Case("acceleration", "joint 3", with_limit("closed-curve-time", "max_acceleration", 2, 4)),
    "accuracy of a path": Case("accuracy", "tip", with_accuracy, tolerance=0.15),  # it is worth less, the more there is
}
SLOW = {"own constraint", "obstacle", "path", "accuracy of a path"}


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n in SLOW)) for n in CASES])
def test_a_looser_limit_buys_what_its_price_says(name: str) -> None:
    case = CASES[name]
    base = case.planned(1.0)
    price = price_of(base.motion, base.problem, case.limit, case.of)
    assert price is not None
    bought = (case.planned(1.0 + case.away).objective - case.planned(1.0 - case.away).objective) / (2.0 * case.away)
    if case.limit == "clearance":
        bought = -bought  # less of a margin is looser
    assert bought < 0.0
    assert price.per_cent == pytest.approx(STEP * bought, rel=case.tolerance)
    assert price.per_unit == pytest.approx(bought / price.size, rel=case.tolerance)


def joints(speed: float, acceleration: float, jerk: float | None = None, **more: Any) -> PlanarArm:
    jerks = None if jerk is None else (jerk,) * 2
    return PlanarArm((1.0, 1.0), (speed,) * 2, (acceleration,) * 2, max_jerk=jerks, **more)


def descended(problem: Problem[Any]) -> JudgedMotion:
    """The better of two descents from the program's own starts."""
    refinement = Refinement(problem, IPOPT())
    starts = islice(refinement.program.starts(np.random.default_rng(1)), 2)
    return min((refinement.motion(refinement(start).x) for start in starts), key=lambda motion: motion.merit)


def turning(robot: PlanarArm, goal: tuple[float, float] = (3.0, 0.5), **more: Any) -> Problem[Any]:
    return move(Move(robot, Joints((0.0, 0.5)), (Joints(goal),)), "time", pieces=6, **more)


def test_prices_are_those_of_the_closed_form() -> None:
    """T = D / v + v / a + a / j: what one per cent more of speed, acceleration and jerk takes away."""
    way, limits = 3.0, {"speed": 2.0, "acceleration": 8.0, "jerk": 60.0}

    def least(speed: float, acceleration: float, jerk: float) -> float:
        return way / speed + speed / acceleration + acceleration / jerk

    problem = turning(joints(**limits))
    motion = descended(problem)
    assert motion.objective == pytest.approx(least(**limits), rel=1e-4)
    for limit, value in limits.items():
        price = price_of(motion, problem, limit, "joint 1")
        changed = least(**(limits | {limit: 1.01 * value})) - least(**limits)
        if changed > 0.0:  # more of it than is used
            assert price is None or not price.saves
        else:
            assert price is not None and price.per_cent == pytest.approx(changed, rel=0.02)
        price = price_of(motion, problem, limit, "joint 2")  # which stands still
        assert price is not None
        assert not price.saves


class Slow(Limit):
    """The first joint is slower than its motor allows; a limit that nothing else knows, with its number in its code."""

    name = "slow shoulder"

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Slow:
        return cls()

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        most = ca.DM([[1.5]])
        return [
            Constraint(
                name=self.name, unit="rad/s", expression=samples.speed[:, 0], lower=-most, upper=most, symmetric=True,
                columns=("joint 1",), scale=most,
            )
        ]  # fmt: skip


def test_a_limit_without_a_stated_number_has_no_price_and_is_named() -> None:
    problem = turning(joints(2.0, 8.0), limits=[Slow])
    motion = descended(problem)
    optimum = nearest_optimum(problem, motion, motion, retimes=False)
    assert optimum is not None and optimum.unpriced == ("slow shoulder",)
    assert "slow shoulder" not in {price.constraint for price in optimum.ranking}


def test_prices_are_ranked_and_agree_with_each_other() -> None:
    """Of a robot that turns all out, every time is a sum of powers of its limits: the shares add up to it."""
    problem = turning(joints(20.0, 8.0))
    motion = descended(problem)  # T = 2 (D / a)^(1/2)
    optimum = nearest_optimum(problem, motion, motion, retimes=False)
    assert optimum is not None and abs(optimum.excess) < 1e-4
    [price] = optimum.ranking
    assert (price.constraint, price.column, price.limit_unit, price.unit) == (
        "acceleration", "joint 1", "rad/s^2", "s / (rad/s^2)"
    )  # fmt: skip
    assert price.per_cent == pytest.approx(2.0 * (3.0 / 8.0) ** 0.5 * (1.01**-0.5 - 1.0), rel=0.02)
    assert price.per_unit == pytest.approx(price.per_cent / (STEP * price.size))


def test_what_there_was_no_time_for_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = turning(joints(20.0, 8.0))
    motion, found_in_time = descended(problem), ProgramPlanner.optimum

    def at_the_last_moment(own: ProgramPlanner, start: JudgedMotion) -> Any:
        ends = found_in_time(own, start)
        own.deadline = 0.0
        return ends

    monkeypatch.setattr(ProgramPlanner, "optimum", at_the_last_moment)
    optimum = nearest_optimum(problem, motion, motion, retimes=False)
    assert optimum is not None and optimum.unpriced == ("acceleration",) and not optimum.ranking


@pytest.mark.slow
def test_what_holds_a_plan_back_need_not_hold_back_its_optimum() -> None:
    """A polish sees speeds at few times, and slows the whole down for the others: its plan is held back by a speed.

    At the optimum accelerations hold it back, and more of them does nothing for the plan as it is.
    """
    content = stated("pentagram-time")
    solver = {"name": "bso", "evaluations": 3000, "polish_starts": 1}
    found = plan(tp.parse_scenario({**content, "solver": solver}))
    assert found.feasible
    optimum = nearest_optimum(found.problem, found.motion, found.motion, retimes=False)
    assert optimum is not None and optimum.excess > 0.05
    assert optimum.program == pytest.approx(optimum.objective, rel=1e-3)
    first, *others = optimum.ranking
    assert (first.constraint, first.column, first.per_unit) == ("speed", "joint 1", 0.0)
    assert first.timed_per_cent == pytest.approx(found.objective * (1.0 / 1.01 - 1.0), rel=0.02)
    assert {(price.constraint, price.timed_again) for price in others} == {("acceleration", 0.0)}
    assert all(price.per_unit < 0.0 for price in others)


@pytest.mark.slow
def test_an_optimum_is_a_motion_that_exists() -> None:
    """A smoothed length is less than that of the straight line, which no motion's is."""
    content = stated("obstacle-3")
    found = plan(tp.parse_scenario({**content, "solver": {"name": "bso", "evaluations": 1000}}))
    assert found.feasible
    straight = float(np.hypot(*np.subtract(content["task"]["goal"], content["task"]["start"])))
    optimum = nearest_optimum(found.problem, found.motion, found.motion, retimes=False)
    assert optimum is not None and optimum.program < straight < optimum.objective
    assert optimum.excess == pytest.approx(found.objective / optimum.objective - 1.0)
    [price] = optimum.ranking  # nothing counts but the obstacle, whose margin of nothing can only grow
    assert (price.constraint, price.column, price.size, price.per_cent) == ("clearance", "margin", 0.0, 0.0)
    assert price.step < 0.0 and price.per_unit < 0.0
