"""``result.json``: its typed model, and the result of a plan.

Unknown and missing keys and wrong types are errors of one line that name the key.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from platform import python_version
from typing import Annotated, Any, Self

from problems.base import InvalidTable, Range, ReadBy, shown, shown_value
from solvers import Result, StopReason
from tpbso_casadi.plain import SEAL, BrokenSeal, NotJSON, as_json, check_seal, parsed_json, plain, sealed, versions
from tpbso_casadi.planning import JudgedMotion, PlannedMotion
from tpbso_casadi.scenario import Scenario
from tpbso_casadi.storage.tables import (
    AtGoalResult,
    CertificateResult,
    ClosestApproachResult,
    ConstraintResult,
    Count,
    FileName,
    HistoryResult,
    Number,
    ObjectiveResult,
    PolishResult,
    RetimingResult,
    Seconds,
    SolutionResult,
    SolverResult,
    StageResult,
    StoredTable,
)

SIMULATED = "what"  # the key that only the results of simulations have


class InvalidResult(ValueError):
    """Text that is not a ``result.json``; the message is one line: key path and reason."""


def stored_scenario(content: Any) -> Scenario:
    """The scenario of a result, which is complete without files.

    Raises:
        ValueError: it is none.
    """
    if not isinstance(content, Scenario | dict):
        raise ValueError(f"a scenario is needed, not {shown_value(content)}")
    return Scenario.from_table(content).normalised().with_postures()


class RunResult(StoredTable):
    """Everything to rerun and judge a plan; the keys of ``result.json``, in their order.

    Where a given path was timed there was no search: solver, seed, cost and reason to stop are None, the history is
    empty, and ``seconds`` is what the timing took.

    Attributes:
        scenario: complete, defaults filled in.
        solver: with all its settings.
        seed: of the search.
        objective: of the plan.
        cost: of the search's best candidate.
        feasible: whether every constraint is certified.
        constraints: each judged for all t.
        certificate: all together.
        closest_approach: to an obstacle; None, and no key, where none is within reach.
        at_goal: what comes after arrival; likewise where nothing moves.
        stages: of a sequence; none otherwise.
        solution: the motion.
        polish: None, and no key, where there was none.
        retiming: the last stage; likewise.
        rounds: searches made; only the best is described here.
        evaluations: of the search.
        iterations: of the search.
        seconds: that the search took.
        stop_reason: which criterion ended the search.
        interrupted: whether Ctrl-C, another signal, or what a plug-in or a callback raised cut the work short.
        history: of the search.
        versions: of the packages that decide a result.
        files: by name, the SHA-256 digests of the other files of the run; none where it was not written to a folder.
    """

    OPTIONAL = ("polish", "retiming", "closest_approach", "at_goal", "stages")

    def __repr__(self) -> str:
        value = f"{self.objective.name} {self.objective.value:.6g} {self.objective.unit}"
        return f"<content of result.json: {value}, {self.certificate.verdict}>"

    __str__ = __repr__

    scenario: Annotated[Scenario, ReadBy(stored_scenario)]
    solver: SolverResult | None
    seed: Count | None
    objective: ObjectiveResult
    cost: Number
    feasible: bool
    constraints: list[ConstraintResult]
    certificate: CertificateResult
    closest_approach: ClosestApproachResult | None = None
    at_goal: AtGoalResult | None = None
    stages: list[StageResult] = field(default_factory=list)
    solution: SolutionResult
    polish: PolishResult | None = None
    retiming: RetimingResult | None = None
    rounds: Annotated[int, Range(least=1)]
    evaluations: Count
    iterations: Count
    seconds: Seconds
    stop_reason: StopReason | None
    interrupted: bool
    history: HistoryResult
    versions: dict[str, str]
    files: dict[FileName, str] = field(default_factory=dict)

    def to_json(self, indent: int | None = 2) -> str:
        """The text of ``result.json``, sealed."""
        return as_json(sealed(plain(self.table())), indent)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read the text of a ``result.json``.

        Raises:
            InvalidResult: naming the first wrong key; or that it is a simulation's.
        """
        try:
            document = parsed_json(text)
            if SIMULATED in document:
                check_seal(document)
                raise InvalidResult(f"{SIMULATED}: a simulation of the planner, as it was written; it holds no plan")
            content = {key: value for key, value in document.items() if key != SEAL}
            result = cls.from_table(content)
            check_seal(document)
        except (NotJSON, BrokenSeal, InvalidTable) as error:
            raise InvalidResult(str(error)) from error
        except RecursionError as error:
            raise InvalidResult("not JSON of ours: nested too deeply") from error
        return result


