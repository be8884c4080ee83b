"""Postures that reach poses of the tool, and maps of what an arm reaches."""

from tpbso_casadi.reaching.among import POSE_STARTS, ArmAmong, PoseLike
from tpbso_casadi.reaching.reach_map import STARTS, Reach, evenly_turned, grid_around, reach_of, read_reach

__all__ = [
    "POSE_STARTS",
    "STARTS",
    "ArmAmong",
    "PoseLike",
    "Reach",
    "evenly_turned",
    "grid_around",
    "reach_of",
    "read_reach",
]
