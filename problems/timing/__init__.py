"""How fast a motion can be: moves between postures at rest, and given paths; exact, and proven for all t."""

from problems.timing.following import departure
from problems.timing.retime import retime
from problems.timing.speed_profile import SpeedProfile, minimizer

__all__ = ["SpeedProfile", "departure", "minimizer", "retime"]
