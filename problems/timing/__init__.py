"""Least durations of moves between postures and along given paths, exact and proven for all t."""

from problems.timing.bound import least_along, least_along_points
from problems.timing.fitting import distinct_rows, fitted_path
from problems.timing.following import departure, deviation
from problems.timing.free_space import (
    AccelerationPieces,
    Phasing,
    least_durations,
    least_time_move,
    rest_to_rest,
    switch_shares,
)
from problems.timing.from_motion import MotionState, fastest_duration, fastest_move, fastest_stop, least_duration
from problems.timing.retime import retime
from problems.timing.segment_grid import SegmentGrid
from problems.timing.settings import ThroughSettings
from problems.timing.speed_profile import SpeedProfile
from problems.timing.through import Passing, apart, fastest_through, peak_shares
from problems.timing.through_bound import least_through
from problems.timing.tool_length import least_below, retime_below

__all__ = [
    "AccelerationPieces",
    "MotionState",
    "Passing",
    "Phasing",
    "SegmentGrid",
    "SpeedProfile",
    "ThroughSettings",
    "apart",
    "departure",
    "deviation",
    "distinct_rows",
    "fastest_duration",
    "fastest_move",
    "fastest_stop",
    "fastest_through",
    "fitted_path",
    "least_along",
    "least_along_points",
    "least_below",
    "least_duration",
    "least_durations",
    "least_through",
    "least_time_move",
    "peak_shares",
    "rest_to_rest",
    "retime",
    "retime_below",
    "switch_shares",
]
