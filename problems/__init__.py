"""What is planned: arms, tasks and limits as symbolic CasADi models. Knows nothing of how they are searched."""

from problems.assembly.path_following import PathFollowing
from problems.assembly.point_to_point import PointToPoint
from problems.assembly.problem import Model, Problem, Variable
from problems.base.errors import InvalidProblem
from problems.limits.constraint import CertificateStatus, Constraint, PenaltyKind, Verdict
from problems.motions.trajectory import Trajectory
from problems.objectives.objective import OBJECTIVES, Objective
from problems.robots.planar import PlanarArm
from problems.scene.ellipse import Ellipse
from problems.tasks.path import Path, closed_curve, pentagram

__all__ = [
    "OBJECTIVES",
    "CertificateStatus",
    "Constraint",
    "Ellipse",
    "InvalidProblem",
    "Model",
    "Objective",
    "Path",
    "PathFollowing",
    "PenaltyKind",
    "PlanarArm",
    "PointToPoint",
    "Problem",
    "Trajectory",
    "Variable",
    "Verdict",
    "closed_curve",
    "pentagram",
]
