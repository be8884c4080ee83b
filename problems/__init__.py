"""Planning problems: robots, tasks and limits as symbolic CasADi models. Knows nothing of how they are searched."""

from problems.assembly.move import MoveProblem, move
from problems.assembly.moving.time_move import TimeMoveProblem, time_move
from problems.assembly.path_following import PathFollowingProblem, path_following
from problems.assembly.point_to_point import PointToPointProblem, point_to_point
from problems.assembly.problem import Model, Problem
from problems.base.errors import InvalidProblem
from problems.certify.verdict import CertificateStatus, Verdict
from problems.encodings.encoding import Variable
from problems.limits import LIMITS, LimitKind
from problems.limits.constraint import Constraint, PenaltyKind
from problems.limits.limit import Limit
from problems.motions.trajectory import Trajectory
from problems.objectives import OBJECTIVES, Objective
from problems.robots import ROBOTS
from problems.robots.planar import PlanarArm
from problems.robots.robot import Robot
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
    Rectangle,
    Tabulated,
)
from problems.tasks.move import Move
from problems.tasks.paths.path import Path, closed_curve, pentagram
from problems.tasks.paths.path_following import PathFollowing
from problems.tasks.place import Joints, Place, Position
from problems.tasks.point_to_point import PointToPoint

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
