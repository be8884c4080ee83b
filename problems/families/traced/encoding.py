"""Redundancy along a traced path, in the plane and in space.

At each knot the posture before is changed by what the decided offsets of a few joints change from knot to knot, and
then led back onto the path by damped Newton steps: the part of the change that would move the tool is undone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

from problems.assembly import GRID_ALLOWANCE, Decoded, Pace, PathTiming, Slowness, Variable, step_limits
from problems.base import FloatArray, Matrix, as_array
from problems.families.knots import KnotPostures, PathEncoding, largest_values
from problems.families.traced.motion import TracedSpline
from problems.limits import Limit, StepLimit
from problems.motions import Rates, TimedPath
from problems.objectives import MotionBounds
from problems.robots import LONGEST_STEP, Robot, project
from problems.tasks import Elbow, PathTracing, SpaceTracing

AT_REST: Rates = ca.DM(0.0), None


class TracedKnots(PathTiming, KnotPostures[TimedPath]):
    """A path through knots, from rest to rest; the motion's nodes are the knots. A subclass is a frozen dataclass."""

    motion: TracedSpline

    def decode(self, x: Matrix) -> Decoded[TimedPath]:
        """The least time along the spline through the knots."""
        return Decoded(parameters=self.motion.timed(*self.path(x), self.pace_at_samples(x)))

    def path(self, x: Matrix) -> tuple[Matrix, Rates]:
        """Control points (N, dof), rad; both ends at rest."""
        return self.motion.spline.coefficients(self.postures(x)), AT_REST


def longest_timing(motion: TracedSpline, most: float = np.pi) -> float:
    """No shorter than the least time along any path whose joints turn by at most ``most`` from knot to knot, s.

    That of accelerating in each stretch by a constant d2u/dt2 = c up to its middle and slowing down from there, with a
    c so small that du/dt <= sqrt(c) keeps every limit on any such path.
    """
    spline, joints, grid = motion.spline, motion.robot.limits, motion.parameters_u
    first, second = (largest_values(spline.operator(grid, order), most).max() for order in (1, 2))
    c = min(min(joints.acceleration) / (first + second), (min(joints.speed) / first) ** 2)
    return GRID_ALLOWANCE * 2.0 * float(np.sqrt((len(motion.corners) + 1) / c))


