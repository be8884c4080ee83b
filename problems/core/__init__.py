"""The compiled core: what every plan in space needs alike, robot and scene being data; and linear programs."""

from problems.core.arm import Arm
from problems.core.description import drifts_of
from problems.core.dynamics import Dynamics
from problems.core.library import core_library
from problems.core.linear_program import LinearProgram, SingleRows, WholeRows, joined, minimizer
from problems.core.world import MOST_ITEMS, Kept, Nearby, Proof, Schedule, Where, World

__all__ = [
    "MOST_ITEMS",
    "Arm",
    "Dynamics",
    "Kept",
    "LinearProgram",
    "Nearby",
    "Proof",
    "Schedule",
    "SingleRows",
    "Where",
    "WholeRows",
    "World",
    "core_library",
    "drifts_of",
    "joined",
    "minimizer",
]
