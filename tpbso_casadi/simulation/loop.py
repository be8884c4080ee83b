"""The loop: observe, plan again, move on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from problems import Joints, Obstacle, Place, Trajectory
from solvers.budget import Interruption
from tpbso_casadi.replanning import Step
from tpbso_casadi.simulation.record import Replan, SimulationRecord, Visit, joined, jumps_between, part, rest_time
from tpbso_casadi.simulation.setting import SimulationSetting

REACHED = 1e-6  # rad or m: a joint that near to its goal is there


class Planner(Protocol):
    """Who is asked at every tick; see :class:`tpbso_casadi.replanning.replanner.Replanner`."""

    def replan(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None = None) -> Step:
        """What to execute from now on, given what is executed meanwhile, on a clock that starts now."""


@dataclass
class Simulation:
    """A simulation, tick by tick.

    Args:
        setting: robot, scene and goals.
        planner: that is asked.
    """

    setting: SimulationSetting
    planner: Planner

    def __post_init__(self) -> None:
        start = np.array(self.setting.start.values)
        self._ahead = Trajectory.standing(start, self.every)
        self._executed: list[Trajectory] = []
        self._replans: list[Replan] = []
        self._visits: list[Visit] = []
        self._goal = 0

    @property
    def every(self) -> float:
        """The time between two ticks, s."""
        return self.setting.settings.every

    def run(
        self, interruption: Interruption, told: Callable[[Replan], object] = lambda replan: None
    ) -> SimulationRecord:
        """Simulate to the end, or until there is a request to stop.

        Args:
            interruption: is polled; the answer during which it came does not count.
            told: is given every replan.

        Raises:
            KeyboardInterrupt: the request came before the first answer.
        """
        for tick in range(self.setting.settings.ticks):
            replan = self._tick(tick, interruption)
            if replan is None:
                break
            told(replan)
        if not self._executed:
            raise KeyboardInterrupt
        return self._record(interrupted=interruption.requested)

    def _tick(self, tick: int, interruption: Interruption) -> Replan | None:
        """One look at the scene; None where a request came meanwhile."""
        now = tick * self.every
        self._arrive(now)
        answer = self.planner.replan(self._ahead, self.setting.world.observed(now), self._goals[self._goal])
        if interruption.requested:
            return None
        replan = Replan(
            tick=tick,
            time=now,
            goal=self._goal,
            kind=answer.kind,
            certified=answer.certified,
            fail_safe=answer.fail_safe,
            seconds=answer.seconds,
            predicted_distance=np.inf if answer.closest is None else answer.closest.distance,
            arrival=now + rest_time(answer.trajectory),
            jumps=jumps_between(self._ahead, answer.trajectory, self.every),
        )
        self._executed.append(part(self._ahead, 0.0, self.every))
        self._ahead = part(answer.trajectory, self.every, max(answer.trajectory.duration, 2.0 * self.every))
        self._replans.append(replan)
        return replan

    @property
    def _goals(self) -> tuple[Joints, ...]:
        return self.setting.goals

    def _arrive(self, now: float) -> None:
        """Turn to the next goal where this one is reached before the next tick."""
        at_rest = rest_time(self._ahead)
        miss = np.abs(self._ahead.at(np.array([self.every]))[0] - self._goals[self._goal].values).max()
        is_new = not self._visits or self._visits[-1].goal != self._goal
        if at_rest <= self.every and miss <= REACHED and is_new:
            self._visits.append(Visit(goal=self._goal, time=now + at_rest))
            self._goal = (self._goal + 1) % len(self._goals)

    def _record(self, interrupted: bool) -> SimulationRecord:
        return SimulationRecord(
            scenario=self.setting.scenario,
            robot=self.setting.robot,
            executed=joined(self._executed),
            following=self._ahead,
            obstacles=self.setting.world.true,
            goals=self._goals,
            visits=tuple(self._visits),
            replans=tuple(self._replans),
            interrupted=interrupted,
        )
