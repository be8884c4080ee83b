"""The same costs written by hand for arrays, the way one would without CasADi: NumPy, or JAX with the same lines.

What ``benchmarks.population`` measures against. One candidate (d,), or many (..., d) at once. Elbow up or down, no
joint limits; a path is for three links.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from problems import Ellipse, PathFollowingProblem, PlanarArm, PointToPointProblem, Problem
from problems.families.two_segments.motion import QUARTIC, QUINTIC
from problems.limits import SAMPLING_MARGIN, reachable_pairs
from problems.motions import sampling_matrix
from problems.scene import Obstacle

Array = Any  # numpy.ndarray | jax.Array
Cost = Callable[[Array], Array]


def array_cost(problem: Problem[Any], xp: ModuleType) -> Cost:
    """The cost of candidates (..., d) -> (...).

    Args:
        problem: what is planned.
        xp: ``numpy`` or ``jax.numpy``.
    """
    if isinstance(problem, PointToPointProblem):
        return PointToPointCost(problem, xp)
    assert isinstance(problem, PathFollowingProblem)
    return PathCost(problem, xp)


class Kinematics:
    """Forward and inverse kinematics, limits and obstacles on arrays."""

    def __init__(self, problem: PointToPointProblem | PathFollowingProblem, xp: ModuleType) -> None:
        robot = problem.criteria.robot
        assert isinstance(robot, PlanarArm)
        self.xp, self.measure = xp, problem.criteria.objective.name
        self.reduced, self.ceiling = problem.encoding.scales_time, problem.objective_upper_bound
        self.weights = problem.weights
        self.lengths = np.array(robot.link_lengths)
        self.speed, self.acceleration = np.array(robot.max_speed), np.array(robot.max_acceleration)
        self.reaches = [robot.reach(link) for link in range(1, robot.links + 1)]
        self.elbow = -1.0 if problem.encoding.task.elbow == "down" else 1.0
        self.margin = SAMPLING_MARGIN * self.lengths.sum()
        self.pairs = reachable_pairs(robot, problem.criteria.obstacles, self.margin)

    def inverse(self, x: Array, y: Array, phi: Array) -> tuple[Array, Array]:
        """Joint angles (..., k) and cos(theta_2) (...) of tip (...) and redundancy angles (..., k - 2)."""
        xp, (l1, l2) = self.xp, self.lengths[:2]
        x = x - (self.lengths[2:] * xp.cos(phi)).sum(-1)
        y = y - (self.lengths[2:] * xp.sin(phi)).sum(-1)
        cosine = (x * x + y * y - l1**2 - l2**2) / (2.0 * l1 * l2)
        clipped = xp.clip(cosine, -1.0, 1.0)
        sine = self.elbow * xp.sqrt(1.0 - clipped * clipped)
        theta_1 = xp.arctan2(y, x) - xp.arctan2(l2 * sine, l1 + l2 * clipped)
        theta_2 = xp.arctan2(sine, clipped)
        psi = xp.concatenate([(theta_1 + theta_2)[..., None], phi], -1)
        rest = psi[..., 1:] - psi[..., :-1]
        return xp.concatenate([theta_1[..., None], theta_2[..., None], rest], -1), cosine

    def restore(self, x: Array, y: Array, normalised: Array) -> Array:
        """Redundancy angles (7) of normalised ones (..., k - 2) for the tip (...)."""
        xp, phi = self.xp, []
        for link in range(self.lengths.size - 1, 1, -1):
            inner, outer = self.reaches[link - 1]
            length = self.lengths[link]
            rho = xp.sqrt(x * x + y * y)
            square, scale = rho * rho + length**2, xp.maximum(2.0 * length * rho, 1e-300)
            beta_in, beta_out = (xp.arccos(xp.clip((square - r * r) / scale, -1.0, 1.0)) for r in (inner, outer))
            share = 2.0 * normalised[..., link - 2] - 1.0
            side = xp.where(share < 0.0, -1.0, 1.0)
            phi.append(xp.arctan2(y, x) + side * beta_in + share * (beta_out - beta_in))
            x, y = x - length * xp.cos(phi[-1]), y - length * xp.sin(phi[-1])
        return xp.stack(phi[::-1], -1)

    def turned(self, angle: Array, reference: Array | float) -> Array:
        """Within half a turn of the reference."""
        turns = self.xp.ceil((angle - reference - np.pi) / (2.0 * np.pi))
        return angle - 2.0 * np.pi * turns

    def joints(self, theta: Array) -> tuple[Array, Array]:
        """Joint positions (..., k) of postures (..., k), the base left out."""
        psi = self.xp.cumsum(theta, -1)
        return (self.xp.cumsum(self.lengths * f(psi), -1) for f in (self.xp.cos, self.xp.sin))  # type: ignore[return-value]

    def objective(self, theta: Array, x: Array, y: Array, time: Array) -> Array:
        """Least time, rotation or length; postures (..., n, k), tips (..., n)."""
        if self.measure == "time":
            return time
        if self.measure == "rotation":
            return self.xp.abs(theta[..., 1:, :] - theta[..., :-1, :]).sum((-1, -2))
        dx, dy = x[..., 1:] - x[..., :-1], y[..., 1:] - y[..., :-1]
        return self.xp.sqrt(dx * dx + dy * dy).sum(-1)

    def clearances(self, x: Array, y: Array) -> list[Array]:
        """Clearances of links at the samples and of the joints' lines between them; joints (..., n, k)."""
        base = self.xp.zeros_like(x[..., :1])
        xs, ys = self.xp.concatenate([base, x], -1), self.xp.concatenate([base, y], -1)
        parts = []
        for pair in self.pairs:
            first, last = pair.body.start, pair.body.end
            parts.append(self._clearance(pair.obstacle, xs[..., first], ys[..., first], xs[..., last], ys[..., last]))
            x_end, y_end = xs[..., last], ys[..., last]
            parts.append(
                self._clearance(pair.obstacle, x_end[..., :-1], y_end[..., :-1], x_end[..., 1:], y_end[..., 1:])
            )
        return parts

    def _clearance(self, obstacle: Obstacle, *ends: Array) -> Array:
        xp = self.xp
        assert isinstance(obstacle, Ellipse)
        (u0, v0), (u1, v1) = self._to_unit_circle(obstacle, *ends[:2]), self._to_unit_circle(obstacle, *ends[2:])
        du, dv = u1 - u0, v1 - v0
        along = xp.clip(-(u0 * du + v0 * dv) / xp.maximum(du * du + dv * dv, 1e-12), 0.0, 1.0)
        u, v = u0 + along * du, v0 + along * dv
        return (xp.sqrt(u * u + v * v) - 1.0) * min(obstacle.semi_axes)

    def _to_unit_circle(self, ellipse: Ellipse, x: Array, y: Array) -> tuple[Array, Array]:
        dx, dy = x - ellipse.center[0], y - ellipse.center[1]
        cosine, sine = np.cos(ellipse.angle), np.sin(ellipse.angle)
        return (cosine * dx + sine * dy) / ellipse.semi_axes[0], (cosine * dy - sine * dx) / ellipse.semi_axes[1]

    def penalty(self, speed: Array, acceleration: Array, clearances: list[Array]) -> Array:
        """h_1 g_1 + h_2 g_2 + h_3 g_3 of (16)-(18)."""
        total = 0.0
        for values, limit in ((speed, self.speed), (acceleration, self.acceleration)):
            size = self.xp.abs(values)
            total = total + (size * (size > limit)).sum((-1, -2))
        return total + sum((values < self.margin).sum(-1) for values in clearances)

    def excess(self, clearances: list[Array]) -> Array:
        """The graded penalty of obstacles, in halves of the reach."""
        unit = self.lengths.sum() / 2.0
        return sum(self.xp.maximum(0.0, self.margin - values).sum(-1) / unit for values in clearances)

    def time_scale(self, speed: Array, acceleration: Array) -> Array:
        """The minimum time scale."""
        by_speed = (self.xp.abs(speed) / self.speed).max((-1, -2))
        return self.xp.maximum(by_speed, self.xp.sqrt((self.xp.abs(acceleration) / self.acceleration).max((-1, -2))))


