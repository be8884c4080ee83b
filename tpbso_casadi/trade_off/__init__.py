"""Two objectives against each other: a front of certified plans."""

from tpbso_casadi.trade_off.front import Front, TradeOff
from tpbso_casadi.trade_off.methods import EPSILON_CONSTRAINT, METHODS, WEIGHTED_SUM, Work, method_named
from tpbso_casadi.trade_off.placement import ENDS, Objectives
from tpbso_casadi.trade_off.point import Point, Standing
from tpbso_casadi.trade_off.store import Store

__all__ = [
    "ENDS",
    "EPSILON_CONSTRAINT",
    "METHODS",
    "WEIGHTED_SUM",
    "Front",
    "Objectives",
    "Point",
    "Standing",
    "Store",
    "TradeOff",
    "Work",
    "method_named",
]
