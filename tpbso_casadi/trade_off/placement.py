"""Where the next point of a front is asked for.

Least time leaves the energy of joints free that nothing hurries, the shortest path leaves its timing free: so each end
is planned again with what is left of the other objective, for ``NEAR_END`` of its own at most.

Two ways to make one objective out of two. The *epsilon-constraint* method (Haimes, Lasdon and Wismer 1971) minimises
one objective and bounds the other one, which has to be the duration; it finds every point of a front. *Weighted sums*
need no bound; their weights are those for which two neighbours are equally good (Aneja and Nair 1979), so that each sum
either finds a plan below the line between them, or shows that none is; where a front is not convex, it cannot be found.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from problems import Objective, Problem, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from tpbso_casadi.scenario import PluginError, Scenario, ScenarioError, find_objective, parse_scenario
from tpbso_casadi.trade_off.front import Pair, Point, PointFront, Request, Scalarisation, width

ENDS: tuple[Pair, Pair] = ((1.0, 0.0), (0.0, 1.0))
ATTEMPTS = 2  # at a plan that comes out dominated, or not certified
SAME_REQUEST = 1e-3  # of the front's width, or rad between two weightings
NEAR_END = 1e-3  # of the front's width in an end's own objective
DIGITS = 9  # of a bound, or of a weight


@dataclass(frozen=True)
class Placement(ABC):
    """A way to place points on a front.

    Args:
        count: of the points to place, both ends among them, but not what is planned near them.
    """

    count: int

    def near_ends(self, ends: Sequence[Point]) -> list[Scalarisation]:
        """Scalarisations near the ends: of each sum ``NEAR_END`` is the other objective, in widths of the front."""
        first, second = width([point.values for point in ends]).tolist()
        small = _rounded(NEAR_END * first / second), _rounded(first / second / NEAR_END)
        return [Scalarisation((1.0, weight)) for weight in small]

    @abstractmethod
    def between(self, before: Point, after: Point) -> Scalarisation:
        """The scalarisation in a gap; ``before`` is better in the first objective."""

    @abstractmethod
    def is_same(self, one: Scalarisation, other: Scalarisation, front: PointFront) -> bool:
        """Whether two would lead to about the same plan."""

    @abstractmethod
    def neighbours(self, asked: Scalarisation, front: PointFront) -> list[Point]:
        """Points of a front on both sides of where a plan should come to lie, or at its end."""

    def next(self, points: Sequence[Point]) -> Request | None:
        """The next plan to make; None where there is none.

        Args:
            points: all those that have been made.
        """
        requests = [point.request for point in points if point.request is not None]
        placed = [request.scalarisation for request in requests if request.attempt == 0]
        if len(placed) < len(ENDS):
            return Request(scalarisation=Scalarisation(ENDS[len(placed)]))
        near_ends = self.near_ends(points[: len(ENDS)])
        number = len(placed) - len(ENDS)
        if number < len(near_ends):
            return Request(scalarisation=near_ends[number], starts=(points[number].number,))
        front = PointFront.of(points)
        gap = self._gap(placed, front) if number < self.count else None
        return self._again(points, front) if gap is None else gap

    def _gap(self, placed: Sequence[Scalarisation], front: PointFront) -> Request | None:
        """The request in the largest gap in which nothing has been tried yet."""
        for before, after in front.gaps:
            asked = self.between(before, after)
            if not any(self.is_same(asked, other, front) for other in placed):
                return Request(scalarisation=asked, starts=(before.number, after.number))
        return None

    def _again(self, points: Sequence[Point], front: PointFront) -> Request | None:
        """The request whose own answer is not the best known one, from the points that now are its neighbours."""
        answers = [(point, point.request) for point in points if point.request is not None]
        made = {(request.scalarisation, request.attempt) for _, request in answers}
        for point, request in answers:
            asked, following = request.scalarisation, request.attempt + 1
            if following < ATTEMPTS and (asked, following) not in made and not is_best(point, asked, front):
                starts = tuple(neighbour.number for neighbour in self.neighbours(asked, front))
                return Request(scalarisation=asked, attempt=following, starts=starts)
        return None


@dataclass(frozen=True)
class EpsilonConstraint(Placement):
    """The other objective is minimised, the duration is bounded.

    Args:
        duration: which of the two objectives is the duration: 0 or 1.
    """

    duration: int

    def near_ends(self, ends: Sequence[Point]) -> list[Scalarisation]:
        near, times = super().near_ends(ends), [point.values[self.duration] for point in ends]
        longest = times[self.duration] + NEAR_END * float(np.ptp(times))
        near[self.duration] = Scalarisation(ENDS[1 - self.duration], _rounded(longest))
        return near

    def between(self, before: Point, after: Point) -> Scalarisation:
        middle = (before.values[self.duration] + after.values[self.duration]) / 2.0
        return Scalarisation(ENDS[1 - self.duration], _rounded(middle))

    def is_same(self, one: Scalarisation, other: Scalarisation, front: PointFront) -> bool:
        """Whether the bounds differ by ``SAME_REQUEST`` of the front's width at most."""
        if one.longest is None or other.longest is None:
            return one == other
        allowed = SAME_REQUEST * float(width([point.values for point in front.points])[self.duration])
        return abs(one.longest - other.longest) <= allowed

    def neighbours(self, asked: Scalarisation, front: PointFront) -> list[Point]:
        by_time = sorted(front.points, key=lambda point: point.values[self.duration])
        if asked.longest is None:
            return by_time[-1:] if asked.weights[self.duration] == 0.0 else by_time[:1]
        kept = [point for point in by_time if point.values[self.duration] <= asked.longest]
        return kept[-1:] + by_time[len(kept) : len(kept) + 1]