class PointToPointCost(Kinematics):
    """(15), or its reduced form."""

    def __init__(self, problem: PointToPointProblem, xp: ModuleType) -> None:
        super().__init__(problem, xp)
        self.task = problem.encoding.task
        tau = np.arange(1, problem.motion.steps + 1) / problem.motion.steps
        self.early = [sampling_matrix(QUARTIC, np.append(0.0, tau), n).full() for n in range(3)]
        self.late = [sampling_matrix(QUINTIC, tau, n).full() for n in range(3)]

    def __call__(self, x: Array) -> Array:
        """Costs (...) of candidates (..., d)."""
        xp, k = self.xp, self.lengths.size
        theta_m, dtheta_m = x[..., :k], x[..., k : 2 * k]
        phi_s, phi_f = x[..., 2 * k : 3 * k - 2], x[..., 3 * k - 2 : 4 * k - 4]
        if self.reduced and k > 2:
            zero = xp.zeros_like(x[..., 0])
            phi_s = self.restore(zero + self.task.start[0], zero + self.task.start[1], phi_s)
            phi_f = self.restore(zero + self.task.goal[0], zero + self.task.goal[1], phi_f)
        theta_s, k_s = self.inverse(self.task.start[0], self.task.start[1], phi_s)
        theta_f, k_f = self.inverse(self.task.goal[0], self.task.goal[1], phi_f)
        theta_s = self.turned(theta_s, 0.0)
        theta_f = self.turned(theta_f, theta_s)
        if self.reduced:
            return self._reduced_cost(theta_s, theta_m, dtheta_m, theta_f, x[..., -1:])
        t1, t2 = x[..., -2:-1], x[..., -1:]
        theta, speed, acceleration = self._sampled(theta_s, theta_m, dtheta_m, theta_f, t1, t2)
        x_joints, y_joints = self.joints(theta) if self._needs_joints else (None, None)
        clearances = self.clearances(x_joints, y_joints) if self.pairs else []
        objective = self._objective(theta, x_joints, y_joints, (t1 + t2)[..., 0])
        worst = xp.maximum(xp.abs(k_s), xp.abs(k_f))
        penalised = objective + self.weights.limit * self.penalty(speed, acceleration, clearances)
        return xp.where(worst <= 1.0, penalised, self.weights.reach * (xp.abs(k_s) + xp.abs(k_f)))

    @property
    def _needs_joints(self) -> bool:
        return bool(self.pairs) or self.measure == "length"

    def _objective(self, theta: Array, x: Array, y: Array, time: Array) -> Array:
        x_tip, y_tip = (x[..., -1], y[..., -1]) if self._needs_joints else (None, None)
        return self.objective(theta, x_tip, y_tip, time)

    def _reduced_cost(self, theta_s: Array, detour: Array, dtheta_m: Array, theta_f: Array, t1: Array) -> Array:
        xp = self.xp
        theta_m, t2 = (theta_s + theta_f) / 2.0 + detour, 1.0 - t1
        _, speed, acceleration = self._sampled(theta_s, theta_m, dtheta_m, theta_f, t1, t2)
        shortest = self.task.time_box[0] / xp.minimum(t1, t2)[..., 0]
        time = xp.maximum(shortest, self.time_scale(speed, acceleration))[..., None]
        theta = self._positions(theta_s, theta_m, dtheta_m, theta_f, t1, t2)
        x_joints, y_joints = self.joints(theta) if self._needs_joints else (None, None)
        objective = self._objective(theta, x_joints, y_joints, time[..., 0])
        if not self.pairs:
            return objective
        excess = self.excess(self.clearances(x_joints, y_joints))
        return xp.where(excess > 0.0, self.ceiling + excess, objective)

    def _data(self, *quantities: Array) -> tuple[Array, Array]:
        theta_s, theta_m, dtheta_m, theta_f, t1, t2 = quantities
        bend = (6.0 * dtheta_m * t1 - 12.0 * (theta_m - theta_s)) / t1**2
        first = self.xp.stack([theta_s, theta_m - theta_s, dtheta_m * t1], -2)
        return first, self.xp.stack([theta_m, theta_f - theta_m, dtheta_m * t2, bend * t2**2], -2)

    def _sampled(self, *quantities: Array) -> list[Array]:
        first, second = self._data(*quantities)
        t1, t2 = quantities[-2][..., None], quantities[-1][..., None]
        orders = range(1, 3) if self.reduced else range(3)
        blocks = [
            self.xp.concatenate([self.early[n] @ first / t1**n, self.late[n] @ second / t2**n], -2) for n in orders
        ]
        return [None, *blocks] if self.reduced else blocks

    def _positions(self, *quantities: Array) -> Array:
        if self.measure == "time" and not self.pairs:
            return None
        first, second = self._data(*quantities)
        return self.xp.concatenate([self.early[0] @ first, self.late[0] @ second], -2)


