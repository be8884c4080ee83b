"""Smooth nonlinear programs: variables, rows, structured starts, conditions of optimality."""

from problems.programs.optimality import Optimality, optimality
from problems.programs.program import (
    MAX_ANGLE_CHANGE,
    MotionProgram,
    NonlinearProgram,
    composed_hessian,
    equality,
    replace_with_symbols,
    slack_constraints,
)
from problems.programs.starts import Displacement, PointPostures, displacement_of

__all__ = [
    "MAX_ANGLE_CHANGE",
    "Displacement",
    "MotionProgram",
    "NonlinearProgram",
    "Optimality",
    "PointPostures",
    "composed_hessian",
    "displacement_of",
    "equality",
    "optimality",
    "replace_with_symbols",
    "slack_constraints",
]
