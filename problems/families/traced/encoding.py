"""Traced paths as search vectors, in the plane and in space.

The motion is a spline with rounded corners, timed by a scan. A path with a corner is passed by stopping there; between
two corners the spline is the natural one, with second derivatives zero at both ends. The parameter is regular at the
ends: q'(u) is not zero there, as in a spline of a motion from rest, so that the path can be run at any speed.

In the plane inverse kinematics gives the posture at each knot. In space the posture at the knot before is changed by
what the decided offsets of a few joints change from knot to knot, and then led back onto the path by damped Newton
steps: the part of the change that would move the tool is undone.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.assembly import GRID_ALLOWANCE, Decoded, PathTiming, Variable
from problems.base import FloatArray, InvalidProblem, Matrix, as_array
from problems.families.knots import KnotPostures, PathEncoding, largest_values
from problems.limits import Limit, can_hold, proximity_limits
from problems.motions import DEGREE, InterpolatingSpline, PathSpline, Rates, Samples, TimedPath, without_rounding
from problems.objectives import MotionBounds
from problems.robots import LONGEST_STEP, postures, project, tool_jacobian
from problems.tasks import PathKnots, PathTracing, SpaceTracing, ToolTracing, overloaded

NATURAL_ORDER = 2  # of the derivative that is zero at the ends of a stretch


class CornerSpline(InterpolatingSpline):
    """Splines with given knots and corners.

    Args:
        knots: M >= 2 increasing values of u, the first 0, the last 1.
        corners: indices of the inner knots that are corners.
    """

    def __init__(self, knots: FloatArray, corners: Sequence[int] = ()) -> None:
        self.corners = tuple(corners)
        repeated = np.repeat(knots[list(self.corners)], DEGREE - 1)
        super().__init__(knots, knots, repeated.tolist())

    @cached_property
    def conditions(self) -> FloatArray:
        """Natural at the start of each stretch, its knots, natural at its end; (n, n)."""
        rows = []
        for first, last in self.stretches:
            start, end = self.knots[first], np.nextafter(self.knots[last], 0.0)
            at_knots = self.basis(self.knots[first : last + 1])
            bends = self.basis(np.array([start, end]), NATURAL_ORDER)
            block = [at_knots[0], bends[0], *at_knots[1:-1], bends[1], at_knots[-1]]
            rows += block if first == 0 else block[1:]
        return without_rounding(np.array(rows))

    def basis_functions(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        return np.asarray(self.basis(u, derivative))

    def known(self, angles: Matrix) -> Matrix:
        """Right-hand side: zero, the angles, zero, for each stretch."""
        zero, angles, rows = ca.DM.zeros(1, angles.shape[1]), self.scaled(angles), []
        for first, last in self.stretches:
            block = [angles[first, :], zero, angles[first + 1 : last, :], zero, angles[last, :]]
            rows += block if first == 0 else block[1:]
        return ca.vertcat(*rows)

    @property
    def stretches(self) -> list[tuple[int, int]]:
        """First and last knot of each stretch between corners."""
        ends = [0, *self.corners, self.knots.size - 1]
        return list(pairwise(ends))


@dataclass(frozen=True)
class TracedSpline(PathSpline):
    """The spline of :class:`CornerSpline`; its nodes are the knots.

    A corner is two grid points in one place: the path arrives at the first, stops, and leaves from the second.

    Args:
        corners: indices of the inner nodes at which the path turns a corner.
    """

    corners: tuple[int, ...] = ()

    @cached_property
    def spline(self) -> CornerSpline:
        return CornerSpline(np.array(self.nodes), self.corners)

    @cached_property
    def parameters_u(self) -> FloatArray:
        """Path parameters of the grid points, (n,); each corner is there twice, from the left and from the right."""
        even = super().parameters_u
        at = [corner * self.steps for corner in self.corners]
        return np.insert(even, at, np.nextafter(even[at], 0.0))

    @cached_property
    def double_steps(self) -> FloatArray:
        """Twice the distances of the grid points, (n - 1,); zero from one side of a corner to the other."""
        return np.insert(super().double_steps, [corner * self.steps for corner in self.corners], 0.0)

    @property
    def stops(self) -> tuple[int, ...]:
        return tuple(corner * self.steps + before for before, corner in enumerate(self.corners))

    @cached_property
    def intervals(self) -> NDArray[np.intp]:
        """The node interval to which each grid point belongs, (n,); the last one's to the interval before it."""
        starts = np.searchsorted(np.array(self.nodes), self.parameters_u, side="right") - 1
        return np.clip(starts, 0, len(self.nodes) - 2)


AT_REST: Rates = ca.DM(0.0), None