class PathCost(Kinematics):
    """(25), or its reduced form."""

    def __init__(self, problem: PathFollowingProblem, xp: ModuleType) -> None:
        super().__init__(problem, xp)
        self.task, self.steps, self.shortest = problem.encoding.task, problem.motion.steps, problem.encoding.time_box[0]
        spline, values = problem.motion.spline, problem.encoding.redundancy_values
        self.spread = CubicSpline(np.linspace(0.0, 1.0, values), np.eye(values))(spline.knots)
        self.at_grid = [spline.operator(problem.motion.parameters_u, n) for n in range(3)]
        self.at_nodes = [spline.operator(spline.nodes, n) for n in (1, 2)]
        self.half_steps = np.diff(spline.nodes)[:, None] / 2.0
        self.points = problem.encoding.task.path.array
        self.at_knots = self.points[list(problem.encoding.task.knot_indices)]

    def __call__(self, x: Array) -> Array:
        """Costs (...) of candidates (..., d)."""
        xp = self.xp
        values = x if self.reduced else x[..., :-1]
        normalised = xp.clip((self.spread @ values[..., None])[..., 0], 0.0, 1.0)
        zero = xp.zeros_like(normalised)
        x_knots, y_knots = zero + self.at_knots[:, 0], zero + self.at_knots[:, 1]
        phi = self.restore(x_knots, y_knots, normalised[..., None])
        angles, _ = self.inverse(x_knots, y_knots, phi)
        first = self.turned(angles[..., :1, :], 0.0)
        steps = self.turned(angles[..., 1:, :] - angles[..., :-1, :], 0.0)
        knots = xp.concatenate([first, first + xp.cumsum(steps, -2)], -2)
        theta = self.at_grid[0] @ knots
        at_points = theta[..., :: self.steps, :]
        x_joints, y_joints = self.joints(theta if self._everywhere else at_points)
        every = self.steps if self._everywhere else 1
        dx = x_joints[..., ::every, -1] - self.points[:, 0]
        dy = y_joints[..., ::every, -1] - self.points[:, 1]
        miss = xp.sqrt(dx * dx + dy * dy)
        clearances = self.clearances(x_joints, y_joints) if self.pairs else []
        time = self._least_time(knots) if self.reduced else x[..., -1]
        objective = self.objective(theta, x_joints[..., -1], y_joints[..., -1], time)
        if self.reduced:
            excess = xp.maximum(0.0, miss / self.task.accuracy - 1.0).sum(-1) + self.excess(clearances)
            return xp.where(excess > 0.0, self.ceiling + excess, objective)
        duration = time[..., None, None]
        speed, acceleration = (self.at_grid[n] @ knots / duration**n for n in (1, 2))
        missed = (miss * (miss > self.task.accuracy)).sum(-1)
        return objective + self.weights.limit * (missed + self.penalty(speed, acceleration, clearances))

    @property
    def _everywhere(self) -> bool:
        return bool(self.pairs) or self.measure == "length"

    def _least_time(self, knots: Array) -> Array:
        xp = self.xp
        speed, m = (operator @ knots for operator in self.at_nodes)
        before, after = m[..., :-1, :], m[..., 1:, :]
        turns = before * after < 0.0
        gap = xp.where(turns, before - after, 1.0)
        turning = xp.where(turns, speed[..., :-1, :] + self.half_steps * before * before / gap, 0.0)
        return xp.maximum(self.shortest, self.time_scale(xp.concatenate([speed, turning], -2), m))
