"""A verified motion, and the scenario that it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from problems import Problem, Trajectory, Verdict
from problems.assembly.criteria import Criteria
from problems.base.matrix import FloatArray
from solvers import Result
from tpbso_casadi.planning.finishing import Retiming
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.refinement import Polish
from tpbso_casadi.scenario.scenario import Scenario


@dataclass(frozen=True, kw_only=True, repr=False)
class PlannedMotion:
    """A motion and what it was asked for.

    Attributes:
        scenario: robot, task, limits and solver.
        motion: the plan itself.
        retiming: the last stage of a search; None where there was none.
        interrupted: whether Ctrl-C cut the work short.
        seconds_timed: that the timing of a given path took; 0 where there was a search.
    """

    scenario: Scenario
    motion: Motion
    retiming: Retiming | None = None
    interrupted: bool = False
    seconds_timed: float = 0.0

    def __repr__(self) -> str:
        return f"<planned motion: {self.trajectory!r}>"

    @property
    def searched(self) -> SearchedMotion | None:
        """What is known of the search; None where a given path was timed."""
        return None

    @property
    def criteria(self) -> Criteria:
        """What the motion is judged by."""
        return self.motion.criteria

    @property
    def trajectory(self) -> Trajectory:
        """The motion's trajectory."""
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


@dataclass(frozen=True, kw_only=True, repr=False)
class SearchedMotion(PlannedMotion):
    """A motion that was searched for, and everything needed to judge it.

    Attributes:
        problem: the scenario's model.
        search: result and record of the search; before any polish.
        polish: the refinement by IPOPT; None where there was none.
        rounds: searches made; ``search`` is the one that led to the best motion.
    """

    problem: Problem[Any]
    search: Result
    polish: Polish | None = None
    rounds: int = 1

    @property
    def searched(self) -> SearchedMotion:
        """The plan itself."""
        return self
