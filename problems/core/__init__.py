"""The compiled core: what every plan in space needs alike, robot and scene being data."""

from problems.core.arm import Arm
from problems.core.library import core_library
from problems.core.world import Kept, Nearby, Proof, Where, World

__all__ = ["Arm", "Kept", "Nearby", "Proof", "Where", "World", "core_library"]
