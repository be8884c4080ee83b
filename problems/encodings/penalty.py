"""From objective and constraints to one number for a metaheuristic.

(15) adds lambda_1 times the broken limits to the objective and replaces both by lambda_2 (k_s + k_f) where the arm
cannot reach. With the round values that one would try first the order is inverted: most reachable but too fast
points cost more than unreachable ones, and a search settles on the latter. Here lambda_1 and lambda_2 follow from
bounds of what they multiply, so that always: feasible < breaks a limit < unreachable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, largest
from problems.limits.constraint import Constraint, PenaltyKind


@dataclass(frozen=True)
class Ceilings:
    """What no candidate of the search box can exceed.

    Attributes:
        objective: the objective, in its unit.
        magnitudes: by constraint name, the absolute value of each column of a ``PenaltyKind.MAGNITUDE`` constraint.
    """

    objective: float
    magnitudes: dict[str, FloatArray]


@dataclass(frozen=True)
class PenaltyWeights:
    """lambda_1 and lambda_2 of (15)."""

    lambda_1: float
    lambda_2: float


def penalty_weights(constraints: Sequence[Constraint], ceilings: Ceilings) -> PenaltyWeights:
    """The smallest weights that provably keep the order feasible < breaks a limit < unreachable."""
    lambda_1 = limit_weight(constraints, ceilings.objective)
    worst = sum(_largest_penalty(constraint, ceilings) for constraint in constraints)
    return PenaltyWeights(lambda_1, ceilings.objective + lambda_1 * worst)


def _largest_penalty(constraint: Constraint, ceilings: Ceilings) -> float:
    rows, width = constraint.expression.shape
    if constraint.weight is PenaltyKind.COUNT:
        return float(rows * width)
    return float(rows * np.sum(ceilings.magnitudes[constraint.name]))


def paper_cost(
    objective: Matrix, constraints: Sequence[Constraint], reach: Constraint, weights: PenaltyWeights
) -> Matrix:
    """(15), with |k_s| and |k_f| (the columns of ``reach``) where the paper prints k_s and k_f."""
    cosines = ca.fabs(reach.expression)
    reachable = largest(cosines) <= 1.0
    unreachable_cost = weights.lambda_2 * ca.sum2(cosines)
    return ca.if_else(reachable, penalised(objective, constraints, weights.lambda_1), unreachable_cost)


def penalised(objective: Matrix, constraints: Sequence[Constraint], lambda_1: float) -> Matrix:
    """F = f + lambda_1 sum h_i g_i: the upper branch of (15); (25), where lambda_1 is printed as 1."""
    return objective + lambda_1 * sum(constraint.paper_penalty() for constraint in constraints)


def limit_weight(constraints: Sequence[Constraint], ceiling: float) -> float:
    """The lambda_1 with which breaking any limit costs more than any feasible objective, at most ``ceiling``."""
    return ceiling / min(constraint.smallest_violation() for constraint in constraints)


def graded_cost(objective: Matrix, constraints: Sequence[Constraint], ceiling: float) -> Matrix:
    """The objective where all constraints hold, else its ceiling plus how far they are broken."""
    excess = sum((constraint.graded_penalty() for constraint in constraints), ca.DM(0))
    return ca.if_else(excess > 0.0, ceiling + excess, objective)
