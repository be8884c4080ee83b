"""Judging a finished trajectory for all t, limit by limit.

How a limit is proven depends on its kind; a kind without a proof of its own is proven by interval arithmetic.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import singledispatch

from problems.certify.cells import prove_by_cells
from problems.certify.clearance import prove_clearance
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, verdict
from problems.limits.clearance import Clearance
from problems.limits.limit import Limit
from problems.motions.trajectory import Trajectory


def limit_verdicts(limits: Iterable[Limit], trajectory: Trajectory) -> list[Verdict]:
    """How a motion stands to each of its limits, for all t."""
    return [judged for limit in limits for judged in _judged(limit, trajectory)]


def _judged(limit: Limit, trajectory: Trajectory) -> list[Verdict]:
    return polynomial_verdicts(limit, limit.order, trajectory) if limit.order is not None else prove(limit, trajectory)


def polynomial_verdicts(limit: Limit, order: int, trajectory: Trajectory) -> list[Verdict]:
    """Of a limit on a derivative of the joint angles.

    The worst values are found at the roots of derivatives; that they hold is proven without these, by Bernstein
    coefficients.
    """
    times = trajectory.extreme_times(order)
    verdicts = []
    for constraint in limit.at(trajectory.samples(times)):
        judged = verdict(constraint, times)
        (lower, upper), slack = constraint.bounds, TOLERANCE * constraint.scales
        if judged.satisfied and not trajectory.stays_within(order, lower - slack, upper + slack):
            judged = replace(judged, status=CertificateStatus.UNDECIDED)
        verdicts.append(judged)
    return verdicts


@singledispatch
def prove(limit: Limit, trajectory: Trajectory) -> list[Verdict]:
    """Of any other limit; register a proof for a kind of limit that has a sharper one than interval arithmetic."""
    return prove_by_cells(limit, trajectory)


@prove.register
def _(limit: Clearance, trajectory: Trajectory) -> list[Verdict]:
    """Of the clearance, of which a lower bound is proven."""
    proof = prove_clearance(limit, trajectory)
    if proof is None:
        return []
    worst = proof.proven if proof.status is CertificateStatus.CERTIFIED else proof.smallest
    where = f"{proof.where}, t = {proof.time:.4g} s"
    return [Verdict(name=limit.name, worst=worst, bound=0.0, unit="m", status=proof.status, where=where)]
