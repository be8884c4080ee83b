"""The compiled core: what every plan in space needs alike, robot and scene being data; and linear programs."""

from problems.core.arm import steps_of
from problems.core.asked import AskedSolid
from problems.core.compiled import core, found_core
from problems.core.description import (
    RobotNumbers,
    drift_of,
    drifts_of,
    is_known,
    moves_straight,
    obstacle_numbers,
    pace_of,
)
from problems.core.dynamics import Dynamics, TorqueAim
from problems.core.expressions import CoreExpression
from problems.core.interface import ClosestPair, ClosestPairs, Nearby, PathSearch, Proof, Schedule, Separation, World
from problems.core.linear_program import LinearProgram
from problems.core.motion_numbers import MotionNumbers
from problems.core.rows import SingleRows, WholeRows, stacked
from problems.core.segments import Guards, SegmentCells, SegmentMotion, Stops
from problems.core.trust_region import Step, TrustRegion
from problems.core.world import CONNECT, MOST_ITEMS, CompiledWorld, fixed_clearance, fixed_links, known_robot

__all__ = [
    "CONNECT",
    "MOST_ITEMS",
    "AskedSolid",
    "ClosestPair",
    "ClosestPairs",
    "CompiledWorld",
    "CoreExpression",
    "Dynamics",
    "Guards",
    "LinearProgram",
    "MotionNumbers",
    "Nearby",
    "PathSearch",
    "Proof",
    "RobotNumbers",
    "Schedule",
    "SegmentCells",
    "SegmentMotion",
    "Separation",
    "SingleRows",
    "Step",
    "Stops",
    "TorqueAim",
    "TrustRegion",
    "WholeRows",
    "World",
    "core",
    "drift_of",
    "drifts_of",
    "fixed_clearance",
    "fixed_links",
    "found_core",
    "is_known",
    "known_robot",
    "moves_straight",
    "obstacle_numbers",
    "pace_of",
    "stacked",
    "steps_of",
]
