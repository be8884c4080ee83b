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
from itertools import pairwise

import numpy as np

from problems import InvalidProblem, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from problems.timing import retime, retime_below
from tpbso_casadi.planning.direct import directly, judged, polished
from tpbso_casadi.planning.finishing import PlannedMotion
from tpbso_casadi.planning.known_motions import EarlierMotion, KnownMotions, scene_of
from tpbso_casadi.planning.motion import JudgedMotion
from tpbso_casadi.planning.planning import Planning
from tpbso_casadi.planning.sequence_graph import SequenceGraph
from tpbso_casadi.planning.ways import ToolWay
from tpbso_casadi.scenario import (
    ENDS,
    Cell,
    LedStage,
    MovingStage,
    Scenario,
    ScenarioError,
    SequenceTask,
    judged_by_stage,
)

LOG = logging.getLogger(__name__)
BOUND = "least_time"  # the quantity of a plan that says what its stages take at least, s
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
    if work.graph.task.order == "free":
        order, bound = work.graph.best_order()
        scenario = scenario.replaced(task=work.graph.task.in_order(order))
        work = SequencePlanner(scenario, planning, plan, known)
    chain: Sequence[int] = work.best_chain()
    chain = work.polish(chain)
    trajectory, ends = work.joined(chain)
    scenario = scenario.replaced(task=work.stated(chain))
    criteria = judged_by_stage(scenario, trajectory, ends)
    quantities = {ENDS: ends, BOUND: np.array([bound or work.graph.bound])}
    motion = JudgedMotion(criteria, trajectory, quantities)
    return PlannedMotion(
        scenario=scenario, motion=motion, seconds_timed=time.perf_counter() - began, kept=work.kept(chain)
    )


