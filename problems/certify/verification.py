"""Judging a finished trajectory for all t: polynomials at their exact extremes, clearance by a proven bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from problems.base.matrix import Matrix
from problems.certify.clearance import prove_clearance
from problems.limits.constraint import TOLERANCE, CertificateStatus, Constraint, Verdict, verdict
from problems.limits.motion_limits import acceleration_limit, joint_range, speed_limit
from problems.motions.trajectory import Trajectory
from problems.robots.planar import PlanarArm
from problems.scene.ellipse import Ellipse


def limit_verdicts(arm: PlanarArm, obstacles: Sequence[Ellipse], trajectory: Trajectory) -> list[Verdict]:
    """Speed, acceleration, joint range and clearance, for all t.

    The worst values of the first three are found at the roots of derivatives; that they hold is proven without
    these, by Bernstein coefficients. Of the clearance a lower bound is proven.
    """
    exact = [(speed_limit, 1), (acceleration_limit, 2)]
    if arm.joint_limits is not None:
        exact.append((joint_range, 0))
    verdicts = []
    for limit, derivative in exact:
        times = trajectory.extreme_times(derivative)
        constraint = limit(arm, trajectory.samples(times))
        judged = verdict(constraint, times)
        slack = TOLERANCE * constraint.scale
        proven = trajectory.stays_within(derivative, constraint.lower - slack, constraint.upper + slack)
        if judged.satisfied and not proven:
            judged = replace(judged, status=CertificateStatus.UNDECIDED)
        verdicts.append(judged)
    proof = prove_clearance(arm, obstacles, trajectory)
    if proof is not None:
        where = f"{proof.where}, t = {proof.time:.4g} s"
        worst = proof.proven if proof.status is CertificateStatus.CERTIFIED else proof.smallest
        verdicts.append(Verdict("clearance", worst, 0.0, "m", proof.status, where))
    return verdicts


def end_verdicts(
    arm: PlanarArm, trajectory: Trajectory, start: tuple[float, float], goal: tuple[float, float]
) -> list[Verdict]:
    """Whether the tip starts at ``start`` and ends at ``goal`` (m)."""
    ends = trajectory.breakpoints[[0, -1]]
    tip = arm.tip(trajectory.samples(ends).theta)
    return [
        verdict(endpoint(name, ca.norm_2(tip[i, :] - ca.DM(list(point)).T)), ends[i : i + 1])
        for i, (name, point) in enumerate((("start", start), ("goal", goal)))
    ]


def endpoint(name: str, miss: Matrix) -> Constraint:
    """The tip is where the task wants it: a distance in m, up to rounding."""
    bound = np.array([1e-9])
    formula = f"|tip at the {name} - {name}| <= 1e-9 m"
    return Constraint(name, "-", "m", miss, -bound, bound, ("tip",), bound, for_all_t=False, formula=formula)
