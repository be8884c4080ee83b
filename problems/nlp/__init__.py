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

__all__ = [
    "MAX_ANGLE_CHANGE",
    "MotionProgram",
    "NonlinearProgram",
    "Optimality",
    "Sensitivity",
    "composed_hessian",
    "equality",
    "optimality",
    "payload_price",
    "ranking",
    "replace_with_symbols",
    "sensitivities",
    "settled",
    "slack_constraints",
]
