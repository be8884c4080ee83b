"""After the search: polish by gradients, timing in least time, and the planned motion."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, islice
from typing import Any

import numpy as np

from problems import InvalidProblem, Problem, Trajectory, Verdict
from problems.assembly import Criteria, DirectPlanner
from problems.base import FloatArray, as_array
from problems.limits import depends_on_speed
from problems.polish import never
from problems.programs import NonlinearProgram
from problems.timing import least_time_move, rest_to_rest, retime
from solvers import IPOPT, Budget, Descent, DescentResult, Result, Solution, Status, StopReason, descend
from tpbso_casadi.planning.controller_rows import ControllerRows
from tpbso_casadi.planning.motion import JudgedMotion
from tpbso_casadi.planning.progress import Progress, log_search
from tpbso_casadi.scenario import Scenario

MARGINS = (3e-3, 1e-2)  # tried in turn when a solution breaks a limit between its samples
START_DISTANCE = 0.5  # rad: two starts differ by more than that in some joint at some time
COMPARISON_TIMES = 21  # at which they are compared


def has_descents(problem: Problem[Any]) -> bool:
    """Whether candidates of a search are refined by descents of the nonlinear program."""
    return problem.has_program and not problem.direct.replaces_descents


class Refinement:
    """A problem's nonlinear program, compiled; its solutions are compared by the merit of their motions.

    Args:
        problem: to be solved.
        solver: IPOPT's settings.
        program: that of the problem, or what of it matters near a motion; all of it if None.
    """

    def __init__(self, problem: Problem[Any], solver: IPOPT, program: NonlinearProgram | None = None) -> None:
        self.problem = problem
        self.program = problem.nlp() if program is None else program
        self.descent = Descent(self.program, solver)
        self._latest: tuple[FloatArray, JudgedMotion] | None = None

    def motion(self, x: FloatArray) -> JudgedMotion:
        """The motion of a solution's variables (n,); the same as last time, judged already, where these are."""
        if self._latest is None or not np.array_equal(self._latest[0], x):
            trajectory, quantities = self.program.trajectory(x), self.program.quantities(x)
            self._latest = x, JudgedMotion(self.problem.criteria, trajectory, quantities)
        return self._latest[1]

    def merit(self, solution: Solution) -> float:
        """The merit of a solution as a motion: lower is better."""
        return self.motion(solution.x).merit

    def multipliers(self, solution: Solution) -> dict[str, float]:
        """Sums of the absolute multipliers of scaled rows, by constraint."""
        rows = self.program.rows
        parts = np.split(solution.row_multipliers, np.cumsum([c.expression.numel() for c in rows])[:-1])
        return {c.name: float(np.abs(part).sum()) for c, part in zip(rows, parts, strict=True)}

    def __call__(self, start: FloatArray) -> Solution:
        """Descend; if the solution is feasible at its samples but not between them, continue with a larger margin."""
        solution = self.descent(start)
        for margin in MARGINS:
            if solution.stop_reason is not StopReason.CONVERGED or self.motion(solution.x).feasible:
                return solution
            solution = self.descent(solution.x, margin).after(solution)
        return solution

    def descend(
        self,
        starts: Iterable[FloatArray],
        budget: Budget,
        seed: int | None = None,
        callback: Callable[[Status], object] | None = None,
    ) -> DescentResult:
        """The best descent from starts (n,), one after the other."""
        return descend(self, self.descent.stop, starts, self.merit, budget, seed, callback)


@dataclass(frozen=True)
class Polish:
    """The refinement of a metaheuristic's best candidates by IPOPT.

    Attributes:
        before: the best motion of the search.
        after: the best of the refined ones, accepted or not.
        search: by IPOPT; its iterations are starts.
        seconds: with the compilation of the program.
        multipliers: by constraint, the sum of the absolute final multipliers of its scaled rows.
    """

    before: JudgedMotion
    after: JudgedMotion
    search: DescentResult
    seconds: float
    multipliers: dict[str, float]

    @property
    def accepted(self) -> bool:
        """Whether the refined motion is feasible and better; if not it is discarded."""
        return self.after.feasible and self.after.merit < self.before.merit

    @property
    def chosen(self) -> JudgedMotion:
        """The better of the two motions."""
        return self.after if self.accepted else self.before


def polish(
    problem: Problem[Any],
    before: JudgedMotion,
    candidates: Sequence[FloatArray],
    starts: int,
    progress: Progress,
    first: Sequence[Trajectory] = (),
) -> Polish:
    """Refine the best candidate of a search, and ``starts - 1`` others that differ from it.

    Args:
        problem: that has been searched.
        before: the motion of the best.
        candidates: of the search, each (d,), the best first.
        starts: how many to refine.
        progress: is told the status after every start.
        first: motions to refine before any candidate; they count among the starts.
    """
    began = time.perf_counter()
    progress.phase("polishing")
    refinement = Refinement(problem, IPOPT())
    chosen = distinct(problem, candidates, max(0, starts - len(first)))
    given = map(refinement.program.from_trajectory, first)
    program_starts = chain(given, map(refinement.program.from_search, chosen))
    polished = refine(before, program_starts, refinement, Budget(iterations=starts), progress)
    return replace(polished, seconds=time.perf_counter() - began)


