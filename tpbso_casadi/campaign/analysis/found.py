"""What a run found, computed again from what is stored of it."""

from __future__ import annotations

from dataclasses import dataclass

from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.scenario.scenario import plugin_failures_named
from tpbso_casadi.storage.recomputation.agreement import Contradiction
from tpbso_casadi.storage.result import RunResult
from tpbso_casadi.storage.stored_run import checked


@dataclass(frozen=True, kw_only=True)
class Found:
    """What a run found.

    Attributes:
        words: that say more of it than its objective.
        planned: a motion, certificate and objective included; None of a function.
    """

    words: str
    planned: PlannedMotion | None = None


def plan_found(text: str) -> Found:
    """The plan of a ``result.json``.

    Raises:
        InvalidResult, ScenarioError, Contradiction: it is none, or not what a recomputation gives.
    """
    result = RunResult.from_json(text)
    with plugin_failures_named(result.scenario, Contradiction):
        motion = checked(result).motion
    words = f"it takes {motion.trajectory.duration:.5g} s and is certified for all t"
    return Found(words=words, planned=PlannedMotion(scenario=result.scenario, motion=motion))
