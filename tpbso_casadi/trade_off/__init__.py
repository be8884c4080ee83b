"""Two objectives against each other: a front of certified plans."""

from tpbso_casadi.trade_off.front import Point, PointFront, Standing, TradeOff
from tpbso_casadi.trade_off.methods import EPSILON_CONSTRAINT, METHODS, WEIGHTED_SUM, FrontWork, Method, open_front
from tpbso_casadi.trade_off.placement import ENDS, Objectives
from tpbso_casadi.trade_off.store import save_front

__all__ = [
    "ENDS",
    "EPSILON_CONSTRAINT",
    "METHODS",
    "WEIGHTED_SUM",
    "FrontWork",
    "Method",
    "Objectives",
    "Point",
    "PointFront",
    "Standing",
    "TradeOff",
    "open_front",
    "save_front",
]