class SequencePlanner:
    """The motions of one sequence, planned along the shortest ways through its graph.

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
        planning.progress.phase("postures")
        self.graph = SequenceGraph(scenario, known)
        self.planning, self._plan, self._known = planning, plan, self.graph.known
        self._judged: dict[tuple[int, bytes], tuple[Cell, Criteria]] = {}  # of ways of the tool, by layer and start
        self._steady: dict[tuple[int, tuple[int, int]], MovingStage] = {}  # with a tool's speed, by layer and postures
        self._broken: dict[int, str] = {}  # by layer, what the last motion along a way broke

    def best_chain(self) -> list[int]:
        """The postures of the fastest sequence that was found, one for each stop.

        Raises:
            ScenarioError: no motion was found for a stage.
        """
        graph, unknown, thorough = self.graph, EXPECTED, False
        budget = EDGES_EACH * len(graph.moving)
        while True:
            chain = graph.known_chain(unknown)
            if chain is None and not thorough:
                thorough = True
                self._forget_failures()
                continue
            if chain is None:
                layer = next((n for n, edges in enumerate(graph.edges) if not np.isfinite(edges.durations).any()), 0)
                raise graph.no_motion(layer, self._broken.get(layer, ""))
            pairs = _pairs(chain)
            layer = next((n for n, pair in enumerate(pairs) if pair not in graph.edges[n].motions), -1)
            if layer < 0:
                return chain
            self._evaluate(layer, chain, thorough)
            budget -= 1
            if budget <= 0 or self.planning.running_out():
                unknown = UNKNOWN

    def _forget_failures(self) -> None:
        """So that they are tried again."""
        for edges in self.graph.edges:
            for pair in [pair for pair, motion in edges.motions.items() if motion is None]:
                del edges.motions[pair]
                edges.durations[pair] = edges.bounds[pair]

    def _evaluate(self, layer: int, chain: Sequence[int], thorough: bool) -> None:
        """Plan a stage between two postures."""
        graph, name = self.graph, self.graph.name(layer)
        self.planning.progress.phase(name)
        postures, pair, edges = graph.postures(chain), _pairs(chain)[layer], graph.edges[layer]
        cell, way, stage = graph.cell(layer, postures), graph.way(layer, pair), graph.stage(layer)
        start, goal = postures[layer], postures[layer + 1]
        known = self._known.between(cell, stage, start, goal)
        with graph.errors_of(layer):
            serving = None if known is None else known.serving(cell, stage, EXPECTED * edges.bounds[pair])
            if known is not None and serving is not None:
                motion: Trajectory | None = known.trajectory
                edges.kept |= {pair} if known.is_earlier else set()
                self._steady |= {(layer, pair): serving} if serving is not stage else {}
            elif way is not None:
                motion = self._timed(layer, pair, cell, start, way)
            elif isinstance(stage, LedStage):
                motion = None  # another plan led the tool there, in another scene
            else:
                motion = self._moved(cell, stage, (start, goal), thorough)
        edges.motions[pair] = motion
        edges.durations[pair] = np.inf if motion is None else motion.duration
        LOG.info("%s: %s", name, "none" if motion is None else f"{motion.duration:.4f} s")

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
        criteria = cell.statement(self.graph.stage(layer), start).judged()
        self._judged[layer, start.tobytes()] = cell, criteria
        return criteria

    def _timed(
        self, layer: int, pair: tuple[int, int], cell: Cell, start: FloatArray, way: ToolWay
    ) -> Trajectory | None:
        """The least-time motion along a way that a stage's tool follows; None where it is not certified."""
        try:
            path = way.path
        except InvalidProblem as error:
            self._broken[layer] = error.reason
            return None
        stage, criteria = self.graph.stage(layer), self._along(layer, cell, start)
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
        graph = self.graph
        stages = list(graph.task.stages)
        for layer, pair in enumerate(_pairs(chain)):
            if (layer, pair) in self._steady:
                stages[graph.legs[graph.moving[layer]][0][-1]] = self._steady[layer, pair]
        return graph.task.replaced(stages=stages)

    def polish(self, chain: Sequence[int]) -> Sequence[int]:
        """The chain, with ways of the tool made faster within their accuracy, as long as there is time.

        Of ends of the last way that are reached about as soon, the one is taken that then is the soonest.
        """
        for layer in range(len(self.graph.moving)):
            self._polish_way(layer, chain)
        *before, parent, end = chain
        edges, last = self.graph.edges[-1], len(self.graph.moving) - 1
        durations = edges.durations[parent]
        if self.graph.way(last, (parent, end)) is None:
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
        graph, pair = self.graph, _pairs(chain)[layer]
        edges = graph.edges[layer]
        motion = edges.motions[pair]
        if motion is None or (layer, pair) in self._steady or graph.way(layer, pair) is None:
            return
        if self.planning.running_out():
            return
        self.planning.progress.phase(f"{graph.name(layer)}, within its accuracy")
        postures = graph.postures(chain)
        stage, cell = graph.stage(layer), graph.cell(layer, postures)
        problem = cell.statement(stage, postures[layer], postures[layer + 1]).problem()
        criteria, is_enough = self._along(layer, cell, postures[layer]), self.planning.satisfied
        edges.motions[pair] = polished(problem, criteria, motion, is_enough) or motion

    def kept(self, chain: Sequence[int]) -> int:
        """How many motions of a chain are those of the earlier plan."""
        return sum(pair in edges.kept for edges, pair in zip(self.graph.edges, _pairs(chain), strict=True))

    def joined(self, chain: Sequence[int]) -> tuple[Trajectory, FloatArray]:
        """The motion of all stages, and when each of them ends, (n,), s."""
        parts: list[Trajectory] = []
        ends: list[float] = []
        graph, layer, postures = self.graph, 0, self.graph.postures(chain)
        for stage in graph.stages:
            part = None
            if stage.moves:
                part = graph.edges[layer].motions[_pairs(chain)[layer]]
                layer += 1
            elif stage.pause:
                part = Trajectory.standing(postures[layer], stage.pause)
            if part is not None:
                parts.append(part)
            ends.append(sum(each.duration for each in parts))
        whole = parts[0]
        for part in parts[1:]:
            whole = whole.followed_by(part)
        return whole, np.array(ends)


def _pairs(chain: Sequence[int]) -> list[tuple[int, int]]:
    return list(pairwise(chain))
