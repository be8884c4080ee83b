"""Proofs that the tool keeps to its path, up to rounding in floating point.

Between the times at which two consecutive points are passed the tool has to stay within the accuracy of the line that
joins them. A cell of time is settled where what is measured in its middle and how much it can change within the cell
are together small enough; the others are halved. In the plane the tool travels no farther than its bodies do.

In space, in a cell of length h around its middle m, the tool is nowhere farther than A h^2 / 8 from
p(m) + p'(m) (t - m), where A bounds its acceleration; and distance from a line is convex, so that both ends of this
straight piece tell how far it is. What the tool is turned by changes no faster than its own angular velocity and that
of the path together; each is known at m, and changes by at most its own bound times h / 2. With levers L,

    A  = sum over j of L_j (|q_j''| + |q_j'| (|q_j'| + 2 sum over i < j of |q_i'|)),
    A' = sum over j of |q_j''| + |q_j'| sum over i < j of |q_i'|       for the angular velocity,

sums over i of joints that turn alone; bounds of |q'| and |q''| over a piece are Bernstein coefficients.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, as_array, bernstein
from problems.certify import TOLERANCE, CertificateStatus, Travel, Verdict, WorstIs, halves, peak_near
from problems.motions import Trajectory
from problems.robots import Orientations, Robot, SpatialArm, angles_between, tool_jacobian

INITIAL_CELLS = 1000
MAX_CELLS = 400_000


Measure: TypeAlias = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # of cells (n, 2): in middles, and bounds


def prove(
    quantity: tuple[str, str],
    bound: float,
    trajectory: Trajectory,
    at_points: tuple[FloatArray, FloatArray],
    measure: Measure,
) -> Verdict:
    """Halve cells until what is measured is proven, or seen not to be, within its bound.

    Args:
        quantity: its name and unit.
        bound: of it.
        trajectory: of the joints.
        at_points: times (n,) in s at which the points of the path are passed, and what is measured then, (n,).
        measure: of cells of time.
    """
    times, values = at_points
    edges = np.unique(np.append(trajectory.times(INITIAL_CELLS), times))
    cells, allowed = np.column_stack([edges[:-1], edges[1:]]), bound * (1.0 + TOLERANCE)
    worst, when = float(values.max()), float(times[int(np.argmax(values))])
    count, status = 0, CertificateStatus.CERTIFIED
    while len(cells) and worst <= allowed:
        count += len(cells)
        if count > MAX_CELLS:
            status = CertificateStatus.UNDECIDED
            break
        found, most = measure(cells)
        farthest = int(np.argmax(found))
        if found[farthest] > worst:
            worst, when = float(found[farthest]), float(cells[farthest].mean())
        cells = halves(cells[most > allowed])
    if worst > allowed:
        status = CertificateStatus.VIOLATED
    step = trajectory.duration / INITIAL_CELLS
    peak, at = peak_near(lambda t: measure(np.column_stack([t, t]))[0], when, step, trajectory.duration)
    worst, when = max((worst, when), (peak, at))
    name, unit = quantity
    where = f"tip, t = {when:.4g} s"
    return Verdict(name=name, worst=worst, bound=bound, unit=unit, status=status, where=where, worst_is=WorstIs.FOUND)


def prove_tracing(
    robot: Robot, points: FloatArray, accuracy: float, trajectory: Trajectory, times: FloatArray
) -> Verdict:
    """The verdict on the distance between the tool of a robot in the plane and its path.

    Args:
        robot: that moves.
        points: of the path, (n, dim), m.
        accuracy: the largest distance, m.
        trajectory: of the joints.
        times: at which the points are passed, not decreasing, the first 0, the last the duration; (n,), s.
    """
    travel = Travel(robot, trajectory)

    def measure(cells: FloatArray) -> tuple[FloatArray, FloatArray]:
        middles = cells.mean(axis=1)
        lines = segments_at(times, middles)
        tool = as_array(trajectory.samples(middles, robot).tool)
        away = distance_from_segments(tool, points[lines], points[lines + 1])
        return away, away + travel.of_bodies(cells)[:, -1]

    missed = np.hypot.reduce(robot.skeleton(trajectory.at(times))[:, -1] - points, axis=1)
    return prove(("accuracy", "m"), accuracy, trajectory, (times, missed), measure)


def segments_at(times: FloatArray, middles: FloatArray) -> NDArray[np.intp]:
    """The number of the line on which the tool is at times (n,), given when the points are passed."""
    return np.clip(np.searchsorted(times, middles, side="right") - 1, 0, len(times) - 2)


def distance_from_segments(points: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Distances (n,) in m of points from straight lines, each (n, dim)."""
    along = ends - starts
    share = np.einsum("nd,nd->n", points - starts, along) / np.einsum("nd,nd->n", along, along)
    nearest = starts + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.asarray(np.hypot.reduce(points - nearest, axis=1))


