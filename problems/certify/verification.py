"""Check a finished trajectory for all t, limit by limit.

How a limit is proven depends on its kind; a kind without a proof of its own is proven by interval arithmetic.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import singledispatch

import numpy as np

from problems.base.matrix import FloatArray
from problems.certify.cells import prove_by_cells
from problems.certify.clearance import prove_clearance
from problems.certify.dynamics.torque import prove_torques
from problems.certify.expressions.proof import prove_expression
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, verdict
from problems.limits.distances.proximity import Proximity
from problems.limits.expression import ExpressionLimit
from problems.limits.limit import Limit
from problems.limits.torque import TorqueLimit
from problems.motions.trajectory import Trajectory


def limit_verdicts(
    limits: Iterable[Limit], trajectory: Trajectory, end_accelerations: FloatArray | None = None
) -> list[Verdict]:
    """The verdicts on all limits of a motion, for all t.

    Args:
        limits: to be kept.
        trajectory: the motion.
        end_accelerations: of the joints before and after it, (2, k), rad/s^2; zero if None.
    """
    return [outcome for limit in limits for outcome in _verdicts_of(limit, trajectory, end_accelerations)]


def _verdicts_of(limit: Limit, trajectory: Trajectory, end_accelerations: FloatArray | None) -> list[Verdict]:
    if limit.order is None:
        return prove(limit, trajectory)
    return polynomial_verdicts(limit, limit.order, trajectory, end_accelerations)


def polynomial_verdicts(
    limit: Limit, order: int, trajectory: Trajectory, end_accelerations: FloatArray | None = None
) -> list[Verdict]:
    """The verdicts on a limit of a derivative of the joint angles.

    Where the derivative below it jumps, it is infinite for a moment. The worst values are found at the roots of
    derivatives; that they hold is proven without these, by Bernstein coefficients.
    """
    times = trajectory.extreme_times(order)
    jump = trajectory.jump_time(order - 1, end_accelerations) if order > 1 else None
    verdicts = []
    for constraint in limit.at(trajectory.samples(times)):
        outcome = verdict(constraint, times)
        if jump is not None:
            where = f"derivative {order - 1} jumps, t = {jump:.4g} s"
            outcome = replace(outcome, worst=np.inf, status=CertificateStatus.VIOLATED, where=where)
        (lower, upper), slack = constraint.bounds, TOLERANCE * constraint.scales
        if outcome.satisfied and not trajectory.stays_within(order, lower - slack, upper + slack):
            outcome = replace(outcome, status=CertificateStatus.UNDECIDED)
        verdicts.append(outcome)
    return verdicts


@singledispatch
def prove(limit: Limit, trajectory: Trajectory) -> list[Verdict]:
    """The verdicts on any other limit; register a function for a kind of limit with a sharper proof than intervals."""
    return prove_by_cells(limit, trajectory)


@prove.register
def _(limit: Proximity, trajectory: Trajectory) -> list[Verdict]:
    """The verdict on a clearance, from a proven lower bound."""
    proof = prove_clearance(limit, trajectory)
    if proof is None:
        return []
    worst = proof.proven if proof.status is CertificateStatus.CERTIFIED else proof.smallest
    where = f"{proof.where}, t = {proof.time:.4g} s"
    bound = limit.robot.margin
    return [Verdict(name=limit.name, worst=worst, bound=bound, unit="m", status=proof.status, where=where)]


@prove.register
def _(limit: TorqueLimit, trajectory: Trajectory) -> list[Verdict]:
    """The verdict on torques, for the joint that comes nearest to what its motor gives."""
    return [prove_torques(limit, trajectory).verdict]


@prove.register
def _(limit: ExpressionLimit, trajectory: Trajectory) -> list[Verdict]:
    """The verdict on an expression of a user's own."""
    return [prove_expression(limit, trajectory)]
