"""A scenario with other values of some keys: a command line's options, or the arguments of a call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from tpbso_casadi.scenario.scenario import Scenario, parse_scenario

DEFAULT_SOLVER = "abso"  # where nobody names one; with a polish

Table = Mapping[str, Any]
NOTHING: Table = {}


def overridden(
    scenario: Scenario,
    *,
    arm: Table | None = None,
    task: Table = NOTHING,
    model: Table = NOTHING,
    solver: Table = NOTHING,
    polish: bool = False,
    obstacles: Sequence[Table] | None = None,
) -> Scenario:
    """The scenario with given values in place of its own, and a solver where it names none; validated anew.

    Args:
        scenario: to start from.
        arm: the whole [arm] table; None to leave it.
        task: keys of [task].
        model: keys of [model].
        solver: keys of [solver]; another solver's name drops the settings of the one before.
        polish: whether the best candidate is refined at least once.
        obstacles: the tables of all [[obstacles]]; None to leave them.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    content = scenario.model_dump()
    content["model"] = scenario.model.stated() | dict(model)
    content["task"] |= task
    if arm is not None:
        content["arm"] = dict(arm)
    if obstacles is not None:
        content["obstacles"] = list(map(dict, obstacles))
    if polish and not content["solver"]["polish_starts"]:
        content["solver"]["polish_starts"] = 1
    if solver.get("name", scenario.solver.name) != scenario.solver.name:
        content["solver"]["settings"] = {}
    content["solver"] |= solver
    named = {*scenario.solver.model_fields_set, *solver}
    if scenario.task.is_searched and "name" not in named:
        own = bool(content["model"].get("constraints") or content["task"].get("objectives"))
        content["solver"] = with_default(content["solver"], named, scenario.robot_table.usual_descents or int(own))
    return parse_scenario(content)


def with_default(solver: dict[str, Any], stated: set[str], descents: int) -> dict[str, Any]:
    """The [solver] table of a scenario that names no solver: the best there is, polished unless it says otherwise."""
    polished_anyway = solver["polish_starts"] or solver["within"] is not None or "polish_starts" in stated
    return solver | {"name": DEFAULT_SOLVER} | ({} if polished_anyway else {"polish_starts": descents})