@dataclass(frozen=True)
class TracedKnots(PathTiming, KnotPostures[TimedPath]):
    """A path through knots, from rest to rest; the motion's nodes are the knots."""

    task: ToolTracing
    motion: TracedSpline

    @property
    @abstractmethod
    def posture_variables(self) -> list[Variable]:
        """The variables that decide the postures."""

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of the postures, [time scales]; one that changes nothing where nothing is to choose."""
        return (*self.posture_variables, *self.timing_variables) or (Variable("unused", 0.0, 1.0, "1"),)

    def decode(self, x: Matrix) -> Decoded[TimedPath]:
        return Decoded(parameters=self.motion.timed(*self.path(x), self.speed_shares(x)))

    def path(self, x: Matrix) -> tuple[Matrix, Rates]:
        """Control points (N, dof), rad; both ends at rest."""
        return self.motion.spline.coefficients(self.postures(x)), AT_REST

    @property
    def most_change(self) -> float:
        """Bound of how much a joint changes from knot to knot, rad or m."""
        return np.pi

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds of the motions of the search box.

        The duration is that of accelerating in each stretch by a constant d2u/dt2 = c up to its middle and slowing down
        from there, with a c so small that du/dt <= sqrt(c) keeps every limit on any such path.
        """
        motion, joints, grid = self.motion, self.motion.robot.limits, self.motion.parameters_u
        operators = (motion.spline.operator(grid, order) for order in (1, 2))
        first, second = (largest_values(operator, self.most_change).max() for operator in operators)
        c = min(min(joints.acceleration) / (first + second), (min(joints.speed) / first) ** 2)
        duration = GRID_ALLOWANCE * 2.0 * float(np.sqrt((len(motion.corners) + 1) / c))
        return MotionBounds(
            duration=self.longest(duration, limits),
            rotation=motion.robot.dof * self.most_change * (len(motion.nodes) - 1) * 4.0,
            radius=motion.robot.reach()[1],
        )


@dataclass(frozen=True)
class Tracing(PathEncoding[TimedPath], TracedKnots):
    """Feasible by construction, except for the accuracy, obstacles and joint ranges.

    Args:
        task: whose path and elbow.
        motion: that is decoded; its nodes are the knots.
        points: at the knots, m.
        redundancy_values: how many values of x_phi are decided for each redundant link.
    """

    task: PathTracing
    points: tuple[tuple[float, ...], ...]
    redundancy_values: int = 5

    @cached_property
    def knots(self) -> FloatArray:
        return np.array(self.motion.nodes)

    @cached_property
    def knot_points(self) -> FloatArray:
        return np.array(self.points)


MOST_OFFSET = np.pi / 2.0  # rad or m, by which a joint wanders off
STRIDES = 4  # in which the first posture wanders off
STEPS = 4  # of Newton's method at each knot, and after each stride
LAST_STEPS = 4  # further ones in the finished motion


@dataclass(frozen=True)
class SpaceKnots(TracedKnots):
    """Knots on the path by construction, wherever Newton's method finds it; the accuracy at the samples tells.

    Args:
        task: whose path.
        motion: that is decoded; its nodes are the knots.
        targets: of the tool at the knots: x, y, z in m, and its rotation matrix row by row where that is given.
        starts: postures with the tool at the first knot, of which one is chosen, rad.
        joints: which joints wander off.
        offset_values: how many offsets are decided for each of them.
    """

    numbers: ClassVar[tuple[str, ...]] = ("starts",)

    task: SpaceTracing
    targets: tuple[tuple[float, ...], ...]
    starts: tuple[tuple[float, ...], ...]
    joints: tuple[int, ...]
    offset_values: int = 5

    @classmethod
    def of_task(cls, task: SpaceTracing, motion: TracedSpline, knots: PathKnots, offset_values: int) -> SpaceKnots:
        """The search vectors: which postures it may begin with, which joints wander off.

        Raises:
            InvalidProblem: there is no posture to begin with.
        """
        targets = knots.points
        if knots.rotations is not None:
            targets = np.column_stack([targets, knots.rotations.reshape(-1, 9)])
        clear = clear_postures(task, knots)
        still = cls(task, motion, as_tuples(targets), as_tuples(clear[:1]), (), offset_values)
        starts = best_starts(task, knots, clear, still.followed(clear))
        return replace(still, starts=as_tuples(starts), joints=wandering_joints(task, starts))

    @property
    def posture_variables(self) -> list[Variable]:
        """Offsets of each joint that wanders off, [branch]."""
        listed = [
            Variable(f"offset_{joint + 1}[{i}]", -MOST_OFFSET, MOST_OFFSET, "rad" if turning else "m")
            for joint, turning in ((joint, self.task.robot.chain.joints[joint].turns) for joint in self.joints)
            for i in range(1, self.offset_values + 1)
        ]
        return [*listed, *([Variable("branch", 0.0, float(len(self.starts)), "1")] if len(self.starts) > 1 else [])]

    @cached_property
    def knot_rows(self) -> FloatArray:
        """Rows of the knots: growth of the shares of decided offsets, and the target; (lead + M, offset_values + w)."""
        decided = np.linspace(0.0, 1.0, self.offset_values)
        shares = scipy.interpolate.CubicSpline(decided, np.eye(self.offset_values))(np.array(self.motion.nodes))
        first = np.repeat(shares[:1] / STRIDES, STRIDES, axis=0)
        grown = np.concatenate([first, np.diff(shares, axis=0)])
        targets = np.array(self.targets)
        return np.column_stack([grown, np.concatenate([targets[:1].repeat(self.lead, axis=0), targets])])

    @property
    def lead(self) -> int:
        return STRIDES - 1

    def offsets(self, x: Matrix, share: Matrix) -> Matrix:
        """Offsets of all joints, (1, dof), by shares (1, offset_values) of the decided ones."""
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
        """Postures at the knots, (M, count dof), from several starts side by side, (1, count dof)."""
        knot, last = self._knot.map(count), self._last.map(count)
        found = []
        for row in self.knot_rows:
            rows = ca.repmat(ca.DM(row), 1, count)
            theta = knot(x, rows, theta)
            found.append(last(theta, rows[self.offset_values :, :]))
        return ca.vertcat(*found[self.lead :])

    @property
    def most_change(self) -> float:
        grown = float(np.abs(self.knot_rows[:, : self.offset_values]).sum(axis=1).max())
        return MOST_OFFSET * grown + LONGEST_STEP * (STEPS + 2 * LAST_STEPS)