def refine(
    before: JudgedMotion, starts: Iterable[FloatArray], refinement: Refinement, budget: Budget, progress: Progress
) -> Polish:
    """Descend from starts (n,) of the compiled program; the best counts, if it is better than ``before``."""
    search = refinement.descend(starts, budget, callback=progress.status)
    log_search("polish", search)
    multipliers = refinement.multipliers(search.solution)
    return Polish(before, refinement.motion(search.x), search, search.seconds, multipliers)


def distinct(problem: Problem[Any], candidates: Iterable[FloatArray], count: int) -> list[FloatArray]:
    """The first ``count`` candidates whose motions lie apart in joint space, in the given order."""
    phases = np.linspace(0.0, 1.0, COMPARISON_TIMES)

    def apart() -> Iterable[FloatArray]:
        earlier: list[FloatArray] = []
        for x in candidates:
            trajectory = problem.trajectory(x)
            theta = as_array(trajectory.samples(phases * trajectory.duration).theta)
            if all(np.abs(theta - other).max() > START_DISTANCE for other in earlier):
                earlier.append(theta)
                yield x

    return list(islice(apart(), count))


LOG = logging.getLogger(__name__)
POLISHED = "sequential programs"  # the candidate that changes path and speed
FREE_SPACE = "free space"  # the candidate that is the fastest between its ends where nothing is in the way
SAME_PATH = "same path"  # the candidate that runs the path of the motion before
CANDIDATES = (FREE_SPACE, POLISHED, SAME_PATH)
AS_FAST = 1.0 + 1e-6  # how much slower it may be run and is still the fastest
SAME_OBJECTIVE = 1e-9  # relative: what a path gains or loses when it is run at other times is rounding


@dataclass(frozen=True)
class Retiming:
    """A motion and what became of it when it was timed anew.

    Attributes:
        before: the motion of search and polish.
        after: the best of the candidates, accepted or not; None where none could be made.
        candidate: which of ``CANDIDATES`` that is; empty where there is none.
        seconds: that it took.
    """

    before: JudgedMotion
    after: JudgedMotion | None
    candidate: str
    seconds: float

    @property
    def accepted(self) -> bool:
        """Whether the other motion is certified and better; if not it is discarded."""
        return self.after is not None and is_better(self.after, self.before)

    @property
    def chosen(self) -> JudgedMotion:
        """The better of the two motions."""
        return self.after if self.after is not None and self.accepted else self.before


def is_better(motion: JudgedMotion, before: JudgedMotion) -> bool:
    """Whether a motion is certified, and the other is not, has a larger objective, or the same one and takes longer."""
    objective = motion.criteria.objective
    if not motion.feasible or not before.feasible:
        return motion.feasible
    if objective.is_time_dependent or not objective.sooner_is_better:
        return motion.compared < before.compared
    same = motion.compared <= before.compared + SAME_OBJECTIVE * abs(before.compared)
    return same and motion.trajectory.duration < before.trajectory.duration


def retimed(
    before: JudgedMotion, planner: DirectPlanner, progress: Progress, is_enough: Callable[[bool], bool] = never
) -> Retiming:
    """Time a finished motion anew, in all the ways there are.

    Where free space will do, nothing is faster between the same postures, unless it had to be slowed down for limits
    that it is not made for, as torques are; other postures at the ends may be.

    Args:
        before: the motion.
        planner: that of its problem.
        progress: is told that this begins.
        is_enough: whether to come to an end, with a motion that is known or without one.
    """
    began = time.perf_counter()
    progress.phase("retiming")
    made: dict[str, JudgedMotion] = {}
    settled = False
    # the motion in free space first: there is no faster one between two postures
    for name, trajectories, certain in (
        (FREE_SPACE, _free_space(before), False),
        (POLISHED, planner.polished(before.trajectory, is_enough), planner.replaces_descents),
        (SAME_PATH, _same_path(before), True),
    ):
        if settled and not (name == POLISHED and planner.ends_may_move):
            continue
        motion, slower = _attempted(trajectories, before)
        if motion is not None:
            made[name] = motion
            settled = settled or (motion.feasible and (certain or (name == FREE_SPACE and slower <= AS_FAST)))
    best = min(made, key=lambda name: (made[name].merit, made[name].trajectory.duration), default="")
    seconds = time.perf_counter() - began
    LOG.info("retiming: %s, best of %d in %.3f s", best or "no candidate", len(made), seconds)
    return Retiming(before, made.get(best), best, seconds)


