"""Constraints and costs of the user's."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any, TypeAlias

from problems import OBJECTIVES, InvalidProblem, Limit, Objective, Robot
from problems.limits import HandConstraint
from problems.motions import Stated, traced
from tpbso_casadi.scenario import (
    HandSection,
    ScenarioError,
    path_of,
    plain,
)

Table: TypeAlias = dict[str, Any]


@dataclass(frozen=True, eq=False)
class StatedConstraint:
    """A constraint of a user's own, which a motion keeps at every time: ``lower <= expression(m) <= upper``.

    Args:
        expression: a function of one instant ``m`` of the motion, see :class:`MotionView`, that gives a number or a
            vector; called with CasADi's symbols.
        lower: bound of each value, or one for all of them; None (or -inf) where there is none.
        upper: likewise; None (or inf) where there is none.
        name: what tables and verdicts call it.
        unit: of the values and bounds.
    """

    expression: Stated
    lower: Any = None
    upper: Any = None
    name: str = "constraint"
    unit: str = "1"

    def __repr__(self) -> str:
        bounds = f"lower={self.lower}, upper={self.upper}"
        return f"<constraint {self.name!r}: {bounds}, {self.unit}>"

    def table(self, robot: Robot) -> Table:
        """The table of a scenario that states it.

        Raises:
            ScenarioError: the function raises, or gives no expression.
        """
        sides = (("lower", self.lower, -inf), ("upper", self.upper, inf))
        bounds = {key: _bound(value, none) for key, value, none in sides}
        text = _text(self.expression, robot, f"constraint {self.name!r}")
        stated = {"name": self.name, "unit": self.unit, **bounds, "expression": text}
        return {key: value for key, value in stated.items() if value is not None}


@dataclass(frozen=True, eq=False)
class StatedCost:
    """An objective of a user's own: the integral of ``expression(m)`` over time, and ``terminal(m)`` of the duration.

    Args:
        expression: a function of one instant ``m`` of the motion, see :class:`MotionView`, that gives a number: what
            is integrated; None where nothing is.
        name: what tables call it.
        unit: of the value, which is that of the expression times s.
        terminal: a function of ``m.duration`` alone, which is added.
    """

    expression: Stated | None = None
    name: str = "cost"
    unit: str = "1"
    terminal: Stated | None = None

    def __repr__(self) -> str:
        return f"<objective {self.name!r}, {self.unit}>"

    def table(self, robot: Robot) -> Table:
        """The table of a scenario that states it.

        Raises:
            ScenarioError: a function raises, or gives no expression.
        """
        called, table = f"objective {self.name!r}", {"name": self.name, "unit": self.unit}
        for key in ("expression", "terminal"):
            function: Stated | None = getattr(self, key)
            if function is not None:
                table[key] = _text(function, robot, called)
        return table


AnyConstraint: TypeAlias = StatedConstraint | HandConstraint | Limit | type[Limit]
AnyTerm: TypeAlias = str | StatedCost | Objective | type[Objective]
AnyObjective: TypeAlias = AnyTerm | Mapping[Any, float] | Sequence[tuple[float, AnyTerm]]


def _bound(value: Any, none: float) -> Any:
    """A bound as plain data; None where every number says that there is none."""
    bound = plain(value)
    missing = bound == [none] * len(bound) if isinstance(bound, list) and bound else bound == none
    return None if missing else bound


def constraints_table(constraints: AnyConstraint | Iterable[AnyConstraint], robot: Robot) -> Table:
    """Keys of [model]: constraints of a hand and of a user's own, and classes of limits by their paths.

    Raises:
        ScenarioError: one is neither.
    """
    each = list(constraints) if isinstance(constraints, Iterable) else [constraints]
    own = [_table(one, robot) for one in each if isinstance(one, WITH_TABLES)]
    return {"constraints": own, "limits": [_limit(one, robot) for one in each if not isinstance(one, WITH_TABLES)]}


WITH_TABLES = (StatedConstraint, HandConstraint)


def _table(one: StatedConstraint | HandConstraint, robot: Robot) -> Table | HandSection:
    return HandSection.of(one) if isinstance(one, HandConstraint) else one.table(robot)


def _limit(limit: Any, robot: Robot) -> str:
    """The path of a class of limits."""
    kind = limit if isinstance(limit, type) else type(limit)
    if not issubclass(kind, Limit):
        raise ScenarioError(
            f"constraints: {limit!r:.60} is no tp.Constraint, none such as tp.Upright, and no class derived "
            "from problems.Limit"
        )
    if kind is not limit and kind.for_robot(robot, ()) != limit:
        raise ScenarioError(f"constraints: say the class {kind.__name__}: what its holding makes is stored, no object")
    return path_of(kind)


def objective_table(objective: AnyObjective, robot: Callable[[], Robot]) -> Table:
    """Keys of [task]: what is minimised, and the objectives of a user's own in it.

    Args:
        objective: a name, an objective, a table of weights, or pairs of weights and objectives.
        robot: makes the robot, where it is needed.

    Raises:
        ScenarioError: it is none of these.
    """
    own: list[Table] = []

    def name_of(term: Any) -> str:
        if isinstance(term, StatedCost):
            own.append(term.table(robot()))
            return term.name
        return _name(term)

    if isinstance(objective, Mapping):
        chosen: Any = {name_of(term): plain(weight) for term, weight in objective.items()}
        given = len(objective)
    elif isinstance(objective, Sequence) and not isinstance(objective, str):
        pairs = [_pair(pair) for pair in objective]
        chosen, given = {name_of(term): plain(weight) for weight, term in pairs}, len(pairs)
    else:
        chosen, given = name_of(objective), 1
    if isinstance(chosen, dict) and len(chosen) < given:
        raise ScenarioError("objective: two have the same name; give each a name of its own")
    return {"objective": chosen, **({"objectives": own} if own else {})}


def _pair(pair: Any) -> tuple[float, Any]:
    if not isinstance(pair, tuple | list) or len(pair) != 2:
        raise ScenarioError(f"objective: pairs of a weight and an objective are needed, not {pair!r:.60}")
    return pair[0], pair[1]


def _name(term: Any) -> str:
    """The name of an objective of ours, or the path of a class."""
    if isinstance(term, str):
        return term
    kind = term if isinstance(term, type) else type(term)
    if not issubclass(kind, Objective):
        raise ScenarioError(
            f"objective: {term!r:.60} is no name, no tp.Cost, and no class derived from problems.Objective"
        )
    ours = next((name for name, known in OBJECTIVES.items() if type(known) is kind), None)
    if kind is not term and ours is None and vars(term):
        raise ScenarioError(f"objective: say the class {kind.__name__}: what it makes is stored, no object with values")
    return path_of(kind) if ours is None else ours


def _text(function: Stated, robot: Robot, called: str) -> str:
    if not callable(function):
        raise ScenarioError(f"{called}: a function of one instant is needed, such as lambda m: m.tool[1]")
    try:
        return traced(function, robot, called).text
    except InvalidProblem as error:
        raise ScenarioError(str(error)) from error
