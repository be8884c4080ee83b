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
from dataclasses import replace
from functools import cache, partial
from itertools import islice, pairwise
from typing import cast

import numpy as np

from problems import InvalidProblem, Robot, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray, tell_step
from problems.motions import JointPath
from problems.tasks import Joints, Move, Place, Surroundings
from problems.timing import least_along, least_below, retime, retime_below
from tpbso_casadi.planning.direct import directly, judged, polished
from tpbso_casadi.planning.finishing import PlannedMotion
from tpbso_casadi.planning.known_motions import EarlierMotion, KnownMotions, scene_of
from tpbso_casadi.planning.motion import JudgedMotion
from tpbso_casadi.planning.planning import Planning
from tpbso_casadi.planning.stops import (
    MOST_POSTURES,
    Edges,
    SequenceStop,
    WaysInTurns,
    bounds_between,
    in_one_turn,
    in_short_turns,
    postures_at,
    reached_at,
    soonest_at,
    ways_along,
)
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
MOST_VISITED = 12  # postures of a stop, in any turn, where the order is free: its search takes the square of them
EDGES_EACH = 8  # motions that are planned for each stage before the search turns to what it has
EXPECTED = 1.005  # times its bound is what a motion is taken to need that is not planned yet: in twelve cells ways of
# the tool need 1.0001 to 1.009 times as long as theirs, 1.004 in the median, and moves in free space as long as theirs
ABOUT_AS_SOON = 1.1  # times the duration of the last way: other ends that are tried
UNKNOWN = 3.0  # the same for other edges then


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
    began, earlier = time.perf_counter(), planning.warm_start
    if earlier is None:
        return replace(_planned(scenario, planning, plan, KnownMotions(), began), kept=None)
    known = KnownMotions.of(scenario, EarlierMotion.of(earlier) if isinstance(earlier, PlannedMotion) else earlier)
    if known.postures.size:
        with suppress(ScenarioError):  # which is raised again where other postures do not help
            found = _planned(scenario, planning, plan, known, began)
            if found.feasible:
                return found
    return _planned(scenario, planning, plan, KnownMotions(), began)


def _planned(
    scenario: Scenario,
    planning: Planning,
    plan: Callable[[Scenario], PlannedMotion],
    known: KnownMotions,
    began: float,
) -> PlannedMotion:
    """The plan of a sequence, some motions of which are known already."""
    work, bound = SequencePlanner(scenario, planning, plan, known), 0.0
    if work.task.order == "free":
        order, bound = work.best_order()
        scenario = scenario.replaced(task=work.task.in_order(order))
        work = SequencePlanner(scenario, planning, plan, known)
    chain: Sequence[int] = work.best_chain()
    chain = work.polish(chain)
    trajectory, ends = work.joined(chain)
    scenario = scenario.replaced(task=work.stated(chain))
    criteria = judged_by_stage(scenario, trajectory, ends)
    quantities = {ENDS: ends, BOUND: np.array([bound or work.bound])}
    motion = JudgedMotion(criteria, trajectory, quantities)
    return PlannedMotion(
        scenario=scenario, motion=motion, seconds_timed=time.perf_counter() - began, kept=work.kept(chain)
    )


class NoMotion(ScenarioError):
    """No certified motion was found for a stage, though nothing of it is known to be impossible."""