@dataclass(frozen=True, kw_only=True, repr=False)
class StoredRun(PlannedMotion):
    """A plan as a run folder holds it: its search is known by its record alone.

    Attributes:
        result: the content of ``result.json``.
    """

    result: RunResult


def stored(plan: PlannedMotion) -> StoredRun:
    """The plan as reading its run folder would give it."""
    if isinstance(plan, StoredRun):
        return plan
    known = {field.name: getattr(plan, field.name) for field in fields(plan) if field.name not in ("search", "polish")}
    return StoredRun(**known, result=result_of(plan))


def result_of(plan: PlannedMotion) -> RunResult:
    """Everything to rerun and judge the plan.

    Raises:
        TypeError: it is no plan.
    """
    if not isinstance(plan, PlannedMotion):
        raise TypeError(f"plan: what plan(scenario) returns is needed, not {shown(plan)}")
    result = _without_pieces(plan)
    return result.replaced(solution=result.solution.with_pieces(plan.trajectory))


def folder_result(plan: PlannedMotion) -> RunResult:
    """The content of ``result.json`` in a run folder, which has a file beside for the pieces of a sequence."""
    return _without_pieces(plan) if plan.motion.stages else result_of(plan)


def _without_pieces(plan: PlannedMotion) -> RunResult:
    """The result of a plan, but for the pieces of its motion."""
    if isinstance(plan, StoredRun):
        return plan.result.replaced(solution=plan.result.solution.with_pieces(None))
    return RunResult(
        scenario=plan.scenario,
        solution=SolutionResult.of(plan),
        retiming=None if plan.retiming is None else RetimingResult.of(plan.retiming),
        interrupted=plan.interrupted,
        versions={"python": python_version(), **versions()},
        **of_motion(plan.motion),
        **(of_timing(plan.seconds_timed) if plan.search is None else _of_search(plan, plan.search)),
    )


def of_motion(motion: JudgedMotion) -> dict[str, Any]:
    """The keys that judge a motion."""
    closest, at_goal = motion.closest_approach, motion.at_goal
    return {
        "objective": ObjectiveResult.of(motion),
        "constraints": [ConstraintResult.like(verdict) for verdict in motion.verdicts],
        "feasible": motion.feasible,
        "certificate": CertificateResult.of(motion),
        "closest_approach": None if closest is None else ClosestApproachResult.like(closest),
        "at_goal": None if at_goal is None else AtGoalResult.like(at_goal),
        "stages": StageResult.all_of(motion),
    }


def _of_search(plan: PlannedMotion, search: Result) -> dict[str, Any]:
    """The keys that describe the search of a plan."""
    return {
        "solver": SolverResult.of(plan.scenario),
        "seed": plan.scenario.solver.seed,
        "cost": search.cost,
        "polish": None if plan.polish is None else PolishResult.of(plan.polish),
        "rounds": plan.rounds,
        "evaluations": search.evaluations,
        "iterations": search.iterations,
        "seconds": search.seconds,
        "stop_reason": search.stop_reason,
        "history": HistoryResult(evaluations=search.history.evaluations.tolist(), cost=search.history.cost.tolist()),
    }


def of_timing(seconds: float) -> dict[str, Any]:
    """The keys of a search where a given path was timed in so many seconds."""
    nothing = dict.fromkeys(("solver", "seed", "cost", "polish", "stop_reason"))
    counts = {"rounds": 1, "evaluations": 0, "iterations": 0, "seconds": seconds}
    return {**nothing, **counts, "history": HistoryResult(evaluations=[], cost=[])}
