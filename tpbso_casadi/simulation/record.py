"""What a simulation leaves: the motion that was executed, what obstacles really did, and every replan."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems import Robot, Trajectory
from problems.base.matrix import FloatArray
from problems.scene.obstacle import Obstacle
from problems.tasks.place import Joints
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.simulation import SimulationSection


@dataclass(frozen=True, kw_only=True)
class Replan:
    """One answer of the planner; times are those of the simulation.

    Attributes:
        tick: its number, from 0.
        time: at which the planner saw the scene, s; what it answers is executed from one period later.
        goal: index of the place that the arm was to reach.
        kind: ``new``, ``old`` or ``stop``: which motion goes on.
        certified: whether that is proven clear of the obstacles as predicted, for all t.
        fail_safe: whether the arm can be proven to stop in time, whatever obstacles do at the rate of their changes.
        seconds: that the answer took.
        predicted_distance: the smallest distance of the predicted scene, m; infinite where nothing can touch.
        arrival: when the motion ends, s.
        jumps: of angle, speed and acceleration where the answer joins what was executed before: the largest of all
            joints, rad, rad/s, rad/s^2.
    """

    tick: int
    time: float
    goal: int
    kind: str
    certified: bool
    fail_safe: bool
    seconds: float
    predicted_distance: float
    arrival: float
    jumps: tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Visit:
    """A place that was reached.

    Attributes:
        goal: index of the place.
        time: since when the arm is at rest there, s.
    """

    goal: int
    time: float


@dataclass(frozen=True, kw_only=True)
class SimulationRecord:
    """A simulation of the planner from t = 0 on.

    Attributes:
        scenario: as it was simulated, with its [simulation] table complete.
        robot: that moved.
        executed: the motion, from 0 to the end, exact; it may end while the arm moves.
        following: what the arm would have done then, on a clock of its own.
        obstacles: with their true motions, those that stand still too.
        goals: postures visited one after the other, cyclically.
        visits: in their order.
        replans: in their order.
        interrupted: whether Ctrl-C cut it short.
    """

    scenario: Scenario
    robot: Robot
    executed: Trajectory
    following: Trajectory
    obstacles: tuple[Obstacle, ...]
    goals: tuple[Joints, ...]
    visits: tuple[Visit, ...]
    replans: tuple[Replan, ...]
    interrupted: bool = False

    @property
    def settings(self) -> SimulationSection:
        """How it was simulated."""
        assert self.scenario.simulation is not None
        return self.scenario.simulation

    @property
    def duration(self) -> float:
        """That was simulated, s."""
        return self.executed.duration

    @property
    def moving(self) -> tuple[Obstacle, ...]:
        """Those of the obstacles that move."""
        return tuple(obstacle for obstacle in self.obstacles if obstacle.moves)

    @property
    def largest_jumps(self) -> FloatArray:
        """Of angle, speed and acceleration over all replans, (3,): rad, rad/s, rad/s^2."""
        return np.asarray(np.array([replan.jumps for replan in self.replans]).max(axis=0, initial=0.0))
