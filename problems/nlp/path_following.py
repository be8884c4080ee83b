"""The nonlinear program of following a path, sparse.

Variables: joint angles and their second derivatives at the nodes of the spline, and t_T where time matters. That the
pieces join smoothly are linear equalities between neighbours, that knots lie on the path forward kinematics; no
acos, no root, no edge. Accelerations are extreme at nodes, so their limit holds for all t. Rotation and length do not
depend on how long the motion takes: its duration is then 1, and the exact time scaling of a solution restores the
limits.

With free redundancy every knot chooses its own redundancy angles, a larger problem than the search vector's few
values x_phi; ``knot_redundancy="values"`` keeps to these, but may not run into the ends of their range, as a cut-off
interpolation does. With ``elbow`` up or down theta_2 stays in that half at the knots; free, it may even change on the
way, which no search vector can.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from problems.assembly.path_following import PathFollowing
from problems.base.matrix import FloatArray, Matrix, as_array, constant, total
from problems.limits.constraint import Constraint
from problems.limits.motion_limits import acceleration_limit, motion_constraints, speed_limit, step_limit
from problems.motions.rest_spline import RestSpline
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.nlp.point_to_point import TIMELESS
from problems.nlp.program import NonlinearProgram, equality, rotation_rows, smooth_length
from problems.robots.redundancy import restore
from problems.tasks.checks import narrow_elbow

SPEED_SAMPLES = 4  # between two nodes; what they miss of a speed, up to 2 %, the time scaling makes up
INSIDE = 1e-3  # how far interpolated x_phi keep from the ends of [0, 1], where (7) has infinite slope
JOINS = "speed before = speed after at the nodes, 0 at both ends; in angles and second derivatives"
ON_PATH = "tip(theta) = P* at every knot"


class NodeForm:
    """A cubic C2 spline written in angles and second derivatives at its nodes.

    Args:
        spline: whose nodes.
    """

    def __init__(self, spline: RestSpline) -> None:
        self.nodes = spline.nodes
        self.steps = np.diff(spline.nodes)
        self.unit = float(self.steps.mean()) ** 2  # scales second derivatives to rad
        self.knots = [int(np.argmin(np.abs(spline.nodes - u))) for u in spline.knots]

    def samples(self, angles: Matrix, bends: Matrix, u: FloatArray) -> tuple[Matrix, Matrix, Matrix]:
        """Angles, speeds and accelerations (n, k) at u (n,), from angles and scaled second derivatives (nodes, k)."""
        i = np.clip(np.searchsorted(self.nodes, u, side="right") - 1, 0, self.steps.size - 1)
        h = self.steps[i]
        b = (u - self.nodes[i]) / h
        a = 1.0 - b
        of_angles = ((a, b), (-1.0 / h, 1.0 / h), (0.0 * a, 0.0 * b))
        of_bends = (
            ((a**3 - a) * h**2 / 6.0, (b**3 - b) * h**2 / 6.0),
            (-(3.0 * a**2 - 1.0) * h / 6.0, (3.0 * b**2 - 1.0) * h / 6.0),
            (a, b),
        )
        first, second, third = (
            ca.mtimes(self._between(i, *pair), angles) + ca.mtimes(self._between(i, *bend), bends) / self.unit
            for pair, bend in zip(of_angles, of_bends, strict=True)
        )
        return first, second, third

    def _between(self, i: np.ndarray, left: FloatArray, right: FloatArray) -> ca.DM:
        matrix = np.zeros((i.size, self.nodes.size))
        rows = np.arange(i.size)
        matrix[rows, i], matrix[rows, i + 1] = left, right
        return constant(matrix)

    def joins(self, angles: Matrix, bends: Matrix) -> Matrix:
        """Zero (nodes, k) when speeds are continuous at the inner nodes and zero at both ends; rad."""
        h, n = self.steps, self.nodes.size
        slopes, curvature = np.zeros((n, n)), np.zeros((n, n))
        for i in range(n):
            if i > 0:  # the speed at the end of the piece before
                slopes[i, i - 1 : i + 1] += np.array([-1.0, 1.0]) / h[i - 1]
                curvature[i, i - 1 : i + 1] += np.array([1.0, 2.0]) * h[i - 1] / 6.0
            if i < n - 1:  # less the speed at the start of the piece after
                slopes[i, i : i + 2] -= np.array([-1.0, 1.0]) / h[i]
                curvature[i, i : i + 2] += np.array([2.0, 1.0]) * h[i] / 6.0
        scale = float(np.sqrt(self.unit))
        return ca.mtimes(constant(slopes * scale), angles) + ca.mtimes(constant(curvature * scale / self.unit), bends)


@dataclass(frozen=True)
class PathNlp(NonlinearProgram):
    """Lead the tip along a path.

    Args:
        problem: whose path, limits and obstacles hold.
    """

    problem: PathFollowing

    @property
    def timed(self) -> bool:
        """Whether t_T is a variable."""
        return self.problem.objective == "time"

    @cached_property
    def form(self) -> NodeForm:
        """The spline's nodes."""
        return NodeForm(self.problem.spline)

    @property
    def sizes(self) -> list[int]:
        """How many variables: angles, second derivatives at inner nodes, t_T, x_phi, slacks."""
        nodes, k = self.form.nodes.size, self.problem.arm.links
        values = self.problem.extra * self.problem.redundancy_values if self.problem.knot_redundancy == "values" else 0
        slacks = k * (self.problem.grid.size - 1) if self.problem.objective == "rotation" else 0
        return [nodes * k, (nodes - 2) * k, int(self.timed), values, slacks]

    @cached_property
    def x(self) -> ca.SX:
        """Angles at the nodes, scaled second derivatives at the inner nodes, t_T, x_phi, slacks of the rotation."""
        return ca.SX.sym("x", sum(self.sizes))

    @property
    def names(self) -> tuple[str, ...]:
        """Angles and second derivatives by joint and node, t_T, x_phi, slacks."""
        nodes, joints = range(self.form.nodes.size), range(1, self.problem.arm.links + 1)
        angles = [f"theta_{joint}[{node}]" for joint in joints for node in nodes]
        bends = [f"d2theta_{joint}[{node}]" for joint in joints for node in nodes[1:-1]]
        time, values, slacks = self.sizes[2:]
        numbered = [("x_phi", values), ("slack", slacks)]
        return (*angles, *bends, *["t_T"] * time, *(f"{s}[{i}]" for s, n in numbered for i in range(1, n + 1)))

    def split(self, x: Matrix) -> tuple[Matrix, Matrix, Matrix, Matrix, Matrix]:
        """Angles (nodes, k), second derivatives (nodes, k), t_T (1 where it is no variable), x_phi, slacks."""
        k = self.problem.arm.links
        angles, bends, time, values, slack = ca.vertsplit(x, np.cumsum([0, *self.sizes]).tolist())
        rest = ca.DM.zeros(1, k)
        bends = ca.vertcat(rest, ca.reshape(bends, -1, k), rest)
        return ca.reshape(angles, -1, k), bends, time if self.timed else ca.DM(1.0), values, ca.reshape(slack, -1, k)

    @cached_property
    def _motion(self) -> Samples:
        angles, bends, time, _, _ = self.split(self.x)
        theta, speed, acceleration = self.form.samples(angles, bends, self.problem.grid)
        return Samples(theta, speed / time, acceleration / time**2, time)

    @cached_property
    def f(self) -> Matrix:
        """The objective: t_T, the sum of the slacks, or the smoothed length."""
        if self.problem.objective == "length":
            return smooth_length(self.problem.arm, self._motion)
        return self._motion.duration if self.timed else total(self.split(self.x)[-1])

    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        """Joints of the pieces, knots on the path, accuracy, the limits that time scaling does not restore."""
        arm, task = self.problem.arm, self.problem
        angles, bends, _, _, slack = self.split(self.x)
        joints = [f"joint {joint}" for joint in range(1, arm.links + 1)]
        knots = ca.DM(task.path.array[list(task.knot_indices)])
        rows = [
            equality("spline", self.form.joins(angles, bends), "rad", joints, JOINS),
            equality("tip at the knots", arm.tip(angles[self.form.knots, :]) - knots, "m", ("x", "y"), ON_PATH),
        ]
        if self.problem.knot_redundancy == "values":
            rows += self._redundancy_rows()
        others = [index for index in range(len(task.path.points)) if index not in task.knot_indices]
        if others:
            theta, _, _ = self.form.samples(angles, bends, task.parameters[others])
            rows.append(task.accuracy_limit(arm.tip(theta), others))
        if self.timed:
            rows += self._time_rows()
        limits = motion_constraints(arm, task.obstacles, self._motion, margin)
        rows += [limit for limit in limits if limit.name not in TIMELESS]
        if task.obstacles:
            rows.append(step_limit(arm, task.obstacles, self._motion))
        if task.objective == "rotation":
            rows += rotation_rows(arm, self._motion, slack)
        return tuple(rows)

    def _time_rows(self) -> list[Constraint]:
        """Acceleration at the nodes, which is exact; speed at the nodes and between."""
        angles, bends, time, _, _ = self.split(self.x)
        _, _, at_nodes = self.form.samples(angles, bends, self.form.nodes[1:-1])
        shares = np.arange(1, SPEED_SAMPLES + 1) / SPEED_SAMPLES
        inner = (self.form.nodes[:-1, None] + self.form.steps[:, None] * shares).ravel()[:-1]
        _, speed, _ = self.form.samples(angles, bends, inner)
        arm, nothing = self.problem.arm, ca.DM()
        return [
            acceleration_limit(arm, Samples(nothing, nothing, at_nodes / time**2, time)),
            speed_limit(arm, Samples(nothing, speed / time, nothing, time)),
        ]

    def _redundancy_rows(self) -> list[Constraint]:
        """The orientations of links 3..k at the knots are those of (7), up to whole turns; x_phi stays inside."""
        angles, _, _, values, _ = self.split(self.x)
        task = self.problem
        share = task.interpolated_redundancy(values)
        psi = ca.cumsum(angles[self.form.knots, :], 1)[:, 2:]
        phi = [
            restore(task.arm, ca.DM(task.path.points[i]), share[row, :].T).T for row, i in enumerate(task.knot_indices)
        ]
        links = tuple(f"link {link}" for link in range(3, task.arm.links + 1))
        low, high = np.full(task.extra, INSIDE), np.full(task.extra, 1.0 - INSIDE)
        half = (psi - ca.vertcat(*phi)) / 2.0
        return [
            equality("redundancy", ca.sin(half), "1", links, "psi_j = phi_j of (7) at every knot, up to whole turns"),
            Constraint(
                "x_phi",
                "(7)",
                "1",
                share,
                low,
                high,
                links,
                np.ones(task.extra),
                for_all_t=False,
                formula="0 < x_phi interpolated at the knots < 1",
            ),
        ]

    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elbow and joint limits on the angles, the least time, [0, 1]; the rest is free."""
        task, nodes = self.problem, self.form.nodes.size
        lower, upper = np.full(x.size, -np.inf), np.full(x.size, np.inf)
        if task.arm.joint_limits is not None:
            ranges = np.repeat(np.array(task.arm.joint_limits), nodes, axis=0)
            lower[: len(ranges)], upper[: len(ranges)] = ranges.T
        for knot in self.form.knots:
            narrow_elbow(task.elbow, x, nodes + knot, lower, upper)  # theta_2 is the second column
        time, values, slacks = (int(first) for first in np.cumsum(self.sizes)[1:4])
        lower[time:values] = task.time_box[0]
        lower[values:slacks], upper[values:slacks] = 0.0, 1.0
        lower[slacks:] = 0.0
        return lower, upper

    def from_search(self, x: FloatArray) -> FloatArray:
        """The spline of a search vector, and its x_phi."""
        return self._variables(self.problem.trajectory(x), x[: self.problem.extra * self.problem.redundancy_values])

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """The spline itself; x_phi, which it does not tell, in the middle."""
        return self._variables(trajectory, np.full(self.problem.extra * self.problem.redundancy_values, 0.5))

    def _variables(self, trajectory: Trajectory, values: FloatArray) -> FloatArray:
        at_nodes = trajectory.samples(self.form.nodes * trajectory.duration)
        theta, bend = (
            as_array(at_nodes.theta),
            as_array(at_nodes.acceleration) * trajectory.duration**2 * self.form.unit,
        )
        grid = as_array(trajectory.samples(self.problem.grid * trajectory.duration).theta)
        slack = np.abs(np.diff(grid, axis=0))
        parts = [theta, bend[1:-1], np.array([trajectory.duration]), values, slack]
        return np.concatenate([part.ravel(order="F")[:size] for part, size in zip(parts, self.sizes, strict=True)])

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        """Random x_phi and, where it is free, elbow; postures follow by inverse kinematics."""
        reduced = replace(self.problem, formulation="reduced")
        lower, upper = reduced.bounds
        while True:
            yield replace(self, problem=reduced).from_search(rng.uniform(lower, upper))

    def _knot_angles(self, x: FloatArray) -> FloatArray:
        """Joint angles at the knots (M, k), each posture exactly on its point."""
        angles = self.split(ca.DM(x))[0]
        points = self.problem.path.points
        knots = zip(self.form.knots, self.problem.knot_indices, strict=True)
        projected = [self.problem.arm.project_to_point(angles[node, :], ca.DM(points[index])) for node, index in knots]
        return as_array(ca.vertcat(*projected))

    def trajectory(self, x: FloatArray) -> Trajectory:
        """The spline through a solution's knots, as fast as the limits allow for all t."""
        shape = self.problem.spline.coefficients(ca.DM(self._knot_angles(x)))
        unit = self.problem.spline_trajectory(shape, 1.0)
        return unit.time_scaled(max(self.problem.time_box[0], unit.safe_time_scale(self.problem.arm)))

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """Redundancy angles phi at the knots and t_T of a solution, after time scaling."""
        phi = np.cumsum(self._knot_angles(x), axis=1)[:, 2:]
        return self.problem.named_quantities(phi, self.trajectory(x).duration)