def as_tuples(rows: FloatArray) -> tuple[tuple[float, ...], ...]:
    """The rows of an array."""
    return tuple(tuple(row) for row in rows.tolist())


SEED = 0  # of the random postures from which inverse kinematics starts: the same for every search
MOST_FOLLOWED = 64  # postures that are led along the path
MOST_STARTS = 8  # among which a search chooses
NULL_SINGULAR_VALUE = 1e-6  # relative: less moves nothing
IDLE = 1e-6  # m or rad per rad, by which a joint moves the tool that does not


def clear_postures(task: SpaceTracing, knots: PathKnots) -> FloatArray:
    """Postures with the tool at the first knot that touch nothing and that the motors can hold, (n, dof).

    Raises:
        InvalidProblem: inverse kinematics finds none, or every one touches something or cannot be held.
    """
    rotation = None if knots.rotations is None else knots.rotations[0]
    found = postures(task.robot, knots.points[0], rotation, np.random.default_rng(SEED))
    if not len(found):
        what = "point" if rotation is None else "pose"
        raise InvalidProblem("points", f"points[0]: inverse kinematics finds no posture with the tool at this {what}")
    times = ca.DM.zeros(len(found), 1)
    samples = Samples(robot=task.robot, derivatives=(ca.DM(found),), duration=ca.DM(1.0), times=times)
    clear = np.ones(len(found), dtype=bool)
    for limit in proximity_limits(task.robot, task.obstacles):
        clear &= (as_array(limit.clearances(samples)) >= task.robot.margin).all(axis=1)
    if not clear.any():
        raise InvalidProblem("points", f"points[0]: each of {len(found)} postures there touches something")
    held = can_hold(task.robot, found) & clear
    if not held.any():
        reason = overloaded(task.robot, found[clear][0])
        raise InvalidProblem("points", f"points[0]: none of {clear.sum()} clear postures there can be held; {reason}")
    return spread(found[held], MOST_FOLLOWED)


def spread(theta: FloatArray, most: int) -> FloatArray:
    """A limited number of the postures (n, dof), each as far as can be from those before it."""
    chosen = [0]
    away = np.abs(theta - theta[0]).max(axis=1)
    while len(chosen) < min(most, len(theta)):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.abs(theta - theta[chosen[-1]]).max(axis=1))
    return np.asarray(theta[chosen])


def best_starts(task: SpaceTracing, knots: PathKnots, theta: FloatArray, followed: FloatArray) -> FloatArray:
    """The few starts (m, dof) from which the path is followed farthest, and among those with the least turning.

    Args:
        task: whose robot.
        knots: of the path.
        theta: starts, (n, dof).
        followed: where they lead at all knots, (n, M, dof).
    """
    count, knots_count, dof = followed.shape
    tool = task.robot.tool.at(followed.reshape(-1, dof))[0].reshape(count, knots_count, -1)
    missed = (np.linalg.norm(tool - knots.points, axis=2) > task.accuracy).sum(axis=1)
    turning = np.abs(np.diff(followed, axis=1) / task.robot.limits.speed).max(axis=2).sum(axis=1)
    return np.asarray(theta[np.lexsort((turning, missed))[:MOST_STARTS]])


def wandering_joints(task: SpaceTracing, theta: FloatArray) -> tuple[int, ...]:
    """Joints that can wander off while the tool stays: as many as there are such motions, those that take part most.

    Args:
        task: whose robot.
        theta: postures, (n, dof).
    """
    rows = 3 if task.angular_accuracy is None else 6
    jacobians = [as_array(tool_jacobian(task.robot, ca.DM(posture).T))[:rows] for posture in theta]
    moving = np.abs(jacobians).max(axis=(0, 1)) > IDLE
    free, count = np.zeros((task.robot.dof,) * 2), 0
    for jacobian in jacobians:
        own = jacobian[:, moving]
        _, values, right = np.linalg.svd(own)
        rank = int((values > NULL_SINGULAR_VALUE * values[0]).sum())
        null = right[rank:]
        count = max(count, len(own[0]) - rank)
        free[np.ix_(moving, moving)] += null.T @ null
    _, _, order = scipy.linalg.qr(free, pivoting=True)
    return tuple(sorted(int(joint) for joint in order[:count]))
