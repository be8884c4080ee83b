"""Postures that reach poses of the tool, and maps of what an arm reaches."""

from tpbso_casadi.reaching.among import ArmAmong, PoseLike
from tpbso_casadi.reaching.reach_map import STARTS, Reach, evenly_turned, grid_around, reach_of, read_reach

__all__ = ["STARTS", "ArmAmong", "PoseLike", "Reach", "evenly_turned", "grid_around", "reach_of", "read_reach"]
