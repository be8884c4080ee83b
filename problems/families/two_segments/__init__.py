"""The paper's first motion: a quartic, then a quintic, joined with continuous acceleration."""

from problems.families.two_segments.motion import Quantities
from problems.families.two_segments.problem import FORMULATIONS, PointToPointProblem, point_to_point
from problems.families.two_segments.program import AXES
from problems.families.two_segments.starts import OPTIONS, SAME_VALUE_TOLERANCE

__all__ = [
    "AXES",
    "FORMULATIONS",
    "OPTIONS",
    "SAME_VALUE_TOLERANCE",
    "PointToPointProblem",
    "Quantities",
    "point_to_point",
]
