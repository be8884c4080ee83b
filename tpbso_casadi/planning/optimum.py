"""The optimum near a plan, as a motion like any plan, and what holds it back: planned again with each limit looser.

A nonlinear program is not the problem itself: it sees limits and objective at samples, and smooth where they have
corners. So nothing is said of its optimum but of the motion that this is: finished as plans are, its limits proven,
its objective exact. And a limit is worth what planning again brings where it is one per cent looser: the program is
solved again from the optimum. All motions are certified, each under its own limits.

Like is compared with like. A descent from an optimum may end in another one beside it, so the motion with a looser
limit is compared with the better of what the same descent leads to without, and what a descent from that motion itself
leads to without: no limit gets the credit for what needs none.

A plan above its optimum may be held back by something else. So it is also timed again with each limit looser.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from problems import Constraint, Problem
from problems.base import STEP, Relaxation, as_array
from problems.programs import NonlinearProgram
from solvers import IPOPT, Solution, StopReason
from tpbso_casadi.planning.finishing import Refinement, in_least_time, retimed
from tpbso_casadi.planning.motion import JudgedMotion
from tpbso_casadi.planning.progress import Progress

LONGEST = 60.0  # s, of all descents
REPEATS = 5  # of a descent from where the last one ended, at most
BETTER = 1e-6  # relative: what is less is no other optimum
LEAST_SAVING = 1e-5  # of the objective: what is less may be where IPOPT stops
NEAR = 0.1  # of a limit's scale: a limit that is nowhere nearer than this does not hold a motion back
LOOKS = 401  # times at which it is seen how near limits are


@dataclass(frozen=True)
class Price:
    """The gain in the objective by a looser limit, or another number of the problem.

    Attributes:
        constraint: name of the limit; ``payload`` for what is carried.
        column: the joint or value.
        per_unit: change of the optimum's certified objective for one unit looser, as of the step that was planned
            again; at most 0.
        timed_again: the same of the plan, which is timed again and otherwise kept; 0 where it had to be tighter.
        unit: of that, objective over limit.
        size: of the limit; of a range its width; in its unit.
        limit_unit: the unit of the limit.
        step: by how much looser it was planned again, in the limit's unit; negative where it was tighter.
    """

    constraint: str
    column: str
    per_unit: float
    timed_again: float
    unit: str
    size: float
    limit_unit: str
    step: float

    @property
    def saves(self) -> bool:
        """Whether anything is saved where the limit is looser."""
        return self.per_unit != 0.0 or self.timed_again != 0.0

    @property
    def per_cent(self) -> float:
        """Change of the optimum's objective where the limit is 1 % of its size looser; 0 where it has none."""
        return self.per_unit * STEP * self.size

    @property
    def timed_per_cent(self) -> float:
        """Change of the objective of the plan that is timed again where the limit is 1 % of its size looser."""
        return self.timed_again * STEP * self.size

    @property
    def _rank(self) -> tuple[float, float]:
        return min(self.per_cent, self.timed_per_cent), min(self.per_unit, self.timed_again)

    def __lt__(self, other: Price) -> bool:
        """The order of prices: of which one per cent saves more comes first."""
        return self._rank < other._rank


@dataclass(frozen=True)
class Optimum:
    """An optimum near a plan.

    Attributes:
        objective: certified, of its own motion, in its unit.
        excess: of the plan's objective over it, relative; negative where the plan is better.
        program: the objective as the nonlinear program sees it.
        status: of IPOPT.
        residuals: of the conditions of optimality of the program.
        ranking: prices of what holds the motion back, that of which one per cent saves most first.
        unpriced: names of limits that are near, and of which no number is known, for which there was no time, or with
            which looser no certified motion was found.
        seconds: that it took.
    """

    objective: float
    excess: float
    program: float
    status: str
    residuals: dict[str, float]
    ranking: tuple[Price, ...]
    unpriced: tuple[str, ...]
    seconds: float


