"""The methods of making a front, by name."""

from __future__ import annotations

from collections.abc import Callable

from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.trade_off.baseline import Baseline
from tpbso_casadi.trade_off.objectives import Objectives
from tpbso_casadi.trade_off.placement import EpsilonConstraint, WeightedSum
from tpbso_casadi.trade_off.scalarised import Scalarised
from tpbso_casadi.trade_off.work import Method

EPSILON_CONSTRAINT, WEIGHTED_SUM, NSGA2 = "epsilon-constraint", "weighted-sum", "nsga2"


def _epsilon_constraint(objectives: Objectives, count: int) -> Method:
    if objectives.duration is None:
        raise ScenarioError(f"--method {EPSILON_CONSTRAINT}: needs time as one objective, and a task with total_time")
    return Scalarised(EPSILON_CONSTRAINT, count, EpsilonConstraint(count, objectives.duration))


METHODS: dict[str, Callable[[Objectives, int], Method]] = {
    EPSILON_CONSTRAINT: _epsilon_constraint,
    WEIGHTED_SUM: lambda objectives, count: Scalarised(WEIGHTED_SUM, count, WeightedSum(count)),
    NSGA2: lambda objectives, count: Baseline(NSGA2, count),
}


def method_named(name: str | None, objectives: Objectives, count: int) -> Method:
    """A method; where none is named, a bound on the duration if that will do, else weighted sums.

    Raises:
        ScenarioError: it is not for these objectives.
    """
    usual = WEIGHTED_SUM if objectives.duration is None else EPSILON_CONSTRAINT
    return METHODS[usual if name is None else name](objectives, count)
