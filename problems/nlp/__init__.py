"""The smooth nonlinear programs: variables, rows, structured starts, optimality."""

from problems.nlp.optimality import Optimality, Sensitivity, optimality, payload_price, ranking, sensitivities, settled
from problems.nlp.program import (
    MAX_ANGLE_CHANGE,
    MotionProgram,
    NonlinearProgram,
    composed_hessian,
    equality,
    replace_with_symbols,
    slack_constraints,
)
from problems.nlp.starts import Displacement, Postures, displacement_of

__all__ = [
    "MAX_ANGLE_CHANGE",
    "Displacement",
    "MotionProgram",
    "NonlinearProgram",
    "Optimality",
    "Postures",
    "Sensitivity",
    "composed_hessian",
    "displacement_of",
    "equality",
    "optimality",
    "payload_price",
    "ranking",
    "replace_with_symbols",
    "sensitivities",
    "settled",
    "slack_constraints",
]
