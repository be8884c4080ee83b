"""The record of a simulation: what was executed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from problems import Joints, Move, Obstacle, Robot, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from problems.limits import proximity_limits
from tpbso_casadi.planning import JudgedMotion
from tpbso_casadi.scenario import Scenario, SimulationSection


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
        """The simulated time, s."""
        return self.executed.duration

    @property
    def moving(self) -> tuple[Obstacle, ...]:
        """The obstacles that are moving."""
        return tuple(obstacle for obstacle in self.obstacles if obstacle.moves)

    @property
    def largest_jumps(self) -> FloatArray:
        """The largest jumps of angle, speed and acceleration over all replans, (3,): rad, rad/s, rad/s^2."""
        return np.asarray(np.array([replan.jumps for replan in self.replans]).max(axis=0, initial=0.0))


SNAP = 1e-12  # s: a time that near to the end of a motion is its end
STILL = 1e-9  # rad or m: a joint that moves by less in a piece stands still


def part(trajectory: Trajectory, first: float, last: float) -> Trajectory:
    """A motion from one time in s to another, on a clock that starts at 0; after its end it stands still."""
    end = trajectory.duration
    if first >= end - SNAP:
        return Trajectory.standing(trajectory.value_at_end(), last - first)
    if last <= end + SNAP:
        return trajectory.part(first, min(last, end))
    return trajectory.part(first, end).followed_by(Trajectory.standing(trajectory.value_at_end(), last - end))


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Motions one after the other."""
    order = max(len(each.coefficients) for each in parts)
    padded = [np.pad(each.coefficients, ((order - len(each.coefficients), 0), (0, 0), (0, 0))) for each in parts]
    lengths = np.concatenate([np.diff(each.breakpoints) for each in parts])
    return Trajectory(np.concatenate([[0.0], np.cumsum(lengths)]), np.concatenate(padded, axis=1))


def jumps_between(before: Trajectory, after: Trajectory, time: float) -> tuple[float, float, float]:
    """The largest jumps of angle, speed and acceleration of a joint if one motion takes over from another.

    Args:
        before: that is executed until then.
        after: that is executed from then on.
        time: of both clocks, s.

    Returns:
        rad, rad/s, rad/s^2.
    """
    last, first = part(before, 0.0, time), part(after, time, time + max(after.duration, 1.0))
    at_start = np.zeros(1)
    jumps = [float(np.abs(last.value_at_end(order) - first.at(at_start, order)[0]).max()) for order in range(3)]
    return jumps[0], jumps[1], jumps[2]


def stands(trajectory: Trajectory) -> NDArray[np.bool_]:
    """Flags of the pieces of a motion that move no joint by more than rounding, (p,)."""
    powers = np.diff(trajectory.breakpoints)[:, None] ** np.arange(len(trajectory.coefficients) - 1, 0, -1)
    travels = np.einsum("ipk,pi->pk", np.abs(trajectory.coefficients[:-1]), powers)
    return np.asarray((travels <= STILL).all(axis=1))


def rest_time(trajectory: Trajectory) -> float:
    """The time in s from which on a motion stands still; its duration at the latest."""
    moving = np.flatnonzero(~stands(trajectory))
    return float(trajectory.breakpoints[moving[-1] + 1]) if moving.size else 0.0


MEANINGS = {"new": "a new motion", "old": "the motion goes on", "stop": "stops"}  # of the kinds of answers


def simulated_motion(record: SimulationRecord) -> JudgedMotion:
    """The executed motion; its criteria are for drawing: true obstacles, and all goals."""
    start = Joints(tuple(record.executed.at(np.zeros(1))[0].tolist()))
    task = Move(record.robot, start, record.goals, obstacles=record.obstacles)
    limits = proximity_limits(replace(record.robot, margin=0.0), record.obstacles)
    objective = record.scenario.criteria().objective
    return JudgedMotion(Criteria(task=task, objective=objective, limits=limits), record.executed, {})


def notes(record: SimulationRecord) -> tuple[tuple[float, str], ...]:
    """Notes of the planner's last answer, with the times in s from which they hold."""
    return tuple((replan.time, note(replan)) for replan in record.replans)


def note(replan: Replan) -> str:
    """An answer in one line."""
    proofs = {"proven clear of the prediction": replan.certified, "a stop in time proven": replan.fail_safe}
    held = ", ".join(claim for claim, holds in proofs.items() if holds) or "nothing proven"
    return f"replan {replan.tick}: {MEANINGS[replan.kind]} ({held}), {1000.0 * replan.seconds:.0f} ms"
