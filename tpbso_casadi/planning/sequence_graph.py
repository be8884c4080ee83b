"""The graph of a sequence: postures at its stops, what motions between them take at least, its shortest ways."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import islice, pairwise

import numpy as np
from numpy.typing import NDArray

from problems import InvalidProblem, Robot
from problems.base import FloatArray, tell_step
from problems.tasks import Joints, Place, Surroundings
from tpbso_casadi.planning.known_motions import KnownMotions
from tpbso_casadi.planning.stops import (
    MOST_POSTURES,
    Edges,
    SequenceStop,
    bounds_between,
    in_one_turn,
    in_short_turns,
    reached_at,
    soonest_at,
)
from tpbso_casadi.planning.visits import Visits, shortest_way
from tpbso_casadi.planning.ways import FoundWays, NotClear, ToolWay, clear_ways, least_times, postures_at, ways_from
from tpbso_casadi.scenario import (
    Cell,
    LedStage,
    MovingStage,
    PointToPointTask,
    Scenario,
    ScenarioError,
    SequenceTask,
    StageSection,
    walked,
)

SURELY_LESS = 0.99  # times the time through points of a way is less than exactly: it was 1.0055 of that at most
MOST_VISITED = 12  # postures of a stop, in any turn, where the order is free: its search takes the square of them


class StageFailure(ScenarioError):
    """A stage that moves cannot be done, or no motion was found for it.

    Attributes:
        share: of the stages that move, those that can be done before it.
    """

    share: float = 0.0


class NoMotion(StageFailure):
    """No certified motion was found for a stage, though nothing of it is known to be impossible."""


class SequenceGraph:
    """The graph of one sequence: its nodes are postures, its edges the motions of stages that move.

    Args:
        scenario: that states it.
        known: motions that are planned already, of an earlier plan too, whose postures are preferred then.
        digits: to which bodies are where they are taken up, for many graphs that differ in little; None for exactly.

    Raises:
        ScenarioError: no posture is found at a stop, or none from which the tool can be led on.

    Attributes:
        stops: where the arm may stand before the first stage that moves, and after each of them.
        edges: of each of these stages.
        bound: what all stages take at least between these postures in free space, with all waits, s.
    """

    def __init__(self, scenario: Scenario, known: KnownMotions | None = None, digits: int | None = None) -> None:
        assert isinstance(scenario.task, SequenceTask)
        self.scenario, self.task, self.known = scenario, scenario.task, known or KnownMotions()
        self.legs = scenario.task.legs
        self.stages: list[StageSection] = [stage for _, stage in self.legs]
        self.moving = [number for number, stage in enumerate(self.stages) if stage.moves]
        self._first = Cell.at_first(scenario, digits)
        self.stops = self._stops()
        self.edges = [self._edges(layer) for layer in range(len(self.moving))]
        self.bound = self._total(self.shortest([edges.bounds for edges in self.edges]))

    def label(self, layer: int) -> str:
        """The key of a stage that moves."""
        numbers, _ = self.legs[self.moving[layer]]
        return f"task.stages.{numbers[-1]}"

    def name(self, layer: int) -> str:
        """The name of a stage that moves, for people."""
        return self.task.labels[self.moving[layer]]

    def no_motion(self, layer: int, why: str) -> NoMotion:
        """The error of a stage for which no motion was found, with the reason if there is one."""
        reason = f"; {why}" if why else ""
        return NoMotion(f"{self.label(layer)}: no certified motion was found for {self.name(layer)}{reason}")

    def stage(self, layer: int) -> MovingStage:
        """A stage that moves."""
        stage = self.stages[self.moving[layer]]
        assert isinstance(stage, MovingStage)
        return stage

    def cell(self, layer: int, chain: Sequence[FloatArray]) -> Cell:
        """The cell before a stage that moves, after postures at the stops before."""
        first = self.moving[layer]
        postures = [chain[self._stop_before(number)] for number in range(first + 1)]
        _, cell = next(islice(walked(self.scenario, postures, self._first), first, None))
        return cell

    def _stop_before(self, number: int) -> int:
        """The number of the stop at which a stage begins, whether it moves or not."""
        return sum(moving < number for moving in self.moving)

    def robot(self, layer: int) -> Robot:
        """The robot of a stage that moves, with the limits that the stage has."""
        own = self.stage(layer).of_the_robot
        return self._first.robot if not own else self.scenario.robot_table.replaced(**own).build()

    def way(self, layer: int, pair: tuple[int, int]) -> ToolWay | None:
        """The way of the tool by which a stage leads from one posture to another; None where it moves freely."""
        return self.stops[layer + 1].ways[pair[1]]

    def postures(self, chain: Sequence[int]) -> list[FloatArray]:
        """The postures of a chain, one for each stop, (dof,)."""
        return [stop.postures[index] for stop, index in zip(self.stops, chain, strict=True)]

    @contextmanager
    def errors_of(self, layer: int) -> Iterator[None]:
        """Errors of what a stage states alone are of this sequence.

        Raises:
            ScenarioError: naming the stage.
        """
        try:
            yield
        except InvalidProblem as error:
            raise self._failure(layer, f"{error.field}: {error.reason}") from error
        except StageFailure as error:
            error.share = layer / len(self.moving)
            raise
        except ScenarioError as error:
            if str(error).startswith("task.stages"):
                raise
            raise self._failure(layer, str(error).removeprefix("task.")) from error

    def _failure(self, layer: int, reason: str) -> StageFailure:
        failure = StageFailure(f"{self.label(layer)}.{reason}")
        failure.share = layer / len(self.moving)
        return failure

    def _stops(self) -> list[SequenceStop]:
        """Postures to choose from, stop by stop."""
        stops: list[SequenceStop] = []
        cells = self._cells_along(stops)
        try:
            stops.append(self._first_stop())
        except InvalidProblem as error:
            raise ScenarioError(f"task.{error.field}: {error.reason}") from error
        for layer in range(len(self.moving)):
            tell_step("postures", layer, len(self.moving))
            with self.errors_of(layer):
                stops.append(self._stop_after(layer, next(cells), stops))
        return stops

    def _cells_along(self, stops: Sequence[SequenceStop]) -> Iterator[Cell]:
        """The cells before stages that move, after the first posture of each stop, which may be found meanwhile."""
        postures = (stops[self._stop_before(number)].postures[0] for number in range(len(self.stages)))
        for stage, cell in walked(self.scenario, postures, self._first):
            if stage.moves:
                yield cell

    def _first_stop(self) -> SequenceStop:
        """The clear postures at the start among what is around the first stage that moves, or those of an earlier plan.

        Raises:
            InvalidProblem: none is clear.
        """
        place, robot = self.task.start, self.scenario.model.kept_by(self._first.robot)
        found = self._earlier_at(robot, [place])
        if not found.size:
            found = postures_at(place, robot, (), "start")[:MOST_POSTURES]
            if not isinstance(place, Joints) and self.moving:
                scene = self.cell(0, [found[0]]).scene(self.stage(0))
                found = postures_at(place, scene.robot, scene.obstacles, "start")[:MOST_POSTURES]
        return SequenceStop.free(found)

    def _stop_after(self, layer: int, cell: Cell, stops: Sequence[SequenceStop]) -> SequenceStop:
        """The stop at which a stage may end.

        Raises:
            InvalidProblem: it cannot end anywhere, or not where a cycle has to.
        """
        stage, before = self.stage(layer), stops[-1]
        if isinstance(stage, LedStage):
            return self._led(layer, stage, cell, before)
        statement = cell.statement(stage, before.postures[0])
        scene = statement.built()
        assert isinstance(statement.task, PointToPointTask)
        move = statement.task.move(scene.robot, scene.obstacles)
        if self.task.cyclic and layer == len(self.moving) - 1:
            if not all(any(goal.is_at(scene.robot, theta) for goal in move.goals) for theta in stops[0].postures):
                raise InvalidProblem("goal", "is not where the sequence begins, as that of a cycle has to be")
            return SequenceStop.free(stops[0].postures)
        earlier = self._earlier_at(scene.robot, move.goals)
        if earlier.size:
            return SequenceStop.free(earlier, np.array([move.reached_goal(theta).cost for theta in earlier]))
        reached = reached_at(move.goals, scene.robot, scene.obstacles, "goal")
        return in_short_turns(move, reached, before.postures, soonest_at(scene.robot, stops))

    def _earlier_at(self, robot: Robot, goals: Sequence[Place]) -> FloatArray:
        """The postures of an earlier plan that are at any of the goals, (n, dof)."""
        known = self.known.postures
        return known[[any(goal.is_at(robot, theta) for goal in goals) for theta in known]]

    def _led(self, layer: int, stage: LedStage, cell: Cell, before: SequenceStop) -> SequenceStop:
        """The stop to which the tool is led, from each posture before; at postures of an earlier plan alone, if any.

        Raises:
            InvalidProblem: it can be led there from none of them.
            NoMotion: it can, but not so that it is clear.
        """
        led: list[tuple[FloatArray, int, ToolWay | None]] = []
        earlier: list[tuple[FloatArray, int, ToolWay | None]] = []
        known = [self.known.after(cell, stage, posture) for posture in before.postures]
        earlier += [(motion.goal, number, None) for number, motion in enumerate(known) if motion is not None]
        left = [number for number, motion in enumerate(known) if motion is None]
        found: list[FoundWays] = []
        if left:
            scene = cell.scene(stage)
            around = Surroundings(scene.robot, scene.obstacles)
            found = clear_ways(ways_from(stage, cell.robot, before.postures[left], around), around)
        for number, ways in zip(left, found, strict=True):
            for way in [] if isinstance(ways, InvalidProblem) else ways:
                same = self.known.earlier_posture(way.end)
                (led if same is None else earlier).append((way.end if same is None else same, number, way))
        if not led and not earlier:
            failures = [ways for ways in found if isinstance(ways, InvalidProblem)]
            touching = [failure for failure in failures if isinstance(failure, NotClear)]
            raise self.no_motion(layer, touching[0].reason_among(around)) if touching else failures[0]
        postures, parents, ways_there = zip(*(earlier or led), strict=True)
        return SequenceStop(np.array(postures), list(parents), list(ways_there)).limited()

    def _edges(self, layer: int) -> Edges:
        """Bounds of all motions of a stage."""
        before, after, robot = self.stops[layer], self.stops[layer + 1], self.robot(layer)
        bounds = bounds_between(robot, before.postures, after.postures)
        parents = np.array(after.parents)
        bounds[(parents >= 0) & (parents != np.arange(len(before.postures))[:, None])] = np.inf
        edges, stage = Edges(bounds, bounds.copy()), self.stage(layer)
        led = [(number, way) for number, way in enumerate(after.ways) if way is not None]
        if led:
            assert isinstance(stage, LedStage)
            numbers, ways = (list(each) for each in zip(*led, strict=True))
            edges.durations[parents[numbers], numbers] = least_times(ways, robot, stage.fastest_tool)
        return edges

    def shortest(self, costs: Sequence[FloatArray]) -> list[int] | None:
        """The postures of the shortest way, one for each stop; None where there is none.

        Args:
            costs: of the edges of each stage, (n, m), s.
        """
        found = shortest_way(costs, self.task.cyclic)
        return None if found is None else found[1]

    def known_chain(self, unknown: float) -> list[int] | None:
        """The postures of the way that takes least, with what is not planned needing so many times its bound."""
        stops = zip(self.edges, self.stops[1:], strict=True)
        return self.shortest([edges.known(unknown) + stop.costs for edges, stop in stops])

    def least_chain(self) -> list[int] | None:
        """The postures between which stages take least, along ways that are timed exactly; None where there is none."""
        while True:
            chain = self.shortest(
                [
                    np.where(self._estimated(layer), SURELY_LESS, 1.0) * edges.durations + self.stops[layer + 1].costs
                    for layer, edges in enumerate(self.edges)
                ]
            )
            if chain is None:
                return None
            timed = [self._time_exactly(layer, pair) for layer, pair in enumerate(pairwise(chain))]
            if not any(timed):
                return chain

    def _estimated(self, layer: int) -> NDArray[np.bool_]:
        """The postures after a stage to which a way leads whose time is not known exactly, (m,)."""
        return np.array([way is not None and not way.is_exact for way in self.stops[layer + 1].ways])

    def _time_exactly(self, layer: int, pair: tuple[int, int]) -> bool:
        """Time a way of the tool along its path, and those that are as long; whether that had not been done."""
        way, stage = self.way(layer, pair), self.stage(layer)
        if way is None or way.is_exact:
            return False
        assert isinstance(stage, LedStage)
        try:
            time = way.least_time(self.robot(layer), stage.fastest_tool)
        except InvalidProblem:
            time = np.inf
        edges, after = self.edges[layer], self.stops[layer + 1]
        for number, other in enumerate(after.ways):
            if other is not None and other.source is way.source:
                edges.durations[after.parents[number], number] = time
        return True

    def _total(self, chain: list[int] | None) -> float:
        """The least time of a chain of postures in free space with all waits, s."""
        if chain is None:
            return np.inf
        least = sum(edges.bounds[pair] for edges, pair in zip(self.edges, pairwise(chain), strict=True))
        return float(least) + self.waits

    @property
    def waits(self) -> float:
        """How long the arm stands in all, s."""
        return sum(stage.pause for stage in self.stages)

    def best_order(self) -> tuple[list[int], float]:
        """The best order of the visits, from 0 on, and a lower bound of any order's duration with all waits, s."""
        cyclic = self.task.cyclic
        robots = [self.robot(layer) for layer in range(len(self.moving))]
        found = self.stops[:-1] if cyclic else self.stops
        stops = [
            in_one_turn(robots[0], stop.postures)[:MOST_VISITED] if stop.any_turn else stop.postures[:MOST_VISITED]
            for stop in found
        ]
        postures = np.concatenate(stops)
        costs = [
            bounds_between(robot, postures, theta, stop.any_turn)
            for robot, theta, stop in zip(robots, stops[1:], found[1:], strict=False)
        ]
        back = bounds_between(robots[-1], postures, stops[0])
        visits = Visits(tuple(map(len, stops)), np.hstack([back, *costs]), cyclic)
        order, bound = visits.best_order()
        return [stop - 1 for stop in order], bound + self.waits
