"""Sequences: which posture to stop in, and a certified motion for every stage.

A stop leaves postures to choose. The stages are the edges of a graph whose nodes are postures; what an edge takes is
known when it is planned; before, it is at least what the slowest joint takes in free space, or along the path that the
joints have to follow. The shortest way through the graph is looked for again and again, and its first edge that is not
planned yet is planned, until all of it is (Dellin and Srinivasa, "A unifying formalism for shortest path problems with
expensive edge evaluations", 2016). Edges that are not planned are taken to need half a per cent more than at least: so
much may the sequence be above the graph's optimum, and of choices that are about as good one is planned.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import islice, pairwise
from typing import Any

import numpy as np

from problems import InvalidProblem, Problem, Robot, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from problems.motions import JointPath
from problems.tasks import Place, Surroundings
from problems.timing import least_along, retime, retime_below
from tpbso_casadi.planning.direct import directly, judged
from tpbso_casadi.planning.finishing import PlannedMotion
from tpbso_casadi.planning.motion import JudgedMotion
from tpbso_casadi.planning.planning import Planning
from tpbso_casadi.planning.stops import bounds_between, postures_at, ways_along
from tpbso_casadi.planning.visits import Visits, shortest_way
from tpbso_casadi.scenario import (
    ENDS,
    Cell,
    LedStage,
    MovingStage,
    Scenario,
    ScenarioError,
    SequenceTask,
    StageSection,
    judged_by_stage,
    walked,
)

LOG = logging.getLogger(__name__)
BOUND = "least_time"  # the quantity of a plan that says what its stages take at least, s
MOST_POSTURES = 12  # of a stop
EDGES_EACH = 8  # motions that are planned for each stage before the search turns to what it has
EXPECTED = 1.005  # times its bound is what a motion is taken to need that is not planned yet: in twelve cells ways of
# the tool need 1.0001 to 1.009 times as long as theirs, 1.004 in the median, and moves in free space as long as theirs
UNKNOWN = 3.0  # the same for other edges then


@dataclass(eq=False)
class SequenceStop:
    """Postures in which the arm may stand before the first stage, or after one.

    Attributes:
        postures: (n, dof), rad.
        parents: the posture of the stop before from which alone each is reached, (n,); -1 where from any.
        paths: of the joints that lead there, where they are known; else None.
    """

    postures: FloatArray
    parents: list[int]
    paths: list[JointPath | None]

    @classmethod
    def free(cls, postures: FloatArray) -> SequenceStop:
        """Postures that may be reached from anywhere."""
        return cls(postures, [-1] * len(postures), [None] * len(postures))

    def limited(self) -> SequenceStop:
        """The stop with the first posture from each parent, then the second ones, up to so many."""
        ranks = [self.parents[:number].count(parent) for number, parent in enumerate(self.parents)]
        kept = sorted(np.argsort(ranks, kind="stable")[:MOST_POSTURES].tolist())
        return SequenceStop(self.postures[kept], [self.parents[n] for n in kept], [self.paths[n] for n in kept])


@dataclass(eq=False)
class Edges:
    """The motions of one stage between the postures before it and those after.

    Attributes:
        bounds: what each takes at least in free space, (before, after), s; infinite where there is none.
        durations: of those that are planned; of others at least, along their path too; infinite where none was found.
        motions: those that are planned.
    """

    bounds: FloatArray
    durations: FloatArray
    motions: dict[tuple[int, int], Trajectory | None] = field(default_factory=dict)

    def known(self, unknown: float) -> FloatArray:
        """The durations, with what is not planned yet taken to need so many times as long; (before, after), s."""
        found = self.durations * unknown
        for pair in self.motions:
            found[pair] = self.durations[pair]
        return found


def planned_sequence(
    scenario: Scenario, planning: Planning, plan: Callable[[Scenario], PlannedMotion]
) -> PlannedMotion:
    """The plan of a sequence.

    Args:
        scenario: that states it.
        planning: of the whole.
        plan: of one move, whatever it takes.

    Raises:
        ScenarioError: a stage cannot be done, or no motion was found for one.
    """
    began = time.perf_counter()
    work, bound = SequencePlanner(scenario, planning, plan), 0.0
    if work.task.order == "free":
        order, bound = work.best_order()
        scenario = scenario.replaced(task=work.task.in_order(order))
        work = SequencePlanner(scenario, planning, plan)
    chain = work.best_chain()
    work.polish(chain)
    trajectory, ends = work.joined(chain)
    scenario = scenario.replaced(task=work.stated(chain))
    criteria = judged_by_stage(scenario, trajectory, ends)
    quantities = {ENDS: ends, BOUND: np.array([bound or work.bound])}
    motion = JudgedMotion(criteria, trajectory, quantities)
    return PlannedMotion(scenario=scenario, motion=motion, seconds_timed=time.perf_counter() - began)


class NoMotion(ScenarioError):
    """No certified motion was found for a stage, though nothing of it is known to be impossible."""


class SequencePlanner:
    """The graph of one sequence.

    Args:
        scenario: that states it.
        planning: of the whole.
        plan: of one move, where nothing is found without a search.
    """

    def __init__(self, scenario: Scenario, planning: Planning, plan: Callable[[Scenario], PlannedMotion]) -> None:
        assert isinstance(scenario.task, SequenceTask)
        self.scenario, self.planning, self.task, self._plan = scenario, planning, scenario.task, plan
        self.stages: list[StageSection] = [stage for _, stage in scenario.task.legs]
        self.moving = [number for number, stage in enumerate(self.stages) if stage.moves]
        self._motions: dict[tuple[str, bytes, bytes], Trajectory] = {}
        self._judged: dict[tuple[int, bytes], tuple[Cell, Criteria]] = {}  # of ways of the tool, by layer and start
        self._steady: dict[tuple[int, tuple[int, int]], LedStage] = {}  # with a tool's speed, by layer and postures
        self._broken: dict[int, str] = {}  # by layer, what the last motion along a way broke
        planning.progress.phase("postures")
        self.stops = self._stops()
        self.edges = [self._edges(layer) for layer in range(len(self.moving))]
        self.bound = self._total(self._shortest([edges.bounds for edges in self.edges]), bounds=True)

    def label(self, layer: int) -> str:
        """The key of a stage that moves."""
        numbers, _ = self.task.legs[self.moving[layer]]
        return f"task.stages.{numbers[-1]}"

    def _of_stage(self, layer: int, error: ScenarioError) -> ScenarioError:
        """An error of its scenario, with the stage's key before that of its task."""
        return ScenarioError(f"{self.label(layer)}.{str(error).removeprefix('task.')}")

    def stage(self, layer: int) -> MovingStage:
        """A stage that moves."""
        stage = self.stages[self.moving[layer]]
        assert isinstance(stage, MovingStage)
        return stage

    def _cell(self, layer: int, chain: Sequence[FloatArray]) -> Cell:
        """The cell before a stage that moves, after postures at the stops before."""
        first = self.moving[layer]
        postures = [chain[sum(m < number for m in self.moving)] for number in range(first + 1)]
        _, cell = next(islice(walked(self.scenario, np.array(postures)), first, None))
        return cell

    def _stops(self) -> list[SequenceStop]:
        """Postures to choose from, stop by stop."""
        try:
            cell = Cell.at_first(self.scenario)
            robot = self.scenario.model.kept_by(cell.robot)
            start = self._postures(robot, (), [self.task.start], None, "start")
        except InvalidProblem as error:
            raise ScenarioError(f"task.{error.field}: {error.reason}") from error
        stops = [SequenceStop.free(start)]
        for layer in range(len(self.moving)):
            try:
                stops.append(self._stop_after(layer, stops))
            except InvalidProblem as error:
                raise ScenarioError(f"{self.label(layer)}.{error.field}: {error.reason}") from error
            except ScenarioError as error:
                if str(error).startswith("task.stages"):
                    raise
                raise self._of_stage(layer, error) from error
        return stops

    def _stop_after(self, layer: int, stops: Sequence[SequenceStop]) -> SequenceStop:
        """The stop at which a stage may end."""
        stage, before = self.stage(layer), stops[-1]
        cell = self._cell(layer, [stop.postures[0] for stop in stops])
        if stage.tool_path(cell.robot, before.postures[0]) is not None:
            return self._led(layer, cell, before)
        statement = cell.statement(stage, before.postures[0])
        criteria = statement.judged()
        goals = list(criteria.task.goals)  # type: ignore[attr-defined]
        if self.task.cyclic and layer == len(self.moving) - 1:
            if not all(any(goal.is_at(criteria.robot, theta) for goal in goals) for theta in stops[0].postures):
                raise InvalidProblem("goal", "is not where the sequence begins, as that of a cycle has to be")
            return SequenceStop.free(stops[0].postures)
        found = self._postures(criteria.robot, criteria.obstacles, goals, before.postures, "goal")
        return SequenceStop.free(found)

    def _postures(
        self, robot: Robot, obstacles: Sequence[Any], goals: Sequence[Place], near: FloatArray | None, key: str
    ) -> FloatArray:
        """Postures at any of the goals, the soonest reached first, a limited number of them, (n, dof).

        Raises:
            InvalidProblem: there is none.
        """
        found: list[FloatArray] = []
        failures: list[InvalidProblem] = []
        for goal in goals:
            try:
                found.append(postures_at(goal, robot, obstacles, key))
            except InvalidProblem as error:
                failures.append(error)
        if not found:
            raise failures[0]
        postures = np.concatenate(found)
        if near is None:
            return postures[:MOST_POSTURES]
        soonest = bounds_between(robot, near, postures).min(axis=0)
        return np.asarray(postures[np.argsort(soonest, kind="stable")[:MOST_POSTURES]])

    def _led(self, layer: int, cell: Cell, before: SequenceStop) -> SequenceStop:
        """The stop to which the tool is led, from each posture before.

        Raises:
            InvalidProblem: from none of them.
        """
        stage, robot, found = self.stage(layer), cell.robot, SequenceStop(np.empty((0, cell.robot.dof)), [], [])
        failure: InvalidProblem | None = None
        around = cache(partial(self._around, layer, cell, before.postures[0]))
        for number, posture in enumerate(before.postures):
            way = stage.tool_path(robot, posture)
            assert way is not None
            try:
                paths = ways_along(way, robot, posture, stage, around)
            except InvalidProblem as error:
                failure = failure or error
                continue
            found.postures = np.concatenate([found.postures, *(path.at(path.breakpoints[-1:]) for path in paths)])
            found.parents += [number] * len(paths)
            found.paths += paths
        if not found.parents:
            assert failure is not None
            raise failure
        return found.limited()

    def _around(self, layer: int, cell: Cell, start: FloatArray) -> Surroundings:
        """The robot of a stage whose tool is led, with what it carries and keeps clear of."""
        criteria = self._along(layer, cell, start)
        return Surroundings(criteria.robot, criteria.obstacles)

    def _edges(self, layer: int) -> Edges:
        """Bounds of all motions of a stage."""
        before, after, robot = self.stops[layer], self.stops[layer + 1], self._robot(layer)
        bounds = bounds_between(robot, before.postures, after.postures)
        durations = bounds.copy()
        for number, (parent, path) in enumerate(zip(after.parents, after.paths, strict=True)):
            if path is not None:
                others = np.arange(len(before.postures)) != parent
                bounds[others, number] = durations[others, number] = np.inf
                durations[parent, number] = least_along(path, robot.limits)
        return Edges(bounds, durations)

    def _robot(self, layer: int) -> Robot:
        """The robot of a stage, with the limits that the stage has."""
        table = self.scenario.robot_table
        return table.replaced(**self.stage(layer).of_the_robot).build()

    def _shortest(self, costs: Sequence[FloatArray]) -> list[int] | None:
        """The postures of the shortest way, one for each stop; None where there is none."""
        found = shortest_way(costs, self.task.cyclic)
        return None if found is None else found[1]

    def _total(self, chain: list[int] | None, bounds: bool = False) -> float:
        """The duration of a chain of postures with all waits, s."""
        if chain is None:
            return np.inf
        waits = sum(stage.pause for stage in self.stages)
        tables = [edges.bounds if bounds else edges.durations for edges in self.edges]
        return waits + float(sum(table[pair] for table, pair in zip(tables, _pairs(chain), strict=True)))

    def best_order(self) -> tuple[list[int], float]:
        """The best order of the visits, from 0 on, and a lower bound of any order's duration with all waits, s."""
        cyclic = self.task.cyclic
        stops = self.stops[:-1] if cyclic else self.stops
        postures = np.concatenate([stop.postures for stop in stops])
        costs = [bounds_between(self._robot(layer), postures, stop.postures) for layer, stop in enumerate(stops[1:])]
        back = bounds_between(self._robot(len(self.moving) - 1), postures, stops[0].postures)
        visits = Visits(tuple(len(stop.postures) for stop in stops), np.hstack([back, *costs]), cyclic)
        order, bound = visits.best_order()
        return [stop - 1 for stop in order], bound + sum(stage.pause for stage in self.stages)

    def best_chain(self) -> list[int]:
        """The postures of the fastest sequence that was found, one for each stop.

        Raises:
            ScenarioError: no motion was found for a stage.
        """
        budget, unknown, thorough = EDGES_EACH * len(self.moving), EXPECTED, False
        while True:
            chain = self._shortest([edges.known(unknown) for edges in self.edges])
            if chain is None and not thorough:
                thorough = True
                self._forget_failures()
                continue
            if chain is None:
                layer = next((n for n, edges in enumerate(self.edges) if not np.isfinite(edges.durations).any()), 0)
                what = self.task.labels[self.moving[layer]]
                why = f"; {self._broken[layer]}" if layer in self._broken else ""
                raise NoMotion(f"{self.label(layer)}: no certified motion was found for {what}{why}")
            pairs = _pairs(chain)
            layer = next((n for n, pair in enumerate(pairs) if pair not in self.edges[n].motions), -1)
            if layer < 0:
                return chain
            self._evaluate(layer, chain, thorough)
            budget -= 1
            if budget <= 0 or self.planning.running_out():
                unknown = UNKNOWN

    def _forget_failures(self) -> None:
        """So that they are tried again."""
        for edges in self.edges:
            for pair in [pair for pair, motion in edges.motions.items() if motion is None]:
                del edges.motions[pair]
                edges.durations[pair] = edges.bounds[pair]

    def _evaluate(self, layer: int, chain: Sequence[int], thorough: bool) -> None:
        """Plan a stage between two postures."""
        number = self.moving[layer]
        self.planning.progress.phase(self.task.labels[number])
        postures = [stop.postures[index] for stop, index in zip(self.stops, chain, strict=True)]
        pair, edges = _pairs(chain)[layer], self.edges[layer]
        cell, path = self._cell(layer, postures), self.stops[layer + 1].paths[pair[1]]
        stage, start, goal = self.stage(layer), postures[layer], postures[layer + 1]
        try:
            if path is not None:
                motion = self._timed(layer, pair, cell, start, path)
            else:
                motion = self._moved(cell.statement(stage, start, goal), start, goal, thorough)
        except InvalidProblem as error:
            raise ScenarioError(f"{self.label(layer)}.{error.field}: {error.reason}") from error
        except ScenarioError as error:
            raise self._of_stage(layer, error) from error
        edges.motions[pair] = motion
        edges.durations[pair] = np.inf if motion is None else motion.duration
        LOG.info("%s: %s", self.task.labels[number], "none" if motion is None else f"{motion.duration:.4f} s")

    def _moved(self, statement: Scenario, start: FloatArray, goal: FloatArray, thorough: bool) -> Trajectory | None:
        """A certified move between two postures: a known one the other way round, where that keeps all limits."""
        content = statement.replaced(task=statement.task.replaced(start=None, goal=None)).as_text()
        known = self._motions.get((content, goal.tobytes(), start.tobytes()))
        if known is not None:
            motion = JudgedMotion(statement.judged(), known.reversed(), {})
            if motion.feasible:
                return motion.trajectory
        found = self._planned(statement, thorough)
        if found is not None:
            self._motions[content, start.tobytes(), goal.tobytes()] = found
        return found

    def _planned(self, statement: Scenario, thorough: bool) -> Trajectory | None:
        solver = statement.solver.build()
        if statement.solver.is_direct and not thorough:
            problem = statement.problem()
            planning = replace(self.planning, scenario=statement, solver=solver, settings=statement.solver)
            found = directly(problem, planning)
            return None if found is None else found.trajectory
        planned = self._plan(statement)
        return planned.trajectory if planned.feasible else None

    def _along(self, layer: int, cell: Cell, start: FloatArray) -> Criteria:
        """The criteria of a way of the tool from a posture (dof,), made once for each cell."""
        known = self._judged.get((layer, start.tobytes()))
        if known is not None and (known[0].obstacles, known[0].carried) == (cell.obstacles, cell.carried):
            return known[1]
        criteria = cell.statement(self.stage(layer), start).judged()
        self._judged[layer, start.tobytes()] = cell, criteria
        return criteria

    def _timed(
        self, layer: int, pair: tuple[int, int], cell: Cell, start: FloatArray, path: JointPath
    ) -> Trajectory | None:
        """The least-time motion along a path that a stage's tool follows; None where it is not certified."""
        stage, criteria = self.stage(layer), self._along(layer, cell, start)
        assert isinstance(stage, LedStage)
        robot = criteria.robot
        if stage.fastest_tool is None:
            timed = retime(path, robot.limits, chain=robot.rigid_chain)
        else:
            timed = retime_below(path, robot, stage.fastest_tool)
        if stage.tool_speed is not None:
            stage, broken = stage.with_speed_of(timed, robot, start)
            if broken is not None:
                self._broken[layer] = broken
                return None
            self._steady[layer, pair] = stage
            criteria = cell.statement(stage, start).judged()
        motion = judged(criteria, timed)
        if motion.feasible:
            return motion.trajectory
        verdict = next(verdict for verdict in motion.verdicts if not verdict.satisfied)
        limit = f"{verdict.bound:.4g} {verdict.unit}"
        self._broken[layer] = f"{verdict.name} {verdict.worst:.4g} where {limit} is the limit, {verdict.where}"
        return None

    def stated(self, chain: Sequence[int]) -> SequenceTask:
        """The task, which says where steady speeds of the tool are kept along the ways of a chain."""
        stages = list(self.task.stages)
        for layer, pair in enumerate(_pairs(chain)):
            if (layer, pair) in self._steady:
                stages[self.task.legs[self.moving[layer]][0][-1]] = self._steady[layer, pair]
        return self.task.replaced(stages=stages)

    def polish(self, chain: Sequence[int]) -> None:
        """Make the ways of the tool faster within their accuracy, as long as that is worth it and there is time."""
        postures = [stop.postures[index] for stop, index in zip(self.stops, chain, strict=True)]
        for layer, pair in enumerate(_pairs(chain)):
            motion = self.edges[layer].motions[pair]
            if motion is None or (layer, pair) in self._steady or self.stops[layer + 1].paths[pair[1]] is None:
                continue
            if self.planning.running_out():
                return
            self.planning.progress.phase(f"{self.task.labels[self.moving[layer]]}, within its accuracy")
            stage, cell = self.stage(layer), self._cell(layer, postures)
            problem = cell.statement(stage, postures[layer], postures[layer + 1]).problem()
            faster = _polished(problem, self._along(layer, cell, postures[layer]), motion)
            self.edges[layer].motions[pair] = faster or motion

    def joined(self, chain: Sequence[int]) -> tuple[Trajectory, FloatArray]:
        """The motion of all stages, and when each of them ends, (n,), s."""
        parts: list[Trajectory] = []
        ends: list[float] = []
        layer, posture = 0, self.stops[0].postures[chain[0]]
        for stage in self.stages:
            part = None
            if stage.moves:
                part = self.edges[layer].motions[_pairs(chain)[layer]]
                layer += 1
                posture = self.stops[layer].postures[chain[layer]]
            elif stage.pause:
                part = Trajectory.standing(posture, stage.pause)
            if part is not None:
                parts.append(part)
            ends.append(sum(each.duration for each in parts))
        whole = parts[0]
        for part in parts[1:]:
            whole = whole.followed_by(part)
        return whole, np.array(ends)


def _polished(problem: Problem[Any], criteria: Criteria, motion: Trajectory) -> Trajectory | None:
    """The first certified motion that programs make of one, if it is faster; else None."""
    with suppress(InvalidProblem):
        tried = (judged(criteria, trajectory) for trajectory in problem.direct.polished(motion))
        found = next((other.trajectory for other in tried if other.feasible), motion)
        return found if found.duration < motion.duration else None
    return None


def _pairs(chain: Sequence[int]) -> list[tuple[int, int]]:
    return list(pairwise(chain))
