"""The compiled core: what every plan in space needs alike, robot and scene being data; and linear programs."""

from problems.core.arm import steps_of
from problems.core.compiled import core, found_core
from problems.core.description import RobotNumbers, drifts_of, obstacle_numbers
from problems.core.dynamics import Dynamics, TorqueAim
from problems.core.expressions import CoreExpression
from problems.core.interface import Nearby, Schedule, Separation
from problems.core.linear_program import LinearProgram, minimizer
from problems.core.motion_numbers import MotionNumbers
from problems.core.rows import SingleRows, WholeRows, stacked
from problems.core.segments import SegmentCells, SegmentMotion, Stops
from problems.core.trust_region import TrustRegion
from problems.core.world import MOST_ITEMS, ClosestPair, Proof, World, known_robot

__all__ = [
    "MOST_ITEMS",
    "ClosestPair",
    "CoreExpression",
    "Dynamics",
    "LinearProgram",
    "MotionNumbers",
    "Nearby",
    "Proof",
    "RobotNumbers",
    "Schedule",
    "SegmentCells",
    "SegmentMotion",
    "Separation",
    "SingleRows",
    "Stops",
    "TorqueAim",
    "TrustRegion",
    "WholeRows",
    "World",
    "core",
    "drifts_of",
    "found_core",
    "known_robot",
    "minimizer",
    "obstacle_numbers",
    "stacked",
    "steps_of",
]
