"""The least time that a sequence takes between its postures, without planning its motions."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.planning.finishing import PlannedMotion
from tpbso_casadi.planning.planning import Planning
from tpbso_casadi.planning.sequence import SequencePlanner
from tpbso_casadi.scenario import Scenario, ScenarioError, SequenceTask


@dataclass(frozen=True, eq=False)
class SequenceBound:
    """The least time of a sequence: moves in free space, and ways of the tool as fast as joints may go along them.

    No plan between the postures that were looked at takes less, but for what it gains where it leaves a way of the tool
    as far as its accuracy allows: 1 % at most in the cells that were measured. Contacts on the way are not looked at.

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


def sequence_bound(scenario: Scenario, planning: Planning) -> SequenceBound:
    """The bound of a sequence, in its best order where that is free.

    Args:
        scenario: that states it.
        planning: of the whole, of which nothing is planned.

    Raises:
        ScenarioError: it states no sequence.
    """
    if not isinstance(scenario.task, SequenceTask):
        raise ScenarioError('task.kind: a bound is of a "sequence"')
    try:
        work = SequencePlanner(scenario, planning, _nothing)
        if scenario.task.order == "free":
            task = scenario.task.in_order(work.best_order()[0])
            work = SequencePlanner(scenario.replaced(task=task), planning, _nothing)
    except ScenarioError as error:
        return SequenceBound(np.inf, (), np.empty((0, 0)), str(error))
    chain = work.least_chain()
    if chain is None:
        return SequenceBound(np.inf, (), np.empty((0, 0)), "no way leads from stop to stop")
    times = [float(edges.durations[pair]) for edges, pair in zip(work.edges, pairwise(chain), strict=True)]
    names = [work.task.labels[number] for number in work.moving]
    waits = sum(stage.pause for stage in work.stages)
    postures = np.array([stop.postures[index] for stop, index in zip(work.stops, chain, strict=True)])
    return SequenceBound(sum(times) + waits, tuple(zip(names, times, strict=True)), postures)


def _nothing(scenario: Scenario) -> PlannedMotion:
    raise AssertionError(scenario)
