"""The record of a run, and the plan that it found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

from pydantic import AllowInfNan, Strict, StrictBool, StrictInt, StrictStr, TypeAdapter, ValidationError

from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.scenario import plugin_failures_named
from tpbso_casadi.storage import RunResult, checked
from tpbso_casadi.storage.recomputation import Contradiction

Number: TypeAlias = Annotated[float, Strict(), AllowInfNan(False)]


@dataclass(frozen=True, kw_only=True)
class Record:
    """A stored run without its motion; of a failed run only the first five fields.

    Attributes:
        case: name of the scenario.
        solver: label of the solver.
        seed: of the search.
        seconds: wall-clock time of the whole run.
        error: why it failed; empty where it did not.
        feasible: whether the plan is certified.
        objective: of the plan, in ``unit``.
        unit: of the objective.
        cost: of the search's best candidate.
        evaluations: of the search.
        iterations: of the search.
        stop_reason: of the search.
    """

    case: StrictStr
    solver: StrictStr
    seed: StrictInt
    seconds: Number
    error: StrictStr
    feasible: StrictBool = False
    objective: Number | None = None
    unit: StrictStr = ""
    cost: Number | None = None
    evaluations: StrictInt | None = None
    iterations: StrictInt | None = None
    stop_reason: StrictStr = ""


RECORD = TypeAdapter(Record)


def read_record(values: Mapping[str, Any]) -> Record:
    """A record from what a database holds.

    Args:
        values: by field; of a run that did not fail all of them, ``feasible`` as 0 or 1.

    Raises:
        ValueError: naming the field, in one line: it is missing or not of its type.
    """
    given = {name: value for name, value in values.items() if value is not None}
    if not given.get("error"):
        required = ("feasible", "objective", "evaluations") if given.get("feasible") else ("feasible", "evaluations")
        missing = next((name for name in required if name not in given), None)
        if missing is not None:
            raise ValueError(f"{missing} is missing")
    if given.get("feasible") in (0, 1):
        given["feasible"] = bool(given["feasible"])
    try:
        return RECORD.validate_python(given)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        raise ValueError(f"{first['loc'][-1]}: {first['msg']}, not {first['input']!r:.40}") from error


@dataclass(frozen=True, kw_only=True)
class RunFinding:
    """What a run found.

    Attributes:
        words: that say more of it than its objective.
        planned: a motion, certificate and objective included; None of a function.
    """

    words: str
    planned: PlannedMotion | None = None


def plan_found(text: str) -> RunFinding:
    """The plan of a ``result.json``.

    Raises:
        InvalidResult, ScenarioError, Contradiction: it is none, or not what a recomputation gives.
    """
    result = RunResult.from_json(text)
    with plugin_failures_named(result.scenario, Contradiction):
        motion = checked(result).motion
    words = f"it takes {motion.trajectory.duration:.5g} s and is certified for all t"
    return RunFinding(words=words, planned=PlannedMotion(scenario=result.scenario, motion=motion))
