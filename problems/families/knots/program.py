"""The nonlinear program.

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

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, constant
from problems.certify import safe_time_scale
from problems.families.knots.encoding import KnotsEncoding
from problems.families.knots.motion import KnotSpline, NodeForm, knot_operators
from problems.families.knots.starts import PathStarts
from problems.families.two_segments import AXES
from problems.limits import Accuracy, Constraint, Limit, StepLimit, minimum_time_scale, peaks_of
from problems.motions import Samples, SplineShape, Trajectory
from problems.objectives import Objective
from problems.programs import MAX_ANGLE_CHANGE, MotionProgram, equality, slack_constraints
from problems.robots import Robot
from problems.tasks import PathFollowing, narrow_elbow

REDUNDANCY_MARGIN = 1e-3  # distance of interpolated x_phi from the ends of [0, 1], where (7) has infinite slope


def redundancy_rows(encoding: KnotsEncoding, theta: Matrix, values: Matrix) -> list[Constraint]:
    """The orientations of links 3..k at the knots are those of (7), up to whole turns; x_phi stays inside.

    Args:
        encoding: whose knots.
        theta: joint angles at the knots, (M, k), rad.
        values: of x_phi, (redundancy_values (k - 2), 1).
    """
    robot = encoding.task.robot
    extra = robot.closed_form.redundancy
    share = ca.mtimes(constant(encoding.interpolation), ca.reshape(values, -1, extra))
    at_zero = ca.repmat(ca.DM(robot.closed_form.redundant_values(np.zeros((1, robot.dof)))), theta.shape[0], 1)
    psi = ca.cumsum(theta, 1)[:, 2:] + at_zero
    points = enumerate(encoding.knot_points)
    phi = [robot.closed_form.restore_redundancy(ca.DM(point), share[row, :].T).T for row, point in points]
    links = tuple(f"link {link}" for link in range(3, 3 + extra))
    half = (psi - ca.vertcat(*phi)) / 2.0
    return [
        equality("redundancy", ca.sin(half), "1", links, "psi_j = phi_j of (7) at every knot, up to whole turns"),
        Constraint(
            name="x_phi",
            equation="(7)",
            unit="1",
            expression=share,
            lower=ca.DM(np.full((1, extra), REDUNDANCY_MARGIN)),
            upper=ca.DM(np.full((1, extra), 1.0 - REDUNDANCY_MARGIN)),
            columns=links,
            for_all_t=False,
            formula="0 < x_phi interpolated at the knots < 1",
        ),
    ]


SPEED_SAMPLES, FINER_SAMPLES = 1, 6  # an interval between nodes
JOINS = "speed before = speed after at the nodes, 0 at both ends; in angles and second derivatives"
ON_PATH = "tip(theta) = P* at every knot"


@dataclass(frozen=True)
class PathNlp(MotionProgram):
    """The nonlinear program of a path: lead the tip along it.

    Args:
        task: the statement: robot, path, accuracy, obstacles.
        motion: that is sought.
        encoding: of a search vector, whose redundancy values may be kept to.
        objective: what is minimised.
        limits: what holds.
        decode: the trajectory of a search vector (d,).
        speed_samples: in an interval between nodes; what they miss of a speed the time scaling makes up.
    """

    task: PathFollowing
    motion: KnotSpline
    encoding: KnotsEncoding
    objective: Objective
    limits: tuple[Limit, ...]
    decode: Callable[[FloatArray], Trajectory]
    speed_samples: int = SPEED_SAMPLES

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @cached_property
    def form(self) -> NodeForm:
        """The spline written in its nodes."""
        return NodeForm(self.motion.spline)

    @property
    def sizes(self) -> list[int]:
        """How many variables: angles, second derivatives at inner nodes, t_T, x_phi, slacks."""
        nodes, k = self.form.nodes.size, self.robot.dof
        values = self.value_count if self.task.knot_redundancy == "values" else 0
        slacks = self.objective.slack_count(self.robot, self.motion.parameters_u.size - 1)
        return [nodes * k, (nodes - 2) * k, int(self.has_free_durations), values, slacks]

    @property
    def value_count(self) -> int:
        """Redundancy values of a search vector."""
        return self.robot.closed_form.redundancy * self.encoding.redundancy_values

    @cached_property
    def x(self) -> ca.SX:
        """Angles at the nodes, scaled second derivatives at the inner nodes, t_T, x_phi, slacks of the rotation."""
        return ca.SX.sym("x", sum(self.sizes))

    @property
    def names(self) -> tuple[str, ...]:
        nodes, joints = range(self.form.nodes.size), range(1, self.robot.dof + 1)
        angles = [f"theta_{joint}[{node}]" for joint in joints for node in nodes]
        bends = [f"d2theta_{joint}[{node}]" for joint in joints for node in nodes[1:-1]]
        time, values, slacks = self.sizes[2:]
        numbered = [("x_phi", values), ("slack", slacks)]
        return (*angles, *bends, *["t_T"] * time, *(f"{s}[{i}]" for s, n in numbered for i in range(1, n + 1)))

    def split(self, x: Matrix) -> tuple[Matrix, Matrix, Matrix, Matrix, Matrix]:
        """Angles (nodes, k), second derivatives (nodes, k), t_T (1 where it is no variable), x_phi, slacks."""
        k = self.robot.dof
        angles, bends, time, values, slack = ca.vertsplit(x, np.cumsum([0, *self.sizes]).tolist())
        rest = ca.DM.zeros(1, k)
        bends = ca.vertcat(rest, ca.reshape(bends, -1, k), rest)
        return (
            ca.reshape(angles, -1, k),
            bends,
            time if self.has_free_durations else ca.DM(1.0),
            values,
            ca.reshape(slack, -1, k),
        )

    @cached_property
    def _motion(self) -> Samples:
        angles, bends, time, _, _ = self.split(self.x)
        values = self.form.samples(angles, bends, self.motion.parameters_u)
        return Samples(
            robot=self.robot,
            derivatives=tuple(value / time**order for order, value in enumerate(values)),
            duration=time,
            times=ca.DM(self.motion.parameters_u) * time,
            weights=ca.DM(self.motion.weights_u) * time,
        )

    @cached_property
    def f(self) -> Matrix:
        return self.objective.smooth(self._motion, self.split(self.x)[-1]) / self.objective_size

    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        """Joints of the pieces, knots on the path, accuracy, the limits that time scaling does not restore."""
        angles, bends, time, _, slack = self.split(self.x)
        points = ca.DM(self.encoding.knot_points)
        on_path = self.robot.tool.position(angles[self.form.knots, :]) - points
        rows = [
            equality("spline", self.form.joins(angles, bends), "rad", self.robot.joints.names, JOINS),
            equality("tip at the knots", on_path, "m", AXES[: self.robot.dim], ON_PATH, self.robot.length_unit),
        ]
        if self.task.knot_redundancy == "values":
            at_knots = angles[self.form.knots, :]
            rows += redundancy_rows(self.encoding, at_knots, self.split(self.x)[3])
        rows += self._accuracy_rows()
        exact = self._exact_rows()
        rows += [row for limit in exact for row in exact[limit]] if self.has_free_durations else []
        for limit in self.sampled_limits:
            if limit not in exact:
                rows += limit.constraints(self._motion, margin)
        rows += self.duration_rows(time, margin)
        step = StepLimit.for_robot(self.robot, self.task.obstacles)
        rows += [] if step is None else step.constraints(self._motion)
        return (*rows, *slack_constraints(self.objective, self._motion, slack))

    def _accuracy_rows(self) -> list[Constraint]:
        """The accuracy (24) at the points that are no knots."""
        angles, bends, _, _, _ = self.split(self.x)
        others = [index for index in range(len(self.task.path.points)) if index not in self.task.knot_indices]
        if not others:
            return []
        theta, *_ = self.form.samples(angles, bends, self.motion.point_parameters[others])
        return [Accuracy(self.task.accuracy).at(self.robot.tool.position(theta), ca.DM(self.task.path.array[others]))]

    def _exact_rows(self) -> dict[Limit, list[Constraint]]:
        """Limits that need other samples: acceleration at the nodes, which is exact; speed at nodes and between."""
        angles, bends, time, _, _ = self.split(self.x)
        _, _, at_nodes, _ = self.form.samples(angles, bends, self.form.nodes[1:-1])
        shares = np.arange(1, self.speed_samples + 1) / self.speed_samples
        inner = (self.form.nodes[:-1, None] + self.form.steps[:, None] * shares).ravel()[:-1]
        _, speed, _, _ = self.form.samples(angles, bends, inner)
        moments = Samples(robot=self.robot, derivatives=(angles, speed / time, at_nodes / time**2), duration=time)
        chosen = sorted(
            (limit for limit in self.limits if limit.order in (1, 2)), key=lambda limit: -(limit.order or 0)
        )
        return {limit: limit.constraints_at(moments) for limit in chosen}

    def finer(self) -> PathNlp:
        return replace(self, speed_samples=FINER_SAMPLES)

    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elbow and joint limits on the angles, the least time, [0, 1]; the rest is free.

        Without joint limits an angle stays within ``MAX_ANGLE_CHANGE`` of where it starts.
        """
        task, nodes = self.task, self.form.nodes.size
        lower, upper = np.full(x.size, -np.inf), np.full(x.size, np.inf)
        angles = slice(0, nodes * self.robot.dof)
        lower[angles], upper[angles] = x[angles] - MAX_ANGLE_CHANGE, x[angles] + MAX_ANGLE_CHANGE
        if self.robot.limits.position is not None:
            ranges = np.repeat(np.array(self.robot.limits.position), nodes, axis=0)
            lower[: len(ranges)], upper[: len(ranges)] = ranges.T
        for knot in self.form.knots:
            narrow_elbow(task.robot, task.elbow, x, nodes + knot, lower, upper)  # theta_2 is the second column
        time, values, slacks = (int(first) for first in np.cumsum(self.sizes)[1:4])
        lower[time:values] = self.encoding.time_box[0]
        lower[values:slacks], upper[values:slacks] = 0.0, 1.0
        lower[slacks:] = 0.0
        return lower, upper

    def from_search(self, x: FloatArray) -> FloatArray:
        return self._variables(self.decode(x), x[: self.value_count])

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        return self._variables(trajectory, np.full(self.value_count, 0.5))

    def _variables(self, trajectory: Trajectory, values: FloatArray) -> FloatArray:
        at_nodes = self.form.nodes * trajectory.duration
        bends = trajectory.at(at_nodes, 2) * trajectory.duration**2
        grid = trajectory.at(self.motion.parameters_u * trajectory.duration)
        return self._joined(trajectory.at(at_nodes), bends, trajectory.duration, values, grid)

    def _joined(
        self, angles: FloatArray, bends: FloatArray, duration: float, values: FloatArray, grid: FloatArray
    ) -> FloatArray:
        """The variables (n,) of angles and second derivatives at the nodes, t_T, x_phi and the angles on the grid."""
        slack = self.objective.slack_values(grid)
        parts = [angles, bends[1:-1] * self.form.unit, np.array([duration]), values, slack]
        return np.concatenate([part.ravel(order="F")[:size] for part, size in zip(parts, self.sizes, strict=True)])

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        limits = self.encoding.exact_limits(self.limits)
        for knots, x_phi in self._starts.sequence(rng):
            angles, bends, speeds, grid = (operator @ knots for operator in self._operators)
            jerks = np.diff(bends, axis=0) / self.form.steps[:, None]
            each = (ca.DM(), ca.DM(speeds), ca.DM(bends), ca.DM(jerks))
            extremes = Samples(robot=self.robot, derivatives=each, duration=ca.DM(1))
            peaks = [peaks_of(limit, extremes) for limit in limits]
            time = float(minimum_time_scale(limits, peaks)) if limits else 0.0
            yield self._joined(angles, bends, max(self.encoding.time_box[0], time), x_phi, grid)

    @cached_property
    def _operators(self) -> tuple[FloatArray, ...]:
        """Matrices from knot angles to angles and second derivatives at the nodes, and speeds and angles on a grid."""
        nodes, grid = self.form.nodes, self.motion.parameters_u
        return knot_operators(self.motion.spline, (nodes, 0), (nodes, 2), (grid, 1), (grid, 0))

    @cached_property
    def _starts(self) -> PathStarts:
        return PathStarts(self.encoding, self.objective)

    def _knot_angles(self, x: FloatArray) -> FloatArray:
        """Joint angles at the knots (M, k), each posture exactly on its point."""
        nodes = self.form.nodes.size
        angles = x[: nodes * self.robot.dof].reshape(-1, nodes).T
        return self._starts.postures.nearest(angles[self.form.knots])

    @cached_property
    def _shape(self) -> ca.Function:
        """Spline coefficients of the angles at the knots."""
        angles = ca.SX.sym("theta", len(self.form.knots), self.robot.dof)
        return ca.Function("shape", [angles], [self.motion.spline.coefficients(angles)])

    def trajectory(self, x: FloatArray) -> Trajectory:
        unit = self.motion.trajectory(SplineShape(self._shape(self._knot_angles(x)), ca.DM(1.0)))
        least = safe_time_scale(self.limits, unit)
        if self.depends_on_speed or not self.objective.sooner_is_better:
            least = max(least, float(self.split(ca.DM(x))[2]))
        return unit.time_scaled(max(self.encoding.time_box[0], least))

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        phi = self.robot.closed_form.redundant_values(self._knot_angles(x))
        return self.motion.quantities(phi, self.trajectory(x).duration)
