"""The compiled core: what every plan in space needs alike, robot and scene being data; and linear programs."""

from problems.core.arm import Arm
from problems.core.library import core_library
from problems.core.linear_program import LinearProgram, SingleRows, WholeRows, joined, minimizer
from problems.core.world import Kept, Nearby, Proof, Where, World

__all__ = [
    "Arm",
    "Kept",
    "LinearProgram",
    "Nearby",
    "Proof",
    "SingleRows",
    "Where",
    "WholeRows",
    "World",
    "core_library",
    "joined",
    "minimizer",
]
