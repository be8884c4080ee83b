"""The optimum nearest to a plan, and what holds it back.

A finished motion is hardly ever an optimum of the nonlinear program: a search's is not, sequential programs and the
last stage have programs of their own, and what breaks a limit between samples is run more slowly as a whole. IPOPT
descends from it to the nearest optimum, whose multipliers are the shadow prices.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from problems import Problem, Trajectory
from problems.base.matrix import FloatArray, as_array
from problems.limits.limit import Limit
from problems.nlp.optimum.parameters import payload_price
from problems.nlp.optimum.prices import Sensitivity, ranking, sensitivities, settled
from problems.nlp.program import NonlinearProgram, TimedProgram
from solvers import IPOPT, Descent, Solution, StopReason
from tpbso_casadi.planning.motion import Motion

LONGEST = 60.0  # s, of a descent
CHECKED_TIMES = 401  # at which limits that were left out have to hold
BROKEN = -1e-3  # of the scale of a limit


@dataclass(frozen=True)
class Optimum:
    """An optimum of a plan's nonlinear program.

    Attributes:
        objective: at the optimum, in its unit.
        excess: of the plan's objective over it, relative.
        status: of IPOPT.
        residuals: of the conditions of optimality there.
        sensitivities: shadow prices, the largest first.
        seconds: that it took.
    """

    objective: float
    excess: float
    status: str
    residuals: dict[str, float]
    sensitivities: tuple[Sensitivity, ...]
    seconds: float

    @property
    def ranking(self) -> list[Sensitivity]:
        """What holds the motion back: that of which one per cent more saves most first."""
        return ranking(self.sensitivities)


def nearest_optimum(problem: Problem[Any], motion: Motion) -> Optimum | None:
    """Descend from a motion of a problem's form; None where no optimum is found.

    Limits from which the motion is far are left out, and put back if the optimum breaks one.
    """
    began = time.perf_counter()
    whole = problem.nlp()
    found = None
    near = whole.near(motion.trajectory)
    for program in (whole,) if near is whole else (near, whole):
        solution = _descended(program, motion.trajectory)
        if solution.stop_reason is not StopReason.CONVERGED:
            return None
        found = program, solution
        if program is whole or _holds(problem.limits, program.trajectory(solution.x), problem):
            break
    assert found is not None
    program, solution = found
    objective = solution.objective * program.objective_size
    return Optimum(
        objective=objective,
        excess=(motion.objective - objective) / abs(objective) if objective else 0.0,
        status=solution.status,
        residuals=solution.residuals,
        sensitivities=prices_of(program, solution, problem),
        seconds=time.perf_counter() - began,
    )


def prices_of(program: NonlinearProgram, solution: Solution, problem: Problem[Any]) -> tuple[Sensitivity, ...]:
    """Shadow prices of limits and of the payload at a solution, the largest first."""
    z, unit, robot = solution.x, problem.objective.unit, problem.robot
    lower, upper = program.bounds_near(z)
    own = settled(z, (lower, upper), np.where(lower == upper, 0.0, solution.bound_multipliers))
    rows = settled(_rows(program, z), program.row_bounds(), solution.row_multipliers)
    prices = sensitivities(program, z, np.concatenate([rows, own]), unit, robot)
    carried = payload_price(program, z, rows, unit) if isinstance(program, TimedProgram) else None
    return tuple(sorted([*prices, *([] if carried is None else [carried])], key=lambda price: price.per_unit))


def _descended(program: NonlinearProgram, trajectory: Trajectory) -> Solution:
    descent = Descent(program, IPOPT())
    descent.stop.deadline = time.perf_counter() + LONGEST
    return descent(program.from_trajectory(trajectory))


def _rows(program: NonlinearProgram, z: FloatArray) -> FloatArray:
    """The scaled rows at variables (n,), (r,)."""
    return as_array(ca.Function("rows", [program.x], [program.g])(z)).ravel()


def _holds(limits: Iterable[Limit], trajectory: Trajectory, problem: Problem[Any]) -> bool:
    """Whether a motion keeps limits, about, at many times."""
    samples = trajectory.samples(trajectory.times(CHECKED_TIMES), problem.robot)
    return all(row.room > BROKEN for limit in limits for row in limit.constraints(samples) if row.for_all_t)
