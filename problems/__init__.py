"""What is planned: arms, tasks and limits as symbolic CasADi models. Knows nothing of how they are searched."""

from problems.constraint import Constraint, Standing, Verdict, Weight
from problems.errors import InvalidProblem
from problems.objectives import OBJECTIVES, Objective
from problems.obstacles import Ellipse
from problems.path import Path, closed_curve, pentagram
from problems.path_following import PathFollowing
from problems.planar_arm import PlanarArm
from problems.point_to_point import PointToPoint
from problems.problem import Model, Problem, Variable
from problems.trajectory import Trajectory

__all__ = [
    "OBJECTIVES",
    "Constraint",
    "Ellipse",
    "InvalidProblem",
    "Model",
    "Objective",
    "Path",
    "PathFollowing",
    "PlanarArm",
    "PointToPoint",
    "Problem",
    "Standing",
    "Trajectory",
    "Variable",
    "Verdict",
    "Weight",
    "closed_curve",
    "pentagram",
]
