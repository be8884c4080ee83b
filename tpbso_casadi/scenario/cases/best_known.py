"""The best plans known of the built-in scenarios."""

from __future__ import annotations

from tpbso_casadi.scenario.cases.builtin import builtin
from tpbso_casadi.scenario.scenario import Scenario

BEST_KNOWN = {  # objectives of certified plans, s, rad or m, rounded up
    "time-2": 0.7017,
    "time-3": 0.4619,
    "time-4": 0.3738,
    "time-5": 0.3221,
    "rotation-2": 2.4136,
    "rotation-3": 2.0353,
    "rotation-4": 1.6285,
    "rotation-5": 1.4323,
    "obstacle-3": 1.5947,
    "obstacle-4": 1.5946,
    "obstacle-5": 1.5946,
    "pentagram-time": 0.5466,
    "pentagram-rotation": 12.142,
    "closed-curve-time": 0.7398,
    "closed-curve-rotation": 17.580,
}
STATEMENT = {"arm", "robot", "task", "obstacles"}  # the tables of a scenario that say what is to be planned


def best_known(scenario: Scenario) -> float | None:
    """The objective of the best plan known, in its unit; None where the scenario states none of the built-in tasks."""
    statement = scenario.model_dump(include=STATEMENT)
    return next(
        (best for name, best in BEST_KNOWN.items() if builtin(name).model_dump(include=STATEMENT) == statement), None
    )