@dataclass(frozen=True)
class Tracing(TracedKnots, PathEncoding[TimedPath]):
    """Feasible by construction, except for the accuracy, obstacles and joint ranges.

    Args:
        task: whose path and elbow.
        motion: that is decoded; its nodes are the knots.
        points: at the knots, m.
        redundancy_values: how many values of x_phi are decided for each redundant link.
        slowness: the last variable, where the duration is one.
        pace: the variables before it, where obstacles move.
    """

    task: PathTracing
    motion: TracedSpline
    points: tuple[tuple[float, ...], ...]
    redundancy_values: int = 5
    slowness: Slowness | None = None
    pace: Pace | None = None
    moving_ends: tuple[bool, bool] = field(init=False, default=(False, False))
    step_limits: tuple[StepLimit, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "step_limits", step_limits(self.task))

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @property
    def elbow(self) -> Elbow:
        """The branch of inverse kinematics."""
        return self.task.elbow

    @cached_property
    def knots(self) -> FloatArray:
        """Path parameters of the knots, (M,)."""
        return np.array(self.motion.nodes)

    @cached_property
    def knot_points(self) -> FloatArray:
        """The points at the knots, (M, dim), m."""
        return np.array(self.points)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """x_phi of each redundant link, [elbow,] [slowness]; one that changes nothing where nothing is to choose."""
        return (*self.posture_variables, *self.timing_variables) or (Variable("unused", 0.0, 1.0, "1"),)

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds of the motions of the search box: joints turn by at most pi from knot to knot."""
        return MotionBounds(
            duration=self.longest(longest_timing(self.motion), limits),
            rotation=self.robot.dof * np.pi * (self.knots.size - 1) * 4.0,
            radius=self.robot.reach()[1],
        )


MOST_OFFSET = np.pi / 2.0  # rad or m, by which a joint wanders off
STRIDES = 4  # in which the first posture wanders off
STEPS = 4  # of Newton's method at each knot, and after each stride
LAST_STEPS = 4  # further ones in the finished motion


@dataclass(frozen=True)
class SpaceKnots(TracedKnots):
    """On the path by construction, wherever Newton's method finds it; the accuracy at the samples tells.

    Args:
        task: whose path.
        motion: that is decoded; its nodes are the knots.
        targets: of the tool at the knots: x, y, z in m, and its rotation matrix row by row where that is given.
        starts: postures with the tool at the first knot, of which one is chosen, rad.
        joints: which joints wander off.
        offset_values: how many offsets are decided for each of them.
        slowness: the last variable, where the duration is one.
        pace: the variables before it, where obstacles move.
    """

    numbers: ClassVar[tuple[str, ...]] = ("starts",)

    task: SpaceTracing
    motion: TracedSpline
    targets: tuple[tuple[float, ...], ...]
    starts: tuple[tuple[float, ...], ...]
    joints: tuple[int, ...]
    offset_values: int = 5
    slowness: Slowness | None = None
    pace: Pace | None = None
    moving_ends: tuple[bool, bool] = field(init=False, default=(False, False))
    step_limits: tuple[StepLimit, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "step_limits", step_limits(self.task))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Offsets of each joint that wanders off, [branch,] [slowness]; one that changes nothing if there are none."""
        listed = [
            Variable(f"offset_{joint + 1}[{i}]", -MOST_OFFSET, MOST_OFFSET, "rad" if turning else "m")
            for joint, turning in ((joint, self.task.robot.chain.joints[joint].turns) for joint in self.joints)
            for i in range(1, self.offset_values + 1)
        ]
        if len(self.starts) > 1:
            listed.append(Variable("branch", 0.0, float(len(self.starts)), "1"))
        return (*listed, *self.timing_variables) or (Variable("unused", 0.0, 1.0, "1"),)

    @cached_property
    def knot_rows(self) -> FloatArray:
        """By how much the shares of the decided offsets grow, and the target; (lead + M, offset_values + w)."""
        decided = np.linspace(0.0, 1.0, self.offset_values)
        shares = CubicSpline(decided, np.eye(self.offset_values))(np.array(self.motion.nodes))
        first = np.repeat(shares[:1] / STRIDES, STRIDES, axis=0)
        grown = np.concatenate([first, np.diff(shares, axis=0)])
        targets = np.array(self.targets)
        return np.column_stack([grown, np.concatenate([targets[:1].repeat(self.lead, axis=0), targets])])

    @property
    def lead(self) -> int:
        """All strides in which the first posture wanders off, but the last."""
        return STRIDES - 1

    def offsets(self, x: Matrix, share: Matrix) -> Matrix:
        """What shares (1, offset_values) make of the decided offsets: of all joints, (1, dof)."""
        count = len(self.joints) * self.offset_values
        values = ca.mtimes(share, ca.reshape(x[:count], self.offset_values, len(self.joints)))
        found: list[Matrix] = [ca.DM(0.0)] * self.task.robot.dof
        for place, joint in enumerate(self.joints):
            found[joint] = values[place]
        return ca.horzcat(*found)

    def posture_before(self, x: Matrix) -> Matrix:
        """The start whose number the branch says, (1, dof)."""
        branch, rows = len(self.joints) * self.offset_values, [ca.horzcat(*start) for start in self.starts]
        found: Matrix = rows[0]
        for number, posture in enumerate(rows[1:], start=1):
            found = ca.if_else(x[branch] >= float(number), posture, found)
        return found

    def posture_at(self, x: Matrix, row: Matrix, before: Matrix) -> Matrix:
        """The posture before, wandered off and led back onto the path."""
        share, target = row[: self.offset_values].T, row[self.offset_values :]
        return self._led_back(before + self.offsets(x, share), target, STEPS)

    def _led_back(self, theta: Matrix, target: Matrix, steps: int) -> Matrix:
        rotation = None if target.shape[0] == 3 else ca.reshape(target[3:], 3, 3).T
        return project(self.task.robot, theta, target[:3], rotation, steps)

    @cached_property
    def _knot(self) -> ca.Function:
        """One knot, as a function: quick to call many times, with symbols too."""
        x, before = ca.SX.sym("x", len(self.variables)), ca.SX.sym("before", 1, self.task.robot.dof)
        row = ca.SX.sym("row", self.knot_rows.shape[1])
        return ca.Function("knot", [x, row, before], [self.posture_at(x, row, before)])

    @cached_property
    def _last(self) -> ca.Function:
        """Further Newton steps at a knot."""
        theta = ca.SX.sym("theta", 1, self.task.robot.dof)
        target = ca.SX.sym("target", len(self.targets[0]))
        return ca.Function("last", [theta, target], [self._led_back(theta, target, LAST_STEPS)])

    def postures(self, x: Matrix) -> Matrix:
        """Joint angles (M, dof) at the knots, rad."""
        return self._followed(x, self.posture_before(x))

    def followed(self, starts: FloatArray) -> FloatArray:
        """Joint angles (n, M, dof) at the knots from n starts (n, dof) on, with no joint wandering off."""
        count, dof = starts.shape
        x = ca.DM.zeros(len(self.variables), count)
        theta = as_array(self._followed(x, ca.DM(starts.reshape(1, -1)), count))
        return theta.reshape(-1, count, dof).transpose(1, 0, 2)

    def _followed(self, x: Matrix, theta: Matrix, count: int = 1) -> Matrix:
        """From several starts side by side, (1, count dof): postures at the knots, (M, count dof)."""
        knot, last = self._knot.map(count), self._last.map(count)
        found = []
        for row in self.knot_rows:
            rows = ca.repmat(ca.DM(row), 1, count)
            theta = knot(x, rows, theta)
            found.append(last(theta, rows[self.offset_values :, :]))
        return ca.vertcat(*found[self.lead :])

    @property
    def most_change(self) -> float:
        """Bound of how much a joint changes from knot to knot, rad or m: by its offset, and by all Newton steps."""
        grown = float(np.abs(self.knot_rows[:, : self.offset_values]).sum(axis=1).max())
        return MOST_OFFSET * grown + LONGEST_STEP * (STEPS + 2 * LAST_STEPS)

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds of the motions of the search box."""
        duration = longest_timing(self.motion, self.most_change)
        return MotionBounds(
            duration=self.longest(duration, limits),
            rotation=self.task.robot.dof * self.most_change * (len(self.targets) - 1) * 4.0,
            radius=self.task.robot.reach()[1],
        )