@dataclass(frozen=True)
class ToolMotion:
    """The tool of an arm that moves.

    Args:
        robot: the arm.
        trajectory: of its joints.
    """

    robot: SpatialArm
    trajectory: Trajectory

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds of the tool's acceleration, m/s^2, and angular acceleration, rad/s^2, in each piece, (pieces,)."""
        durations = np.diff(self.trajectory.breakpoints)
        first, second = (
            np.abs(bernstein(np.asarray(self.trajectory.derivative(order).c), durations)).max(axis=0)
            for order in (1, 2)
        )
        turning = np.array([joint.turns for joint in self.robot.chain.joints], dtype=float)
        before = np.cumsum(first * turning, axis=1) - first * turning
        linear = (second + first * (first + 2.0 * before)) @ self.robot.tool.levers
        return linear, np.asarray((second + first * before) @ turning)

    @cached_property
    def _velocity(self) -> ca.Function:
        theta, rate = ca.SX.sym("theta", 1, self.robot.dof), ca.SX.sym("rate", 1, self.robot.dof)
        return ca.Function("velocity", [theta.T, rate.T], [tool_jacobian(self.robot, theta) @ rate.T])

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Positions (n, 3), rotations (n, 3, 3), velocities (n, 3) and angular velocities (n, 3) at times (n,), s."""
        theta, rates = self.trajectory.at(times), self.trajectory.at(times, 1)
        velocity = as_array(self._velocity.map(len(times))(theta.T, rates.T)).T
        return *self.robot.tool.at(theta), velocity[:, :3], velocity[:, 3:]

    def bounds_in(self, middles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The bounds of the pieces in which times (n,) lie, both (n,)."""
        pieces = np.searchsorted(self.trajectory.breakpoints, middles, side="right") - 1
        chosen = np.clip(pieces, 0, self.trajectory.breakpoints.size - 2)
        return self.bounds[0][chosen], self.bounds[1][chosen]


@dataclass(frozen=True)
class TracedTool:
    """A tool that traces a path.

    Args:
        motion: of the tool.
        points: of the path, (n, 3), m.
        times: at which they are passed, not decreasing, the first 0, the last the duration; (n,), s.
        orientations: at the points; None where they are free.
    """

    motion: ToolMotion
    points: FloatArray
    times: FloatArray
    orientations: Orientations | None = None

    def prove_position(self, accuracy: float) -> Verdict:
        """The verdict on the distance from the path, m."""
        tool = self.motion.robot.tool.at(self.motion.trajectory.at(self.times))[0]
        away = np.linalg.norm(tool - self.points, axis=1)
        return prove(("accuracy", "m"), accuracy, self.motion.trajectory, (self.times, away), self._distances)

    def prove_orientation(self, accuracy: float) -> Verdict:
        """The verdict on the angle to the orientation of the path, rad."""
        assert self.orientations is not None
        turned = self.motion.robot.tool.at(self.motion.trajectory.at(self.times))[1]
        away = angles_between(turned, self.orientations.matrices)
        return prove(("angular accuracy", "rad"), accuracy, self.motion.trajectory, (self.times, away), self._angles)

    def _distances(self, cells: FloatArray) -> tuple[FloatArray, FloatArray]:
        middles, half = cells.mean(axis=1), np.diff(cells, axis=1) / 2.0
        segments = segments_at(self.times, middles)
        position, _, velocity, _ = self.motion.at(middles)
        line = self.points[segments], self.points[segments + 1]
        found = distance_from_segments(position, *line)
        ends = [distance_from_segments(position + side * half * velocity, *line) for side in (-1.0, 1.0)]
        bent = self.motion.bounds_in(middles)[0] * half[:, 0] ** 2 / 2.0
        return found, np.maximum(*ends) + bent

    def _angles(self, cells: FloatArray) -> tuple[FloatArray, FloatArray]:
        assert self.orientations is not None
        middles, half = cells.mean(axis=1), np.diff(cells, axis=1)[:, 0] / 2.0
        segments = segments_at(self.times, middles)
        position, rotation, velocity, spin = self.motion.at(middles)
        line = self.points[segments + 1] - self.points[segments]
        square = np.einsum("nd,nd->n", line, line)
        share = np.einsum("nd,nd->n", position - self.points[segments], line) / square
        wanted = self.orientations.along(segments, np.clip(share, 0.0, 1.0))
        found = angles_between(rotation, wanted)
        turning = self.orientations.angles[segments] / np.sqrt(square)  # of the path, rad/m
        linear, angular = self.motion.bounds_in(middles)
        rate = np.linalg.norm(spin, axis=1) + turning * np.linalg.norm(velocity, axis=1)
        return found, found + rate * half + (angular + turning * linear) * half**2 / 2.0
