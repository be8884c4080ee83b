"""How it moves: families of trajectories, their samples and their exact polynomial pieces."""

from problems.motions.expression_text import InvalidText, SampleFunction, Stated, random_states, read, traced
from problems.motions.path_scan import LEAST_ROOM, Bounds, TorqueSlopes, advance, before, gap, interval_time, limited
from problems.motions.path_spline import (
    ALONG,
    GAUSS_SHARES,
    SUPPORT,
    JointPath,
    PathSpline,
    Rates,
    TimedPath,
    in_time,
    within,
)
from problems.motions.rows import MotionRows, RowInterpolation
from problems.motions.samples import SAMPLED_ORDERS, MotionView, Samples, increasing_choice
from problems.motions.splines import (
    DEGREE,
    ClampedSpline,
    InterpolatingSpline,
    SplineInTime,
    SplineShape,
    without_rounding,
)
from problems.motions.trajectory import (
    CONTINUOUS_ORDERS,
    SLIVER,
    SMOOTH_ORDERS,
    Motion,
    SampleGrid,
    Trajectory,
)

__all__ = [
    "ALONG",
    "CONTINUOUS_ORDERS",
    "DEGREE",
    "GAUSS_SHARES",
    "LEAST_ROOM",
    "SAMPLED_ORDERS",
    "SLIVER",
    "SMOOTH_ORDERS",
    "SUPPORT",
    "Bounds",
    "ClampedSpline",
    "InterpolatingSpline",
    "InvalidText",
    "JointPath",
    "Motion",
    "MotionRows",
    "MotionView",
    "PathSpline",
    "Rates",
    "RowInterpolation",
    "SampleFunction",
    "SampleGrid",
    "Samples",
    "SplineInTime",
    "SplineShape",
    "Stated",
    "TimedPath",
    "TorqueSlopes",
    "Trajectory",
    "advance",
    "before",
    "gap",
    "in_time",
    "increasing_choice",
    "interval_time",
    "limited",
    "random_states",
    "read",
    "traced",
    "within",
    "without_rounding",
]
