"""The tables of ``result.json``, each with how it is made of what it tells of.

A number that is not finite is null on disk and None in the model.
"""

from __future__ import annotations

import re
from dataclasses import field
from typing import Annotated, Any, ClassVar, Self, TypeAlias

import numpy as np

from problems import CertificateStatus, Problem, Trajectory
from problems.base import Checked, FloatArray, InvalidTable, Range, ReadBy, Table, reader, shown_value
from problems.base import Count as NumberOf
from problems.certify import WorstIs
from solvers import StopReason
from tpbso_casadi.plain import plain, settings_of
from tpbso_casadi.planning import JudgedMotion, PlannedMotion, Polish, Retiming
from tpbso_casadi.scenario import Scenario, current_name

MOST_ENTRIES = 10_000_000  # of a list


def _all_finite(settings: dict[str, Any]) -> dict[str, Any]:
    if plain(settings) != settings:
        raise ValueError("holds a number that is not finite")
    return settings


def _rectangular(coefficients: list[list[list[float]]]) -> list[list[list[float]]]:
    if len({len(pieces) for pieces in coefficients}) > 1 or len({len(row) for p in coefficients for row in p}) > 1:
        raise ValueError("an array (order, pieces, joints) is needed")
    return coefficients


def _finite(value: Any) -> float | None:
    number: float | None = reader(float | None)(plain(value))
    return number


Number: TypeAlias = Annotated[float | None, ReadBy(_finite)]  # None where it is not finite
Count: TypeAlias = Annotated[int, Range(least=0)]
Seconds: TypeAlias = Annotated[float, Range(least=0.0)]
Breakpoints: TypeAlias = Annotated[list[float], NumberOf(2, MOST_ENTRIES)]
Coefficients: TypeAlias = Annotated[list[list[list[float]]], NumberOf(1, MOST_ENTRIES), Checked(_rectangular)]


def _file_name(name: str) -> str:
    if not re.fullmatch(r"[^/\\\x00]{1,255}", name):
        raise ValueError(f"the name of a file is needed, not {shown_value(name)}")
    return name


FileName: TypeAlias = Annotated[str, Checked(_file_name)]


class StoredTable(Table):
    """A table of ``result.json``."""

    OPTIONAL: ClassVar[tuple[str, ...]] = ()  # keys that are left out where there is nothing to say

    def table(self) -> dict[str, Any]:
        return {key: value for key, value in super().table().items() if key not in self.OPTIONAL or getattr(self, key)}


class SolverResult(StoredTable):
    """The solver and its hyper-parameters, which may be those of any plug-in."""

    name: Annotated[str, Checked(current_name)]
    settings: Annotated[dict[str, Any], Checked(_all_finite)]

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """The solver and the settings that a scenario asks for."""
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
    parts: list[ObjectivePart] = field(default_factory=list)

    @classmethod
    def of(cls, motion: JudgedMotion) -> Self:
        """The objective of a motion, and its parts where it is a weighted sum."""
        objective = motion.criteria.objective
        parts = [
            ObjectivePart(name=part.name, value=value, unit=part.unit, weight=weight)
            for part, weight, value in motion.objective_parts
        ]
        return cls(name=objective.name, value=motion.objective, unit=objective.unit, parts=parts)


class ConstraintResult(StoredTable):
    """One constraint, judged for all t; worst and bound in ``unit``.

    ``worst_is`` says whether that value is exact, a proven bound or the worst found.
    """

    name: str
    worst: Number
    bound: Number
    unit: str
    status: CertificateStatus
    where: str
    satisfied: bool
    worst_is: WorstIs


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
    constraints: list[ConstraintResult] = field(default_factory=list)
    signal: str | None = None
    value: bool | int | float | str | None = None

    @classmethod
    def all_of(cls, motion: JudgedMotion) -> list[Self]:
        """The stages of a motion; none where it is one."""
        return [
            cls(
                name=stage.label,
                kind=stage.kind,
                start=stage.start,
                end=stage.end,
                constraints=[ConstraintResult.like(verdict) for verdict in verdicts],
                signal=None if stage.signal is None else stage.signal[0],
                value=None if stage.signal is None else stage.signal[1],
            )
            for stage, verdicts in zip(motion.stages, motion.by_stage, strict=False)
        ]


