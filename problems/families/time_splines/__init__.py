"""Splines of time: moves among obstacles that move, where the duration comes before the clearance."""

from problems.families.time_splines.problem import TimeMoveProblem, time_move

__all__ = ["TimeMoveProblem", "time_move"]
