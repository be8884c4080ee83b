"""The two rules that make one number of objective and constraints, for a metaheuristic.

(15) adds lambda_1 times the broken limits to the objective and replaces both by lambda_2 (k_s + k_f) where the arm
cannot reach. With round values (100; 10,000) the order is inverted: most points that are reachable but too
fast cost more than unreachable ones, and a search settles on the latter. Here lambda_1 and lambda_2 follow from
bounds of the terms that they multiply, so that always: feasible < breaks a limit < unreachable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, largest
from problems.encodings.encoding import CostWeights
from problems.limits.constraint import Constraint, PenaltyKind

UNKNOWN_MAGNITUDE = 1e12  # stands for the unknown upper bound of a constraint that is penalised by its magnitude


def paper_weights(
    objective_upper_bound: float, constraints: Sequence[Constraint], magnitudes: Mapping[str, FloatArray]
) -> CostWeights:
    """The smallest lambda_1 and lambda_2 of (15) that keep the order.

    Args:
        objective_upper_bound: what the objective cannot exceed.
        constraints: all that is penalised, over all rows.
        magnitudes: by constraint name, what each column's absolute value cannot exceed.
    """
    limit = limit_weight(constraints, objective_upper_bound)
    worst = sum(_largest_penalty(constraint, magnitudes) for constraint in constraints)
    return CostWeights(
        objective_upper_bound=objective_upper_bound, limit=limit, reach=objective_upper_bound + limit * worst
    )


def _largest_penalty(constraint: Constraint, magnitudes: Mapping[str, FloatArray]) -> float:
    rows, width = constraint.expression.shape
    if constraint.penalty is PenaltyKind.COUNT:
        return float(rows * width)
    return float(rows * np.sum(magnitudes.get(constraint.name, np.full(width, UNKNOWN_MAGNITUDE))))


def limit_weight(constraints: Sequence[Constraint], objective_upper_bound: float) -> float:
    """The lambda_1 with which breaking any limit costs more than any feasible objective."""
    return objective_upper_bound / min((c.smallest_violation() for c in constraints), default=1.0)


def paper_cost(objective: Matrix, penalties: Sequence[Matrix], reach: Matrix | None, weights: CostWeights) -> Matrix:
    """(15), with |k_s| and |k_f| (``reach``) where the paper prints k_s and k_f; (25) where every vector is reached.

    (25) prints lambda_1 as 1.
    """
    penalised = objective + weights.limit * sum(penalties)
    if reach is None:
        return penalised
    cosines = ca.fabs(reach)
    return ca.if_else(largest(cosines) <= 1.0, penalised, weights.reach * ca.sum2(cosines))


def graded_cost(objective: Matrix, penalties: Sequence[Matrix], weights: CostWeights) -> Matrix:
    """The objective where all constraints hold, else more than any objective by how far they are broken."""
    excess = sum(penalties, ca.DM(0))
    return ca.if_else(excess > 0.0, weights.objective_upper_bound + excess, objective)


class FeasibilityFirst:
    """The part of an encoding that leaves the order to :func:`graded_cost`: penalties, cost, and no weights to find."""

    def penalty(self, constraint: Constraint) -> Matrix:
        """The sum of the dimensionless excesses."""
        return constraint.graded_penalty()

    def cost(
        self, objective: Matrix, penalties: Sequence[Matrix], reach: Matrix | None, weights: CostWeights
    ) -> Matrix:
        """Feasibility first: the objective if all constraints hold, else more than any objective.

        What is above the bound of the objective counts as that bound.
        """
        bound = weights.objective_upper_bound
        return graded_cost(ca.if_else(objective > bound, bound, objective), penalties, weights)

    def weights(self, objective_upper_bound: float, constraints: Sequence[Constraint]) -> CostWeights:
        """Only the upper bound of the objective is needed."""
        return CostWeights(objective_upper_bound=objective_upper_bound, limit=0.0, reach=0.0)