class AtGoalResult(StoredTable):
    """The clearance of the robot after arrival.

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
        in_words: the same with the links whose geometry was left out.
        not_judged: what no verdict speaks of, a line each.
    """

    verdict: CertificateStatus
    in_words: str
    not_judged: list[str]

    @classmethod
    def of(cls, motion: JudgedMotion) -> Self:
        """The certificate of a motion."""
        return cls(verdict=motion.status, in_words=motion.status_in_words, not_judged=list(motion.not_judged))


class VariableResult(StoredTable):
    """One entry of the search vector, in ``unit``."""

    name: str
    value: float
    unit: str

    @classmethod
    def all_of(cls, problem: Problem[Any], x: FloatArray) -> list[Self]:
        """The entries of a search vector (d,)."""
        variables = zip(problem.variables, x.tolist(), strict=True)
        return [cls(name=variable.name, value=value, unit=variable.unit) for variable, value in variables]


class SolutionResult(StoredTable):
    """The trajectory of the plan, and the vector that it comes from.

    Attributes:
        variables: the best search vector, before any polish; None where there was none.
        quantities: by symbol, those of the paper.
        branches: the postures near which the search kept, by stop, rad; None, and no key, where none was chosen.
        time_scale: the factor by which the search's motion has been slowed.
        breakpoints: (pieces + 1,), s; None, and no key, where ``motion.npz`` has them: in the folder of a sequence.
        coefficients: (order, pieces, joints), highest power first, rad / s^n; likewise.
    """

    OPTIONAL = ("branches", "breakpoints", "coefficients")

    variables: list[VariableResult] | None
    quantities: dict[str, list[float]]
    branches: dict[str, list[float]] | None = None
    time_scale: Annotated[float, Range(above=0.0)]
    breakpoints: Breakpoints | None = None
    coefficients: Coefficients | None = None

    def check(self) -> None:
        if (self.breakpoints is None) != (self.coefficients is None):
            raise InvalidTable("missing key", "breakpoints" if self.breakpoints is None else "coefficients")

    @property
    def trajectory(self) -> Trajectory:
        """The trajectory that is stored.

        Raises:
            InvalidTable: it stands in a file beside.
        """
        if self.breakpoints is None:
            raise InvalidTable("missing key", "solution", "breakpoints")
        return Trajectory(np.array(self.breakpoints), np.array(self.coefficients))

    def with_pieces(self, trajectory: Trajectory | None) -> Self:
        """The solution with the pieces of a motion; without any where None."""
        nothing = {"breakpoints": None, "coefficients": None}
        return self.replaced(**(nothing if trajectory is None else PiecesResult.of(trajectory).values()))

    @property
    def vector(self) -> FloatArray | None:
        """The search vector (d,); None where there was none."""
        return None if self.variables is None else np.array([variable.value for variable in self.variables])

    @classmethod
    def of(cls, plan: PlannedMotion) -> Self:
        """The motion of a plan, still without its pieces, with the search vector that it comes from."""
        motion, problem, search = plan.motion, plan.problem, plan.search
        variables = None
        if problem is not None and search is not None and not search.in_program_variables:
            variables = VariableResult.all_of(problem, search.x)
        branch = {} if problem is None else problem.branch
        return cls(
            variables=variables,
            quantities=quantities_of(motion),
            branches={name: theta.tolist() for name, theta in branch.items()} or None,
            time_scale=motion.time_scale,
        )


def quantities_of(motion: JudgedMotion) -> dict[str, list[float]]:
    """The paper's quantities, by symbol."""
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
        """The stored table of a polish."""
        solution = polish.search.solution
        return cls(
            before=PolishedMotion.like(polish.before),
            after=PolishedMotion.like(polish.after),
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
    def of(cls, motion: JudgedMotion) -> Self:
        """The stored table of a motion before or after the last stage."""
        return cls(**PolishedMotion.like(motion).values(), duration=motion.trajectory.duration)


class PiecesResult(StoredTable):
    """A motion as its pieces; as in :class:`SolutionResult`."""

    breakpoints: Breakpoints
    coefficients: Coefficients

    @property
    def trajectory(self) -> Trajectory:
        """The trajectory that is stored."""
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

    def check(self) -> None:
        if self.accepted != (self.motion is not None):
            raise InvalidTable("needed exactly where another motion was accepted", "motion")

    @classmethod
    def of(cls, retiming: Retiming) -> Self:
        """The stored table of the last stage."""
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
