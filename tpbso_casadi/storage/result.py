"""result.json: its typed model, and the result of a plan.

A number that is not finite is null on disk and None in the model. Unknown and missing keys and wrong types are errors
of one line that name the key.
"""

from __future__ import annotations

import json
import re
from platform import python_version
from typing import Annotated, Any, ClassVar, Self, TypeAlias

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
    model_validator,
)

from problems import CertificateStatus, Problem, Trajectory
from problems.base import FloatArray, shown
from problems.certify import WorstIs
from solvers import StopReason
from tpbso_casadi.plain import (
    SEAL,
    BrokenSeal,
    NotJSON,
    as_json,
    check_seal,
    parsed_json,
    plain,
    sealed,
    settings_of,
    versions,
)
from tpbso_casadi.planning import Motion, PlannedMotion, Polish, Retiming, SearchedMotion
from tpbso_casadi.scenario import NestedError, Scenario, ScenarioError, StrictModel, describe, parse_scenario

SIMULATED = "what"  # the key that only the results of simulations have


class InvalidResult(ValueError):
    """Text that is not a ``result.json``; the message is one line: key path and reason."""


def _scenario(content: Any) -> Any:
    if isinstance(content, Scenario):
        return content
    if not isinstance(content, dict):
        raise ValueError("a scenario is needed")
    try:
        return parse_scenario(content)
    except ScenarioError as error:
        raise NestedError(str(error)) from error


def _all_finite(settings: dict[str, Any]) -> dict[str, Any]:
    if plain(settings) != settings:
        raise ValueError("holds a number that is not finite")
    return settings


def _rectangular(coefficients: list[list[list[float]]]) -> list[list[list[float]]]:
    if len({len(pieces) for pieces in coefficients}) > 1 or len({len(row) for p in coefficients for row in p}) > 1:
        raise ValueError("an array (order, pieces, joints) is needed")
    return coefficients


Number: TypeAlias = Annotated[float | None, BeforeValidator(plain)]  # None where it is not finite
Count: TypeAlias = Annotated[int, Field(ge=0)]
Seconds: TypeAlias = Annotated[float, Field(ge=0.0)]
Breakpoints: TypeAlias = Annotated[list[float], Field(min_length=2)]
Coefficients: TypeAlias = Annotated[list[list[list[float]]], Field(min_length=1), AfterValidator(_rectangular)]
FileName: TypeAlias = Annotated[str, Field(pattern=r"^[^/\\\x00]{1,255}$")]


