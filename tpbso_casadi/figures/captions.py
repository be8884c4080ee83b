"""What figures say of a plan in words."""

from __future__ import annotations

from problems import CertificateStatus
from tpbso_casadi.planning.planned_motion import PlannedMotion

STATUSES = {
    CertificateStatus.CERTIFIED: "certified for all t",
    CertificateStatus.VIOLATED: "a limit is violated",
    CertificateStatus.UNDECIDED: "not certified: undecided",
}


def headline(plan: PlannedMotion) -> str:
    """The objective with its value, the duration, joints and certificate, in two lines."""
    objective, duration = plan.criteria.objective, plan.trajectory.duration
    value = f"{objective.name} {plan.objective:.4g} {objective.unit}".rstrip()
    is_duration = f"{plan.objective:.4g} {objective.unit}" == f"{duration:.4g} s"
    first = f"{objective.name} T = {duration:.4g} s" if is_duration else f"{value}, T = {duration:.4g} s"
    return f"{first}\n{plan.criteria.robot.dof} joints, {STATUSES[plan.motion.status]}"
