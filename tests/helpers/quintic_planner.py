"""A planner that sees no obstacles: a quintic from where the arm will be to the goal, in a given time."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from problems import Trajectory
from problems.base import FloatArray
from problems.scene import Obstacle
from problems.tasks import Place
from tpbso_casadi.replanning import Step
from tpbso_casadi.scenario import Scenario


class QuinticPlanner:
    """Joins a quintic to what is executed; keeps what it was given to see."""

    def __init__(self, scenario: Scenario, seconds: float) -> None:
        assert scenario.simulation is not None
        self.scenario, self.every, self.seconds = scenario, scenario.simulation.every, seconds
        self.seen: list[tuple[Obstacle, ...]] = []
        self.goals: list[Place | None] = []
        self.last: tuple[Place | None, float] = None, 0.0

    def replan(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None = None) -> Step:
        began = time.perf_counter()
        self.seen.append(tuple(obstacles))
        self.goals.append(goal)
        now = min(self.every, executed.duration)
        state = [executed.at(np.array([np.nextafter(now, 0.0)]), order)[0] for order in range(3)]
        left = max(self.last[1] - self.every, self.every) if goal == self.last[0] else self.seconds
        self.last = goal, left
        end = np.array(goal.values)  # type: ignore[union-attr]
        quintic = quintic_to(state, end, left)
        head = executed.coefficients[:, executed.breakpoints[:-1] < now - 1e-12]
        order = max(6, len(head))
        pieces = [np.pad(c, ((order - len(c), 0), (0, 0), (0, 0))) for c in (head, quintic[:, None])]
        breaks = executed.breakpoints[executed.breakpoints < now - 1e-12]
        trajectory = Trajectory(np.concatenate([breaks, [now, now + left]]), np.concatenate(pieces, axis=1))
        return Step(
            kind="new",
            scenario=self.scenario,
            trajectory=trajectory,
            certified=False,
            fail_safe=False,
            seconds=time.perf_counter() - began,
        )


def quintic_to(state: list[FloatArray], end: FloatArray, duration: float) -> FloatArray:
    """Coefficients (6, k), highest power first, from angle, speed and acceleration to rest at the end."""
    q, v, a = state
    powers = np.arange(3, 6)
    rows = np.array(
        [duration**powers, powers * duration ** (powers - 1), powers * (powers - 1) * duration ** (powers - 2)]
    )
    missing = np.array([end - q - v * duration - a * duration**2 / 2, -v - a * duration, -a])
    high = np.linalg.solve(rows, missing)
    return np.concatenate([high[::-1], [a / 2, v, q]])