def nearest_optimum(problem: Problem[Any], plan: JudgedMotion, found: JudgedMotion, retimes: bool) -> Optimum | None:
    """Descend from a plan to the optimum near it; None where no certified motion is found.

    Args:
        problem: that was planned.
        plan: its motion.
        found: the motion of search and polish, before it was timed anew; the same where it was not.
        retimes: whether plans of this scenario are timed anew.
    """
    began = time.perf_counter()
    own = ProgramPlanner(problem, retimes, began + LONGEST)
    ends = own.optimum(plan if problem.nlp().takes_any_motion else found)
    if ends is None:
        return None
    best, again = ends
    certified = min((_finished(problem, best.motion, retimes), best.motion), key=lambda motion: motion.merit).objective
    near, unpriced = _near(problem, best.motion)
    pricing, prices = Pricing(own, best, again, (found, plan)), list[Price]()
    for relaxation in near:
        if time.perf_counter() > own.deadline or (price := pricing.price(relaxation)) is None:
            unpriced.append(relaxation.limit)
        elif price.saves:
            prices.append(price)
    return Optimum(
        objective=certified,
        excess=(plan.objective - certified) / abs(certified) if certified else 0.0,
        program=best.program,
        status=best.solution.status,
        residuals=best.solution.residuals,
        ranking=tuple(sorted(prices)),
        unpriced=tuple(dict.fromkeys(unpriced)),
        seconds=time.perf_counter() - began,
    )


def _finished(problem: Problem[Any], motion: JudgedMotion, retimes: bool) -> JudgedMotion:
    """The motion as plans are finished: as fast as its limits allow, and timed anew where plans of its scenario are."""
    fastest = in_least_time(motion)
    timed_anew = retimes and problem.criteria.objective.is_time_dependent
    return retimed(fastest, problem.direct, Progress()).chosen if timed_anew else fastest


@dataclass(frozen=True)
class Descended:
    """The certified motion at the end of a descent.

    Attributes:
        motion: itself, before it is timed anew.
        solution: of the program.
        program: the objective there as the program sees it, in its unit.
    """

    motion: JudgedMotion
    solution: Solution
    program: float


class ProgramPlanner:
    """A problem that is planned again from motions of its own or of a neighbour's.

    Args:
        problem: itself.
        retimes: whether its plans are timed anew.
        deadline: of ``time.perf_counter``, s: no descent goes on after it.
    """

    def __init__(self, problem: Problem[Any], retimes: bool, deadline: float) -> None:
        self.problem = problem
        self.deadline = deadline
        self._retimes = retimes
        self._near: Refinement | None = None

    def relaxed(self, relaxation: Relaxation) -> ProgramPlanner:
        """The planner of the problem with one limit looser, by its step."""
        return ProgramPlanner(self.problem.relaxed(relaxation, relaxation.step), self._retimes, self.deadline)

    @cached_property
    def _whole(self) -> NonlinearProgram:
        return self.problem.nlp().finer()

    @cached_property
    def _of_whole(self) -> Refinement:
        return self._refinement(self._whole)

    def _refinement(self, program: NonlinearProgram) -> Refinement:
        refinement = Refinement(self.problem, IPOPT(), program)
        refinement.descent.stop.deadline = self.deadline
        return refinement

    def _refinements(self, motion: JudgedMotion) -> Iterator[Refinement]:
        """Refinements by the rows that matter near the motion of the first descent, then by the whole program."""
        if self._near is None:
            near = self._whole.near(motion.trajectory)
            self._near = self._of_whole if near is self._whole else self._refinement(near)
        yield self._near
        if self._near.program is not self._whole and time.perf_counter() < self.deadline:
            yield self._of_whole

    def descended(self, start: JudgedMotion) -> Descended | None:
        """The end of a descent from a motion; None where that is no certified motion."""
        for refinement in self._refinements(start):
            solution = refinement(refinement.program.from_trajectory(start.trajectory))
            if solution.stop_reason is not StopReason.CONVERGED:
                return None
            motion = refinement.motion(solution.x)
            if motion.feasible:
                return Descended(motion, solution, solution.objective * refinement.program.objective_size)
        return None

    def optimum(self, start: JudgedMotion) -> tuple[Descended, Descended] | None:
        """Near a motion that from which a descent leads to nothing better, and where it leads; None where none is."""
        best = self.descended(start)
        if best is None:
            return None
        again = best
        for _ in range(REPEATS):
            again = self.descended(best.motion) or best
            if not again.motion.objective < best.motion.objective - BETTER * abs(best.motion.objective):
                break
            best = again
        return best, again

    def value(self, motion: JudgedMotion) -> float:
        """The certified objective of a motion that is finished under the limits of this problem; else infinite.

        It is not timed anew where the program itself chooses all of its timing.
        """
        criteria = self.problem.criteria
        own = criteria.at_free_times() if motion.retimed else criteria
        retimes = self._retimes and not criteria.free_timing
        finished = _finished(self.problem, replace(motion, criteria=own), retimes)
        return finished.objective if finished.feasible else np.inf