@dataclass(frozen=True)
class WeightedSums(Placement):
    """A weighted sum is minimised."""

    def between(self, before: Point, after: Point) -> Scalarisation:
        """The weights of which both sums are the same; the first weight is 1."""
        first, second = np.abs(np.subtract(before.values, after.values)).tolist()
        return Scalarisation((1.0, _rounded(first / second)))

    def is_same(self, one: Scalarisation, other: Scalarisation, front: PointFront) -> bool:
        """Whether the directions in which the two go down differ by ``SAME_REQUEST`` rad at most."""
        scale = width([point.values for point in front.points])
        angles = [float(np.arctan2(*(np.array(each.weights) * scale))) for each in (one, other)]
        return abs(angles[0] - angles[1]) <= SAME_REQUEST

    def neighbours(self, asked: Scalarisation, front: PointFront) -> list[Point]:
        return sorted(front.points, key=lambda point: float(np.dot(asked.weights, point.values)))[:2]


def is_best(point: Point, asked: Scalarisation, front: PointFront) -> bool:
    """Whether a point is certified, and no other that keeps the same bound has a smaller sum, to ``NEAR_END``."""
    weights = np.array(asked.weights)
    longest = np.inf if asked.longest is None else asked.longest
    allowed = NEAR_END * float(weights @ width([each.values for each in front.points]))
    sums = [float(weights @ each.values) for each in front.points if each.duration <= longest]
    return point.certified and float(weights @ point.values) <= min(sums, default=np.inf) + allowed


def _rounded(number: float) -> float:
    """The number with ``DIGITS`` significant ones: a scenario file holds it."""
    return float(f"{number:.{DIGITS}g}")


BOUND = "total_time"  # the key of [task] that bounds the duration
SHORTEST = 1e-3  # of the longest duration, where the scenario states no shortest


