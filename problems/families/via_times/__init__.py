"""Motions of the literature through given postures: a fixed interpolation, whose interval times are decided."""

from problems.families.via_times.interpolations import INTERPOLATIONS
from problems.families.via_times.problem import INTERVAL_ENCODINGS, ViaTimesProblem, via_times

__all__ = ["INTERPOLATIONS", "INTERVAL_ENCODINGS", "ViaTimesProblem", "via_times"]