@dataclass(frozen=True)
class Pricing:
    """Plans a problem again with one limit looser.

    Attributes:
        own: the problem as it is.
        best: its optimum.
        again: where a descent from that ends.
        plans: motions of the plan, before and after it was timed anew.
    """

    own: ProgramPlanner
    best: Descended
    again: Descended
    plans: tuple[JudgedMotion, ...]

    def price(self, relaxation: Relaxation) -> Price | None:
        """The price of a limit; None where no certified motion is found with the limit looser."""
        looser, step = self.own.relaxed(relaxation), relaxation.step
        change = self._planned_again(looser)
        rates = ((change or 0.0) / step, self._timed_again(looser) / step if step > 0.0 else 0.0)
        planned, timed = (rate if rate * abs(step) < -LEAST_SAVING * abs(self._value_again) else 0.0 for rate in rates)
        if change is None and timed == 0.0:
            return None
        return Price(
            constraint=relaxation.limit,
            column=relaxation.of,
            per_unit=planned,
            timed_again=timed,
            unit=f"{looser.problem.criteria.objective.unit} / ({relaxation.unit})",
            size=relaxation.size,
            limit_unit=relaxation.unit,
            step=step,
        )

    @cached_property
    def _value(self) -> float:
        return min(map(self.own.value, self.plans))

    @cached_property
    def _value_again(self) -> float:
        return self.own.value(self.again.motion)

    def _planned_again(self, looser: ProgramPlanner) -> float | None:
        """The change of the objective when the motion is planned again under a looser limit; None without a motion."""
        found = looser.descended(self.best.motion)
        value = np.inf if found is None else looser.value(found.motion)
        if found is None or not np.isfinite(value):
            return None
        if value - self._value_again > -LEAST_SAVING * abs(self._value_again):
            return value - self._value_again
        back = self.own.descended(found.motion)
        return value - (self._value_again if back is None else min(self._value_again, self.own.value(back.motion)))

    def _timed_again(self, looser: ProgramPlanner) -> float:
        """The change of the objective when the plan is timed again under a looser limit; 0 if it is not certified."""
        return min(map(looser.value, self.plans)) - self._value if np.isfinite(self._value) else 0.0


def _near(problem: Problem[Any], motion: JudgedMotion) -> tuple[list[Relaxation], list[str]]:
    """The numbers that may hold a motion back, and the names of near limits of which no number is known."""
    criteria, timed = problem.criteria, problem.nlp().has_free_durations
    samples = motion.trajectory.samples(motion.trajectory.times(LOOKS), criteria.robot)
    found, unknown = list[Relaxation](), list[str]()
    for limit in criteria.limits:
        if limit.scales_with_time and not (timed or limit.static_limits):
            continue
        rooms = [_rooms(row) for row in limit.constraints(samples)]
        least = min((room for each in rooms for room in each.values()), default=np.inf)
        relaxations = limit.relaxations
        found += [each for each in relaxations if min(row.get(each.of, least) for row in rooms) < NEAR]
        unknown += [limit.name] if least < NEAR and not relaxations else []
    found += [*criteria.task.relaxations, *criteria.robot.relaxations]
    stated = {(id(each.statement), *each.values(each.step).items()): each for each in reversed(found)}
    return [each for each in found if each in stated.values()], unknown


def _rooms(rows: Constraint) -> dict[str, float]:
    """How far the columns of a constraint on numeric samples are from their bounds, by their names, dimensionless."""
    values, (lower, upper) = as_array(rows.expression), rows.bounds
    rooms = np.minimum(values - lower, upper - values).min(axis=0) / rows.scales
    return dict(zip(rows.columns, rooms.tolist(), strict=True))