def _attempted(trajectories: Iterable[Trajectory], before: JudgedMotion) -> tuple[JudgedMotion | None, float]:
    """The first certified motion of a candidate, or its last, None where it cannot be made; how much it was slowed."""
    motion, slower = None, 1.0
    try:
        for trajectory in trajectories if before.trajectory.is_finite else ():
            motion = slowed(before.timed_anew(trajectory))
            slower = motion.trajectory.duration / trajectory.duration
            if motion.feasible:
                break
    except InvalidProblem:  # it stands still, for example
        pass
    return motion, slower


def slowed(motion: JudgedMotion) -> JudgedMotion:
    """The motion, slower where its limits need it."""
    scale = motion.criteria.safe_time_scale(motion.trajectory)
    return motion if scale <= 1.0 else replace(motion, trajectory=motion.trajectory.time_scaled(scale))


def in_least_time(motion: JudgedMotion) -> JudgedMotion:
    """The motion as fast as its limits allow without changing its shape, where sooner is better; else only slower."""
    criteria = motion.criteria
    if not criteria.task.at_rest:
        return motion
    scale = criteria.safe_time_scale(motion.trajectory)
    if not scale > 0.0:  # it stands still
        return motion
    least = scale if criteria.objective.sooner_is_better and not depends_on_speed(criteria.limits) else max(1.0, scale)
    return replace(motion, trajectory=motion.trajectory.time_scaled(least))


def _same_path(before: JudgedMotion) -> Iterator[Trajectory]:
    """The motion's own path in the least time, unless that is what it is; an end that moves keeps its velocity.

    A nonlinear program that minimises the time under jerk limits leaves nothing to gain, and that would take long; nor
    does a motion that keeps its limits, where sooner may be worse.
    """
    criteria, objective, robot = before.criteria, before.criteria.objective, before.criteria.robot
    programmed = criteria.free_timing and objective.is_time_dependent and robot.limits.jerk is not None
    slow_enough = before.feasible and objective.chooses_duration
    if before.retimed or programmed or slow_enough:
        return
    start, goal = criteria.task.end_velocities
    rates = float(start.any()), float(goal.any())
    yield retime(before.path, robot.limits, rates, chain=robot.rigid_chain)


def _free_space(before: JudgedMotion) -> Iterator[Trajectory]:
    """The fastest motion between the same ends, where nothing but time counts and nothing is passed on the way."""
    criteria, objective = before.criteria, before.criteria.objective
    if not (objective.is_time_dependent and objective.sooner_is_better and criteria.task.passes_nothing):
        return
    start, goal = before.trajectory.at(before.trajectory.breakpoints[[0, -1]])
    velocities, limits = criteria.task.end_velocities, criteria.robot.limits
    if velocities.any():
        yield least_time_move(start, goal, velocities[0], velocities[1], limits)
    else:
        yield rest_to_rest(start, goal, limits)


@dataclass(frozen=True, kw_only=True, repr=False)
class PlannedMotion:
    """A motion, what it was asked for, and how it was found.

    Attributes:
        scenario: robot, task, limits and solver.
        motion: the plan itself.
        problem: that was searched; None where a given path was timed.
        search: result and record of the search, before any polish; None where there was none, or the plan is read.
        polish: the refinement by IPOPT; None where there was none, or the plan is read.
        rounds: searches made; ``search`` is the one that led to the best motion.
        retiming: the last stage of a search; None where there was none, or it changed nothing and the plan is read.
        interrupted: whether Ctrl-C, or what was raised meanwhile, cut the work short.
        seconds_timed: that the timing of a given path took; 0 where there was a search.
        name: of the case or the file, for titles; empty where nobody knows one.
        kept: how many motions of a sequence are those of an earlier plan; None where none was given.
    """

    scenario: Scenario
    motion: JudgedMotion
    problem: Problem[Any] | None = None
    search: Result | None = None
    polish: Polish | None = None
    rounds: int = 1
    retiming: Retiming | None = None
    interrupted: bool = False
    seconds_timed: float = 0.0
    name: str = ""
    kept: int | None = None

    def __repr__(self) -> str:
        return f"<planned motion: {self.trajectory!r}>"

    @property
    def found(self) -> JudgedMotion:
        """The motion of search and polish: the same unless it was timed anew."""
        return self.retiming.before if self.retiming is not None and self.retiming.accepted else self.motion

    @property
    def criteria(self) -> Criteria:
        """The criteria that the motion is judged by."""
        return self.motion.criteria

    @property
    def trajectory(self) -> Trajectory:
        """The trajectory of the motion."""
        return self.motion.trajectory

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Each constraint of the motion, judged for all t."""
        return self.motion.verdicts

    @property
    def feasible(self) -> bool:
        """Whether every constraint holds."""
        return self.motion.feasible

    @property
    def objective(self) -> float:
        """The objective of the motion."""
        return self.motion.objective

    @property
    def times(self) -> FloatArray:
        """The times in s of the rows of ``trajectory.csv``."""
        return self.motion.times

    @cached_property
    def controller_rows(self) -> ControllerRows:
        """Rows for a controller that joins them by polynomials, and what it makes of them, judged."""
        return ControllerRows.of(self.motion)
