"""The least time that a sequence takes between its postures, without planning its motions."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.planning.sequence_graph import SequenceGraph
from tpbso_casadi.scenario import Scenario, ScenarioError, SequenceTask


@dataclass(frozen=True, eq=False)
class SequenceBound:
    """The least time of a sequence: moves in free space, and ways of the tool as fast as joints may go along them.

    No plan between the postures that were looked at takes less, but for what it gains where it leaves a way of the tool
    as far as its accuracy allows: 3 % at most in the cells that were measured. Contacts on the way are not looked at.

    Attributes:
        seconds: of all stages with their waits; infinite where there is no way.
        stages: the name of each stage that moves, and its time, s.
        postures: at the start and after each of these, (n + 1, dof), rad or m; none where there is no way.
        why: the reason where there is no way; else empty.
    """

    seconds: float
    stages: tuple[tuple[str, float], ...]
    postures: FloatArray
    why: str = ""

    def __repr__(self) -> str:
        found = f"at least {self.seconds:.6g} s in {len(self.stages)} stages"
        return f"<no way: {self.why}>" if self.why else f"<{found}>"


def sequence_bound(scenario: Scenario) -> SequenceBound:
    """The bound of a sequence, in its best order where that is free.

    Args:
        scenario: that states it.

    Raises:
        ScenarioError: it states no sequence.
    """
    if not isinstance(scenario.task, SequenceTask):
        raise ScenarioError('task.kind: a bound is of a "sequence"')
    try:
        graph = SequenceGraph(scenario)
        if scenario.task.order == "free":
            graph = SequenceGraph(scenario.replaced(task=scenario.task.in_order(graph.best_order()[0])))
    except ScenarioError as error:
        return SequenceBound(np.inf, (), np.empty((0, 0)), str(error))
    chain = graph.least_chain()
    if chain is None:
        return SequenceBound(np.inf, (), np.empty((0, 0)), "no way leads from stop to stop")
    times = [float(edges.durations[pair]) for edges, pair in zip(graph.edges, pairwise(chain), strict=True)]
    labels = scenario.task.labels
    stages = tuple(zip([labels[number] for number in graph.moving], times, strict=True))
    return SequenceBound(sum(times) + graph.waits, stages, np.array(graph.postures(chain)))