@dataclass(frozen=True)
class Objectives:
    """Two objectives of one scenario.

    Args:
        scenario: that states everything but the objective.
        names: of the two.

    Raises:
        ScenarioError: there are not two different ones, one is unknown, or the task has no objective to choose.
    """

    scenario: Scenario
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        if len(self.names) != len(ENDS) or len(set(self.names)) != len(ENDS):
            raise ScenarioError(f"--objectives {','.join(self.names)}: two different ones are needed")
        for name in self.names:
            try:
                find_objective(name, self.scenario.task.own_objectives)
            except PluginError as error:
                raise ScenarioError(f"--objectives: {error}") from error
        if "objective" not in self.scenario.task.schema():
            raise ScenarioError(f"task.kind: {self.scenario.task.kind!r} has no objective to choose")
        if self.scenario.solver.within is not None:
            raise ScenarioError("solver.within: a trade-off makes plans of so many evaluations; leave it out")

    @property
    def both(self) -> tuple[Objective, Objective]:
        """The two objectives themselves."""
        first, second = (find_objective(name, self.scenario.task.own_objectives) for name in self.names)
        return first, second

    @property
    def headings(self) -> tuple[str, str]:
        """Names of the objectives with their units."""
        first, second = (f"{objective.name} [{objective.unit}]" for objective in self.both)
        return first, second

    @property
    def duration(self) -> int | None:
        """The number of the objective that is the duration, where the scenario can bound that; None where none is."""
        task, motion = self.scenario.task, self.scenario.model.motion
        foreign = {key for keys in task.keys_of.values() for key in keys} - set(task.keys_of.get(motion, ()))
        if BOUND not in task.schema() or BOUND in foreign:
            return None
        return next((i for i, objective in enumerate(self.both) if objective.is_duration), None)

    def values(self, criteria: Criteria, trajectory: Trajectory, times: FloatArray) -> Pair:
        """The values of both of a finished motion; one without a closed form at times (n,) in s."""
        first, second = (objective.of_motion(trajectory, criteria.robot, times) for objective in self.both)
        return first, second

    def asked_for(self, request: Request) -> Scenario:
        """The scenario of a request: as many more starts of a refinement as it gives, another seed at each attempt.

        Raises:
            ScenarioError: there is no such scenario.
        """
        solver = self.scenario.solver
        starts = solver.polish_starts if solver.kind().solves_program else solver.polish_starts + len(request.starts)
        further = {"seed": solver.seed + request.attempt, "polish_starts": starts}
        return self._scenario(request.scalarisation, further)

    @cached_property
    def _timing(self) -> dict[str, bool]:
        """Keys of [model] with which all points are timed alike: anew, where one of the ends would be.

        A plan for the least time that keeps the timing of its search would lose against any other that does not.
        """
        ends = [parse_scenario(self._content(Scalarisation(end), {})).model.retime for end in ENDS]
        return {"retime": True} if len(set(ends)) > 1 else {}

    def _scenario(self, asked: Scalarisation, further: dict[str, Any]) -> Scenario:
        content = self._content(asked, further)
        content["model"] |= self._timing
        return parse_scenario(content)

    def _content(self, asked: Scalarisation, further: dict[str, Any]) -> dict[str, Any]:
        content = self.scenario.table()
        content["model"] = self.scenario.model.stated()
        content["solver"] |= further
        content["task"]["objective"] = self._objective(asked.weights)
        if asked.longest is not None:
            stated = content["task"][BOUND]
            content["task"][BOUND] = [SHORTEST * asked.longest if stated is None else stated[0], asked.longest]
        return content

    def _objective(self, weights: Pair) -> str | dict[str, float]:
        """The key of [task]: one alone, or a table of both."""
        terms = {name: weight for name, weight in zip(self.names, weights, strict=True) if weight != 0.0}
        return dict(terms) if len(terms) > 1 else next(iter(terms))

    def problems(self) -> tuple[Problem[Any], Problem[Any]]:
        """The problems of both ends.

        Raises:
            ScenarioError: the robot cannot do the task, or an objective does not apply to it.
        """
        first, second = (self.asked_for(Request(scalarisation=Scalarisation(end))).problem() for end in ENDS)
        return first, second