class StoredTable(StrictModel, from_attributes=True):
    """A table of ``result.json``; it is read from the attributes of what it tells of, too."""

    OPTIONAL: ClassVar[tuple[str, ...]] = ()  # keys that are left out where there is nothing to say

    @model_serializer(mode="wrap")
    def _without_empty(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content: dict[str, Any] = serialize(self)
        return {key: value for key, value in content.items() if key not in self.OPTIONAL or getattr(self, key)}


class SolverResult(StoredTable):
    """The solver and its hyper-parameters, which may be those of any plug-in."""

    name: str
    settings: Annotated[dict[str, Any], AfterValidator(_all_finite)]

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Those that a scenario asks for."""
        return cls(name=scenario.solver.name, settings=settings_of(scenario.solver.build()))


class ObjectivePart(StoredTable):
    """One objective of a weighted sum: its value in ``unit``, and its weight in one over ``unit``."""

    name: str
    value: Number
    unit: str
    weight: float


class ObjectiveResult(StoredTable):
    """The objective of the plan, exact; one of a plug-in at the rows of ``trajectory.csv``.

    Attributes:
        name: of the objective, such as ``time`` or ``time + 0.02 energy``.
        value: in ``unit``; of a weighted sum the sum of weights times values.
        unit: of the value; 1 for a weighted sum.
        parts: of a weighted sum; none otherwise.
    """

    OPTIONAL = ("parts",)

    name: str
    value: Number
    unit: str
    parts: list[ObjectivePart] = Field(default_factory=list)

    @classmethod
    def of(cls, motion: Motion) -> Self:
        """The objective of a motion, and its parts where it is a weighted sum."""
        objective = motion.problem.objective
        parts = [
            ObjectivePart(name=part.name, value=value, unit=part.unit, weight=weight)
            for part, weight, value in motion.objective_parts
        ]
        return cls(name=objective.name, value=motion.objective, unit=objective.unit, parts=parts)


class ConstraintResult(StoredTable):
    """One constraint, judged for all t; worst and bound in ``unit``.

    ``worst_is`` says whether that value is exact, a proven bound or the worst found; None in results of version 1.0.0.
    """

    name: str
    worst: Number
    bound: Number
    unit: str
    status: CertificateStatus
    where: str
    satisfied: bool
    worst_is: WorstIs | None = None


class ClosestApproachResult(StoredTable):
    """How near the motion comes to an obstacle: m, s."""

    distance: Number
    time: Seconds
    pair: str


class StageResult(StoredTable):
    """A stage of a sequence, judged for all t; its constraints' times count from its start.

    ``signal`` and ``value`` are told when it begins, where it tells any.
    """

    OPTIONAL = ("constraints", "signal", "value")

    name: str
    kind: str
    start: Seconds
    end: Seconds
    constraints: list[ConstraintResult] = Field(default_factory=list)
    signal: str | None = None
    value: bool | int | float | str | None = None

    @classmethod
    def all_of(cls, motion: Motion) -> list[Self]:
        """Those of a motion; none where it is one."""
        return [
            cls(
                name=stage.label,
                kind=stage.kind,
                start=stage.start,
                end=stage.end,
                constraints=[ConstraintResult.model_validate(verdict) for verdict in verdicts],
                signal=None if stage.signal is None else stage.signal[0],
                value=None if stage.signal is None else stage.signal[1],
            )
            for stage, verdicts in zip(motion.stages, motion.by_stage, strict=False)
        ]


class AtGoalResult(StoredTable):
    """What comes after arrival.

    Attributes:
        clear_until: the robot at its goal is proven clear up to then, s; None for ever.
        touched: whether something comes too near about then; if not, no farther was looked.
    """

    clear_until: Number
    touched: bool


class CertificateResult(StoredTable):
    """All constraints together, for all t.

    Attributes:
        verdict: certified, violated or undecided.
        in_words: the same with the links whose geometry was left out; None in results of version 1.0.0.
        not_judged: what no verdict speaks of, a line each; None likewise.
    """

    verdict: CertificateStatus
    in_words: str | None = None
    not_judged: list[str] | None = None

    @classmethod
    def of(cls, motion: Motion) -> Self:
        """That of a motion."""
        return cls(verdict=motion.status, in_words=motion.status_in_words, not_judged=list(motion.not_judged))


FORMER_NAMES = (  # of variables, in results of version 1.0.0
    (re.compile("slowness"), "time_scale"),
    (re.compile(r"pace_(\d+)"), r"local_time_scale_\1"),
    (re.compile(r"pace_([a-z]\w*)"), r"time_scale_\1"),
)


def present_name(name: str) -> str:
    """What a variable is called today."""
    return next((match.expand(now) for then, now in FORMER_NAMES if (match := then.fullmatch(name))), name)


class VariableResult(StoredTable):
    """One entry of the search vector, in ``unit``."""

    name: Annotated[str, AfterValidator(present_name)]
    value: float
    unit: str

    @classmethod
    def all_of(cls, problem: Problem[Any], x: FloatArray) -> list[Self]:
        """The entries of a search vector (d,)."""
        variables = zip(problem.variables, x.tolist(), strict=True)
        return [cls(name=variable.name, value=value, unit=variable.unit) for variable, value in variables]


class SolutionResult(StoredTable):
    """The motion itself.

    Attributes:
        variables: the best search vector, before any polish; None where there was none.
        quantities: by symbol, those of the paper.
        branches: the postures near which the search kept, by stop, rad; None, and no key, where none was chosen.
        time_scale: the factor by which the search's motion has been slowed.
        breakpoints: (pieces + 1,), s.
        coefficients: (order, pieces, joints), highest power first, rad / s^n.
    """

    OPTIONAL = ("branches",)

    variables: list[VariableResult] | None
    quantities: dict[str, list[float]]
    branches: dict[str, list[float]] | None = None
    time_scale: Annotated[float, Field(gt=0.0)]
    breakpoints: Breakpoints
    coefficients: Coefficients

    @property
    def trajectory(self) -> Trajectory:
        """The motion itself."""
        return Trajectory(np.array(self.breakpoints), np.array(self.coefficients))

    @property
    def vector(self) -> FloatArray | None:
        """The search vector (d,); None where there was none."""
        return None if self.variables is None else np.array([variable.value for variable in self.variables])

    @classmethod
    def of(cls, plan: PlannedMotion) -> Self:
        """The motion of a plan, with the search vector that it comes from, before any polish."""
        motion, found = plan.motion, plan.searched
        has_vector = found is not None and not found.search.in_program_variables
        branch = {} if found is None else found.problem.branch
        return cls(
            variables=VariableResult.all_of(found.problem, found.search.x)
            if found is not None and has_vector
            else None,
            quantities=quantities_of(motion),
            branches={name: theta.tolist() for name, theta in branch.items()} or None,
            time_scale=motion.time_scale,
            **dict(PiecesResult.of(motion.trajectory)),
        )


def quantities_of(motion: Motion) -> dict[str, list[float]]:
    """By symbol, those of the paper."""
    return {name: values.tolist() for name, values in motion.quantities.items()}


class PolishedMotion(StoredTable):
    """A motion before or after a polish; the violation in the unit of the constraint that is broken most."""

    objective: Number
    worst_violation: Number
    feasible: bool


class PolishResult(StoredTable):
    """A polish; ``iterations`` and ``status`` are those of the descent that led to the best.

    Attributes:
        before: the search's motion.
        after: the refined one.
        accepted: whether the refined one is the plan.
        starts: descents made.
        iterations: of IPOPT.
        evaluations: of the objective, in all descents.
        seconds: with the compilation of the program.
        status: IPOPT's own word.
        stop_reason: the same in the words of all solvers.
        residuals: of the first-order conditions, unscaled.
        multipliers: by constraint, the sum of the absolute multipliers of its scaled rows.
    """

    before: PolishedMotion
    after: PolishedMotion
    accepted: bool
    starts: Count
    iterations: Count
    evaluations: Count
    seconds: Seconds
    status: str
    stop_reason: StopReason
    residuals: dict[str, Number]
    multipliers: dict[str, Number]

    @classmethod
    def of(cls, polish: Polish) -> Self:
        """What is stored of a polish."""
        solution = polish.search.solution
        return cls(
            before=PolishedMotion.model_validate(polish.before),
            after=PolishedMotion.model_validate(polish.after),
            accepted=polish.accepted,
            starts=polish.search.iterations,
            iterations=solution.iterations,
            evaluations=polish.search.evaluations,
            seconds=polish.seconds,
            status=solution.status,
            stop_reason=solution.stop_reason,
            residuals=dict(solution.residuals),
            multipliers=dict(polish.multipliers),
        )


class TimedMotion(PolishedMotion):
    """A motion before or after it was timed anew; s."""

    duration: Number

    @classmethod
    def of(cls, motion: Motion) -> Self:
        """What is stored of a motion before or after the last stage."""
        return cls(**dict(PolishedMotion.model_validate(motion)), duration=motion.trajectory.duration)


class PiecesResult(StoredTable):
    """A motion as its pieces; as in :class:`SolutionResult`."""

    breakpoints: Breakpoints
    coefficients: Coefficients

    @property
    def trajectory(self) -> Trajectory:
        """The motion itself."""
        return Trajectory(np.array(self.breakpoints), np.array(self.coefficients))

    @classmethod
    def of(cls, trajectory: Trajectory) -> Self:
        """The pieces of a motion."""
        return cls(breakpoints=trajectory.breakpoints.tolist(), coefficients=trajectory.coefficients.tolist())


class RetimingResult(StoredTable):
    """The last stage: the motion of search and polish, timed anew.

    Attributes:
        before: the motion of search and polish.
        after: the best of the others; None where none could be made.
        candidate: how that was made; empty where there is none.
        accepted: whether it is the plan.
        seconds: that it took.
        motion: the motion before, where another one is the plan.
    """

    before: TimedMotion
    after: TimedMotion | None
    candidate: str
    accepted: bool
    seconds: Seconds
    motion: PiecesResult | None

    @model_validator(mode="after")
    def _with_motion(self) -> Self:
        if self.accepted != (self.motion is not None):
            raise ValueError("motion: needed exactly where another motion was accepted")
        return self

    @classmethod
    def of(cls, retiming: Retiming) -> Self:
        """What is stored of the last stage."""
        return cls(
            before=TimedMotion.of(retiming.before),
            after=None if retiming.after is None else TimedMotion.of(retiming.after),
            candidate=retiming.candidate,
            accepted=retiming.accepted,
            seconds=retiming.seconds,
            motion=PiecesResult.of(retiming.before.trajectory) if retiming.accepted else None,
        )


class HistoryResult(StoredTable):
    """Evaluations and the best cost so far after each iteration, both (n,)."""

    evaluations: list[Count]
    cost: list[Number]


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
        interrupted: whether Ctrl-C or another signal cut the search or the polish short.
        history: of the search.
        versions: of the packages that decide a result.
        files: by name, the SHA-256 digests of the other files of the run; none where it was not written to a folder.
    """

    OPTIONAL = ("polish", "retiming", "closest_approach", "at_goal", "stages")

    def __repr__(self) -> str:
        value = f"{self.objective.name} {self.objective.value:.6g} {self.objective.unit}"
        return f"<content of result.json: {value}, {self.certificate.verdict}>"

    __str__ = __repr__

    scenario: Annotated[Scenario, BeforeValidator(_scenario)]
    solver: SolverResult | None
    seed: Count | None
    objective: ObjectiveResult
    cost: Number
    feasible: bool
    constraints: list[ConstraintResult]
    certificate: CertificateResult
    closest_approach: ClosestApproachResult | None = None
    at_goal: AtGoalResult | None = None
    stages: list[StageResult] = Field(default_factory=list)
    solution: SolutionResult
    polish: PolishResult | None = None
    retiming: RetimingResult | None = None
    rounds: Annotated[int, Field(ge=1)]
    evaluations: Count
    iterations: Count
    seconds: Seconds
    stop_reason: StopReason | None
    interrupted: bool
    history: HistoryResult
    versions: dict[str, str]
    files: dict[FileName, str] = Field(default_factory=dict)

    def to_json(self, indent: int | None = 2) -> str:
        """The text of ``result.json``, sealed."""
        return as_json(sealed(plain(self.model_dump(mode="json"))), indent)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read a ``result.json``.

        Raises:
            InvalidResult: naming the first wrong key; or that it is a simulation's.
        """
        try:
            document = parsed_json(text)
            if SIMULATED in document:
                check_seal(document)
                raise InvalidResult(f"{SIMULATED}: a simulation of the planner, as it was written; it holds no plan")
            content = {key: value for key, value in document.items() if key != SEAL}
            result = cls.model_validate_json(json.dumps(content), strict=True)
            check_seal(document)
        except ValidationError as error:
            raise InvalidResult(describe(error, cls, content)) from error
        except (NotJSON, BrokenSeal) as error:
            raise InvalidResult(str(error)) from error
        return result


def result_of(plan: PlannedMotion) -> RunResult:
    """The content of ``result.json``: everything to rerun and judge the plan.

    Raises:
        TypeError: it is no plan.
    """
    if not isinstance(plan, PlannedMotion):
        raise TypeError(f"plan: what plan(scenario) returns is needed, not {shown(plan)}")
    return RunResult(
        scenario=plan.scenario,
        solution=SolutionResult.of(plan),
        retiming=None if plan.retiming is None else RetimingResult.of(plan.retiming),
        interrupted=plan.interrupted,
        versions={"python": python_version(), **versions()},
        **of_motion(plan.motion),
        **(of_timing(plan.seconds_timed) if plan.searched is None else _of_search(plan.searched)),
    )


def of_motion(motion: Motion) -> dict[str, Any]:
    """The keys that judge a motion."""
    closest, at_goal = motion.closest_approach, motion.at_goal
    return {
        "objective": ObjectiveResult.of(motion),
        "constraints": [ConstraintResult.model_validate(verdict) for verdict in motion.verdicts],
        "feasible": motion.feasible,
        "certificate": CertificateResult.of(motion),
        "closest_approach": None if closest is None else ClosestApproachResult.model_validate(closest),
        "at_goal": None if at_goal is None else AtGoalResult.model_validate(at_goal),
        "stages": StageResult.all_of(motion),
    }


def _of_search(plan: SearchedMotion) -> dict[str, Any]:
    """The keys that describe a search."""
    search = plan.search
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
    """The same keys where a given path was timed in so many seconds."""
    nothing = dict.fromkeys(("solver", "seed", "cost", "polish", "stop_reason"))
    counts = {"rounds": 1, "evaluations": 0, "iterations": 0, "seconds": seconds}
    return {**nothing, **counts, "history": HistoryResult(evaluations=[], cost=[])}
