"""The public names of ``problems``."""

from problems.assembly import Model, Problem, Variable
from problems.base import InvalidProblem
from problems.certify import CertificateStatus, Verdict
from problems.families.knots import PathFollowingProblem, path_following
from problems.families.splines import MoveProblem, move
from problems.families.time_splines import TimeMoveProblem, time_move
from problems.families.two_segments import PointToPointProblem, point_to_point
from problems.limits import LIMITS, Constraint, Limit, LimitKind, PenaltyKind
from problems.motions import Trajectory
from problems.objectives import OBJECTIVES, Objective
from problems.robots import ROBOTS, PlanarArm, Robot
from problems.scene import (
    OBSTACLES,
    Ball,
    Box,
    Capsule,
    ConstantVelocity,
    Cylinder,
    Ellipse,
    Ellipsoid,
    HalfSpace,
    MovingObstacle,
    Obstacle,
    Polygon,
    Polytope,
    Rectangle,
    Tabulated,
)
from problems.tasks import Joints, Move, Path, PathFollowing, Place, PointToPoint, Position, closed_curve, pentagram

__all__ = [
    "LIMITS",
    "OBJECTIVES",
    "OBSTACLES",
    "ROBOTS",
    "Ball",
    "Box",
    "Capsule",
    "CertificateStatus",
    "ConstantVelocity",
    "Constraint",
    "Cylinder",
    "Ellipse",
    "Ellipsoid",
    "HalfSpace",
    "InvalidProblem",
    "Joints",
    "Limit",
    "LimitKind",
    "Model",
    "Move",
    "MoveProblem",
    "MovingObstacle",
    "Objective",
    "Obstacle",
    "Path",
    "PathFollowing",
    "PathFollowingProblem",
    "PenaltyKind",
    "Place",
    "PlanarArm",
    "PointToPoint",
    "PointToPointProblem",
    "Polygon",
    "Polytope",
    "Position",
    "Problem",
    "Rectangle",
    "Robot",
    "Tabulated",
    "TimeMoveProblem",
    "Trajectory",
    "Variable",
    "Verdict",
    "closed_curve",
    "move",
    "path_following",
    "pentagram",
    "point_to_point",
    "time_move",
]