class SequencePlanner:
    """The graph of one sequence.

    Args:
        scenario: that states it.
        planning: of the whole.
        plan: of one move, where nothing is found without a search.
        known: motions that are planned already, of an earlier plan too, whose postures are preferred then.
    """

    def __init__(
        self,
        scenario: Scenario,
        planning: Planning,
        plan: Callable[[Scenario], PlannedMotion],
        known: KnownMotions | None = None,
    ) -> None:
        assert isinstance(scenario.task, SequenceTask)
        self.scenario, self.planning, self.task, self._plan = scenario, planning, scenario.task, plan
        self.stages: list[StageSection] = [stage for _, stage in scenario.task.legs]
        self.moving = [number for number, stage in enumerate(self.stages) if stage.moves]
        self._known = known or KnownMotions()
        self._judged: dict[tuple[int, bytes], tuple[Cell, Criteria]] = {}  # of ways of the tool, by layer and start
        self._steady: dict[tuple[int, tuple[int, int]], MovingStage] = {}  # with a tool's speed, by layer and postures
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
            start = self._earlier_at(robot, [self.task.start])
            if not start.size:
                start = self._starts(postures_at(self.task.start, robot, (), "start"))[:MOST_POSTURES]
        except InvalidProblem as error:
            raise ScenarioError(f"task.{error.field}: {error.reason}") from error
        stops = [SequenceStop.free(start)]
        for layer in range(len(self.moving)):
            tell_step("postures", layer, len(self.moving))
            try:
                stops.append(self._stop_after(layer, stops))
            except InvalidProblem as error:
                raise ScenarioError(f"{self.label(layer)}.{error.field}: {error.reason}") from error
            except ScenarioError as error:
                if str(error).startswith("task.stages"):
                    raise
                raise self._of_stage(layer, error) from error
        return stops

    def _starts(self, postures: FloatArray) -> FloatArray:
        """The clear postures at the start among what is around the first stage that moves, (n, dof), of any of them.

        Raises:
            InvalidProblem: none is clear.
        """
        place = self.task.start
        if isinstance(place, Joints) or not self.moving:
            return postures
        first = self._cell(0, [postures[0]]).statement(self.stage(0), postures[0]).built()
        return postures_at(place, first.robot, first.obstacles, "start")

    def _stop_after(self, layer: int, stops: Sequence[SequenceStop]) -> SequenceStop:
        """The stop at which a stage may end."""
        stage, before = self.stage(layer), stops[-1]
        cell = self._cell(layer, [stop.postures[0] for stop in stops])
        if stage.tool_path(cell.robot, before.postures[0]) is not None:
            return self._led(layer, cell, before)
        criteria = cell.statement(stage, before.postures[0]).judged()
        robot, move = criteria.robot, cast(Move, criteria.task)
        if self.task.cyclic and layer == len(self.moving) - 1:
            if not all(any(goal.is_at(robot, theta) for goal in move.goals) for theta in stops[0].postures):
                raise InvalidProblem("goal", "is not where the sequence begins, as that of a cycle has to be")
            return SequenceStop.free(stops[0].postures)
        earlier = self._earlier_at(robot, move.goals)
        if earlier.size:
            return SequenceStop.free(earlier, np.array([move.reached_goal(theta).cost for theta in earlier]))
        reached = reached_at(move.goals, robot, criteria.obstacles, "goal")
        return in_short_turns(move, reached, before.postures, soonest_at(robot, stops))

    def _earlier_at(self, robot: Robot, goals: Sequence[Place]) -> FloatArray:
        """The postures of an earlier plan that are at any of the goals, (n, dof)."""
        return self._known.postures[[any(goal.is_at(robot, theta) for goal in goals) for theta in self._known.postures]]

    def _led(self, layer: int, cell: Cell, before: SequenceStop) -> SequenceStop:
        """The stop to which the tool is led, from each posture before; at postures of an earlier plan alone, if any.

        Raises:
            InvalidProblem: from none of them.
        """
        stage, robot = self.stage(layer), cell.robot
        failure: InvalidProblem | None = None
        led: list[tuple[FloatArray, int, JointPath | None]] = []
        earlier: list[tuple[FloatArray, int, JointPath | None]] = []
        around = cache(partial(self._around, layer, cell, before.postures[0]))

        def found(posture: FloatArray) -> list[JointPath]:
            way = stage.tool_path(robot, posture)
            assert way is not None
            return ways_along(way, robot, posture, stage, around)

        ways_from = WaysInTurns(robot, found)
        for number, posture in enumerate(before.postures):
            known = self._known.after(cell, stage, posture)
            if known is not None:
                earlier.append((known.goal, number, None))
                continue
            try:
                paths = ways_from(posture)
            except InvalidProblem as error:
                failure = failure or error
                continue
            for path in paths:
                (end,) = path.at(path.breakpoints[-1:])
                same = self._known.earlier_posture(end)
                (led if same is None else earlier).append((end if same is None else same, number, path))
        if not led and not earlier:
            assert failure is not None
            raise failure
        postures, parents, ways = zip(*(earlier or led), strict=True)
        return SequenceStop(np.array(postures), list(parents), list(ways)).limited()

    def _around(self, layer: int, cell: Cell, start: FloatArray) -> Surroundings:
        """The robot of a stage whose tool is led, with what it carries and keeps clear of."""
        criteria = self._along(layer, cell, start)
        return Surroundings(criteria.robot, criteria.obstacles)

    def _edges(self, layer: int) -> Edges:
        """Bounds of all motions of a stage."""
        before, after, robot = self.stops[layer], self.stops[layer + 1], self._robot(layer)
        bounds = bounds_between(robot, before.postures, after.postures)
        durations, known = bounds.copy(), dict[bytes, float]()  # of paths that are the same but for where they begin
        for number, (parent, path) in enumerate(zip(after.parents, after.paths, strict=True)):
            if parent >= 0:
                others = np.arange(len(before.postures)) != parent
                bounds[others, number] = durations[others, number] = np.inf
            if path is not None:
                shape = path.breakpoints.tobytes() + path.coefficients[:-1].tobytes()
                if shape not in known:
                    known[shape] = self._least_led(layer, path, robot)
                durations[parent, number] = known[shape]
        return Edges(bounds, durations)

    def _least_led(self, layer: int, path: JointPath, robot: Robot) -> float:
        """The least time along a path that a stage's tool follows, s."""
        stage = self.stage(layer)
        assert isinstance(stage, LedStage)
        if stage.fastest_tool is None:
            return least_along(path, robot.limits)
        return least_below(path, robot, stage.fastest_tool)

    def _robot(self, layer: int) -> Robot:
        """The robot of a stage, with the limits that the stage has."""
        table = self.scenario.robot_table
        return table.replaced(**self.stage(layer).of_the_robot).build()

    def _shortest(self, costs: Sequence[FloatArray]) -> list[int] | None:
        """The postures of the shortest way, one for each stop; None where there is none."""
        found = shortest_way(costs, self.task.cyclic)
        return None if found is None else found[1]

    def least_chain(self) -> list[int] | None:
        """The postures between which stages take least by what is known of them; None where there is no way."""
        stops = zip(self.edges, self.stops[1:], strict=True)
        return self._shortest([edges.durations + stop.costs for edges, stop in stops])

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
        robots = [self._robot(layer) for layer in range(len(self.moving))]
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
        return [stop - 1 for stop in order], bound + sum(stage.pause for stage in self.stages)

    def best_chain(self) -> list[int]:
        """The postures of the fastest sequence that was found, one for each stop.

        Raises:
            ScenarioError: no motion was found for a stage.
        """
        budget, unknown, thorough = EDGES_EACH * len(self.moving), EXPECTED, False
        while True:
            stops = zip(self.edges, self.stops[1:], strict=True)
            chain = self._shortest([edges.known(unknown) + stop.costs for edges, stop in stops])
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
        known = self._known.between(cell, stage, start, goal)
        try:
            serving = None if known is None else known.serving(cell, stage, EXPECTED * edges.bounds[pair])
            if known is not None and serving is not None:
                motion: Trajectory | None = known.trajectory
                edges.kept |= {pair} if known.is_earlier else set()
                self._steady |= {(layer, pair): serving} if serving is not stage else {}
            elif path is not None:
                motion = self._timed(layer, pair, cell, start, path)
            elif isinstance(stage, LedStage):
                motion = None  # another plan led the tool there, in another scene
            else:
                motion = self._moved(cell, stage, (start, goal), thorough)
        except InvalidProblem as error:
            raise ScenarioError(f"{self.label(layer)}.{error.field}: {error.reason}") from error
        except ScenarioError as error:
            raise self._of_stage(layer, error) from error
        edges.motions[pair] = motion
        edges.durations[pair] = np.inf if motion is None else motion.duration
        LOG.info("%s: %s", self.task.labels[number], "none" if motion is None else f"{motion.duration:.4f} s")

    def _moved(
        self, cell: Cell, stage: MovingStage, ends: tuple[FloatArray, FloatArray], thorough: bool
    ) -> Trajectory | None:
        """A certified move between two postures: a known one the other way round, where that keeps all limits."""
        statement, known = cell.statement(stage, *ends), self._known.between(cell, stage, *ends[::-1])
        if known is not None and known.scene == scene_of(cell):
            motion = JudgedMotion(statement.judged(), known.trajectory.reversed(), {})
            if motion.feasible:
                return motion.trajectory
        found = self._planned(statement, thorough)
        if found is not None:
            self._known.keep(cell, stage, ends, found)
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

    def polish(self, chain: Sequence[int]) -> Sequence[int]:
        """The chain, with ways of the tool made faster within their accuracy, as long as there is time.

        Of ends of the last way that are reached about as soon, the one is taken that then is the soonest.
        """
        for layer in range(len(self.moving)):
            self._polish_way(layer, chain)
        *before, parent, end = chain
        edges, last, durations = self.edges[-1], len(self.moving) - 1, self.edges[-1].durations[parent]
        if self.stops[-1].paths[end] is None:
            return chain
        for other in np.flatnonzero(durations <= ABOUT_AS_SOON * durations[end]).tolist():
            if other != end and not self.planning.running_out():
                if (parent, other) not in edges.motions:
                    self._evaluate(last, [*before, parent, other], thorough=False)
                self._polish_way(last, [*before, parent, other])
        found = {at: motion.duration for (one, at), motion in edges.motions.items() if one == parent and motion}
        return [*before, parent, min(found, key=found.__getitem__)]

    def _polish_way(self, layer: int, chain: Sequence[int]) -> None:
        """Make a motion of a chain faster within its accuracy, where the tool is led and there is time."""
        pair, edges = _pairs(chain)[layer], self.edges[layer]
        motion = edges.motions[pair]
        if motion is None or (layer, pair) in self._steady or self.stops[layer + 1].paths[pair[1]] is None:
            return
        if self.planning.running_out():
            return
        self.planning.progress.phase(f"{self.task.labels[self.moving[layer]]}, within its accuracy")
        postures = [stop.postures[index] for stop, index in zip(self.stops, chain, strict=True)]
        stage, cell = self.stage(layer), self._cell(layer, postures)
        problem = cell.statement(stage, postures[layer], postures[layer + 1]).problem()
        criteria, is_enough = self._along(layer, cell, postures[layer]), self.planning.satisfied
        edges.motions[pair] = polished(problem, criteria, motion, is_enough) or motion

    def kept(self, chain: Sequence[int]) -> int:
        """How many motions of a chain are those of the earlier plan."""
        return sum(pair in edges.kept for edges, pair in zip(self.edges, _pairs(chain), strict=True))

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


def _pairs(chain: Sequence[int]) -> list[tuple[int, int]]:
    return list(pairwise(chain))
