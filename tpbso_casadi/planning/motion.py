"""A planned motion: trajectory, verdicts, quantities of the joints."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, isfinite
from typing import Any

import casadi as ca
import numpy as np

from problems import CertificateStatus, Objective, Problem, Robot, Trajectory, Verdict
from problems.assembly import Criteria, MotionStage
from problems.base import FloatArray, as_array
from problems.certify import AtGoal, ClosestApproach, WorstIs, broken_spans
from problems.limits import Clearance
from problems.motions import JointPath
from problems.tasks import RecordedMotion
from problems.timing import least_durations, least_through

STILL = 1e-9  # of a joint's limit of speed: at less it stands still, and Coulomb friction does not act


def torques_of(robot: Robot, trajectory: Trajectory, times: FloatArray) -> FloatArray | None:
    """Torques at times (n,) in s, gravity and friction included: (n, dof), N m or N; None where masses are not known.

    At the ends of a motion rounding would decide on the sign of Coulomb friction; a joint that stands still has none.
    """
    if robot.rigid_chain is None:
        return None
    theta, speed, acceleration = (trajectory.at(times, order) for order in range(3))
    speed = np.where(np.abs(speed) > STILL * np.array(robot.limits.speed), speed, 0.0)
    return as_array(robot.dynamics.torques(*map(ca.DM, (theta, speed, acceleration))))


def _derivative(order: int) -> Callable[[Robot, Trajectory, FloatArray], FloatArray]:
    return lambda robot, trajectory, times: trajectory.at(times, order)


QUANTITIES: dict[str, Callable[[Robot, Trajectory, FloatArray], FloatArray | None]] = {
    "speed": _derivative(1),
    "acceleration": _derivative(2),
    "jerk": _derivative(3),
    "torque": torques_of,
}  # by the names that :class:`JointLimits` has for their limits; at times (n,): (n, dof)


def shares_of_limits(criteria: Criteria, trajectory: Trajectory, times: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """The quantities that the robot limits, at times (n,) in s, over their limits: names, and (n, dof), signed."""
    for name, quantity in QUANTITIES.items():
        shares = np.full((times.size, criteria.robot.dof), np.nan)
        for part, rows in criteria.at_times(times):
            limit = getattr(part.robot.limits, name)
            values = None if limit is None else quantity(part.robot, trajectory, times[rows])
            if values is not None:
                shares[rows] = values / np.array(limit)
        if not np.isnan(shares).any():
            yield name, shares


def alternatives(units: Sequence[str]) -> str:
    """The units of joints as a label says them, those of turning joints first."""
    return " or ".join(sorted(set(units), reverse=True))


LOG = logging.getLogger(__name__)
INFEASIBLE_MERIT = 1e15  # of a motion that breaks nothing by anything; whatever the unit, no objective comes near it
MINIMUM_ROWS = 201  # of trajectory.csv


@dataclass(frozen=True, repr=False)
class JudgedMotion:
    """A trajectory and its verification.

    Attributes:
        criteria: by which it is judged.
        trajectory: the motion itself.
        quantities: the robot's own quantities behind it, by the paper's symbols.
        time_scale: the factor by which the search's motion has been slowed so that the speed and acceleration limits
            hold between its samples too; 1 where they did already.
        retimed: whether it is the fastest of its path: what has to be at given times of a search's motion is then free.
    """

    criteria: Criteria
    trajectory: Trajectory
    quantities: dict[str, FloatArray]
    time_scale: float = 1.0
    retimed: bool = False

    def __repr__(self) -> str:
        return f"<motion: {self.trajectory!r}>"

    @property
    def path(self) -> JointPath:
        """The path that it runs: the given one where one is given, else its own, with its time as the parameter."""
        return self.criteria.path_of(self.trajectory)

    def timed_anew(self, trajectory: Trajectory) -> JudgedMotion:
        """The motion at other times along its path."""
        return replace(self, criteria=self.criteria.at_free_times(), trajectory=trajectory, retimed=True)

    @property
    def is_stated(self) -> bool:
        """Whether it is judged as it was stated, with nothing of it chosen."""
        return isinstance(self.criteria.task, RecordedMotion)

    @property
    def stages(self) -> tuple[MotionStage, ...]:
        """The stages of which the motion is made; none where it is one."""
        return self.criteria.stages

    @cached_property
    def by_stage(self) -> tuple[tuple[Verdict, ...], ...]:
        """The verdicts on each stage, where the motion is made of several."""
        return self.criteria.by_stage(self.trajectory)

    @cached_property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Each constraint, judged for all t."""
        began = time.perf_counter()
        verdicts = self.criteria.overall(self.by_stage)
        certified = sum(verdict.satisfied for verdict in verdicts)
        LOG.info(
            "certificate: %d of %d constraints proven for all t in %.3f s",
            certified,
            len(verdicts),
            time.perf_counter() - began,
        )
        return verdicts

    @cached_property
    def broken_spans(self) -> dict[str, list[tuple[float, float]]]:
        """Spans in s in which violated limits are broken, by name; none of a motion that is made of stages."""
        if self.stages:
            return {}
        return broken_spans(self.criteria.judged_limits, self.verdicts, self.trajectory)

    @property
    def status(self) -> CertificateStatus:
        """The certificate: of all constraints together, for all t."""
        statuses = {verdict.status for verdict in self.verdicts}
        worst_first = (CertificateStatus.VIOLATED, CertificateStatus.UNDECIDED)
        return next((status for status in worst_first if status in statuses), CertificateStatus.CERTIFIED)

    @property
    def status_in_words(self) -> str:
        """The status with what the user left out: the geometry of links, limits."""
        return f"{self.status} {self.criteria.assumed}".rstrip()

    @cached_property
    def not_judged(self) -> tuple[str, ...]:
        """Lines that name what no verdict speaks of, although it is or may be there."""
        return self.criteria.not_judged(self.trajectory)

    @property
    def taken(self) -> tuple[str, ...]:
        """Lines on what it takes of that which the statement leaves to choose: of several goals, of free turns."""
        if not self.stages:
            return self.criteria.task.taken(self.trajectory)
        moving = ((stage, stage.criteria) for stage in self.stages)
        return tuple(
            f"{stage.label}: {line}"
            for stage, criteria in moving
            if criteria is not None
            for line in criteria.task.taken(stage.motion(self.trajectory))
        )

    @property
    def feasible(self) -> bool:
        """Whether every constraint is certified to hold, and the objective is a number."""
        return self.status is CertificateStatus.CERTIFIED and isfinite(self.objective)

    @property
    def worst_violation(self) -> float:
        """The largest excess over any bound, in that constraint's unit; 0 when feasible."""
        return max((verdict.excess for verdict in self.verdicts), default=0.0)

    @cached_property
    def times(self) -> FloatArray:
        """The times in s of the rows of ``trajectory.csv``."""
        return self.spread_times(MINIMUM_ROWS)

    def spread_times(self, at_least: int) -> FloatArray:
        """Times in s, at least so many, with every breakpoint."""
        return self.criteria.row_times(self.trajectory, at_least)

    def joint_positions(self, times: FloatArray) -> FloatArray:
        """Positions of base, joints and tip at times (n,) in s: (n, frames, dim), m."""
        return self.criteria.robot.skeleton(self.trajectory.at(times))

    def torques(self, times: FloatArray) -> FloatArray | None:
        """Torques of the motors at times (n,) in s: (n, dof), N m or N; None where masses are not known."""
        found = np.zeros((times.size, self.criteria.robot.dof))
        for part, rows in self.criteria.at_times(times):
            torques = torques_of(part.robot, self.trajectory, times[rows])
            if torques is None:
                return None
            found[rows] = torques
        return found

    @cached_property
    def closest_approach(self) -> ClosestApproach | None:
        """How near it comes to an obstacle, and when; None where none is within reach."""
        return self.criteria.closest_approach(self.trajectory, self.by_stage)

    @property
    def clearance_in_words(self) -> str:
        """Words on the proven and the found distance from obstacles; empty where none is within reach."""
        proven = [
            verdict for verdict in self.verdicts if verdict.name == Clearance.name and verdict.worst_is is WorstIs.BOUND
        ]
        parts = [verdict.worst_is.distance(verdict.worst) for verdict in proven]
        if self.closest_approach is not None:
            found = self.closest_approach
            parts.append(f"{WorstIs.FOUND.distance(found.distance)} at {found.time:.3g} s")
        return f"{Clearance.name} {'; '.join(parts)}" if parts else ""

    @cached_property
    def at_goal(self) -> AtGoal | None:
        """How long the robot is clear at its goal; None where nothing moves, or it does not stop there."""
        return self.criteria.at_goal(self.trajectory)

    @cached_property
    def turns(self) -> FloatArray:
        """The range of each joint's angle over all t, in whole turns: (k,)."""
        theta = self.trajectory.at(self.trajectory.extreme_times(0))
        return np.asarray(np.ptp(theta, axis=0) / (2.0 * np.pi))

    @cached_property
    def least_duration(self) -> float | None:
        """A lower bound of the duration of any motion past the given postures, s; None where it passes none.

        Computed in floating point, with an allowance for rounding: no certificate.
        """
        task = self.criteria.task
        if task.passed_postures is None:
            return None
        return least_through(task.passed_postures, self.criteria.robot.limits, task.end_velocities)

    @property
    def least_duration_between_ends(self) -> float | None:
        """The least duration of a move from rest to rest between the ends in free space, s; None of other motions."""
        is_plain = self.criteria.task.is_plain_move and self.trajectory.is_finite
        if not (is_plain and self.criteria.objective.asks_for_least_time):
            return None
        start, goal = self.trajectory.at(self.trajectory.breakpoints[[0, -1]])
        return float(least_durations(goal - start, self.criteria.robot.limits).max())

    @cached_property
    def objective(self) -> float:
        """The objective, exact, integrals to 1e-9; one of a plug-in at the rows of ``trajectory.csv``."""
        return self.criteria.objective_value(self.trajectory, self.times)

    @cached_property
    def objective_parts(self) -> list[tuple[Objective, float, float]]:
        """Objectives of a weighted sum with their weights and values; none otherwise."""
        objective = self.criteria.objective
        if objective.terms == ((1.0, objective),):
            return []
        robot = self.criteria.robot
        return [(part, weight, part.of_motion(self.trajectory, robot, self.times)) for weight, part in objective.terms]

    @property
    def compared(self) -> float:
        """The objective with the cost of the goal that is reached."""
        return self.objective + self.criteria.task.added_cost(self.trajectory)

    @property
    def merit(self) -> float:
        """One number to compare motions by, lower is better: :attr:`compared`; more than any where a limit is broken.

        Infinite where the trajectory is no motion: where a number of it is not finite.
        """
        if not self.trajectory.is_finite:
            return inf
        return self.compared if self.feasible else INFEASIBLE_MERIT * (1.0 + self.worst_violation)


def motion_of(problem: Problem[Any], x: FloatArray) -> JudgedMotion:
    """The motion of a search vector (d,), slowed by the least factor with which its limits hold for all t."""
    trajectory, criteria = problem.trajectory(x), problem.criteria
    scale = max(1.0, criteria.safe_time_scale(trajectory))
    slowed = trajectory.time_scaled(scale)
    return JudgedMotion(criteria, slowed, problem.quantities(x), scale, retimed=criteria.free_timing)
