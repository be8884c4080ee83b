"""Path following written again in NumPy and SciPy for many candidates at once: the oracle of (25).

Arrays of a motion are (times, candidates, joints).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from oracles.planar import MARGIN, clearance, joints_of, objective_of, wrap_to
from scipy.interpolate import CubicSpline, make_interp_spline

from problems import PathFollowingProblem


class PathOracle:
    """Evaluates candidates (m, d) of a problem from its fields alone."""

    def __init__(self, problem: PathFollowingProblem) -> None:
        self.problem, self.task, self.arm = problem, problem.encoding.task, problem.criteria.robot
        self.formulation = problem.encoding.name
        self.lengths = np.array(self.arm.link_lengths)
        n = len(self.task.path.points)
        self.u_points = np.arange(n) / (n - 1)
        self.u_grid = np.linspace(0.0, 1.0, problem.motion.steps * (n - 1) + 1)
        self.indices = list(self.task.knot_indices)

    def breaks_a_limit(self, candidates: np.ndarray) -> np.ndarray:
        broken = [np.any(v > 0.0, axis=0) for v in self._violations(*self._motion(candidates)).values()]
        return np.any(broken, axis=0)

    def cost(self, candidates: np.ndarray) -> np.ndarray:
        p = self.problem
        spline, time = self._motion(candidates)
        theta = spline(self.u_grid)
        objective = objective_of(p.criteria.objective.name, time, theta, self.lengths)
        violations = self._violations(spline, time)
        if self.formulation == "reduced":
            miss = violations.pop("accuracy")
            excess = np.where(miss > 0.0, miss / self.task.accuracy - 1.0, 0.0).sum(axis=0)
            excess = excess + sum(v.sum(axis=0) for v in violations.values())
            return np.where(excess > 0.0, p.objective_upper_bound + excess, objective)
        summed = sum(violations.pop(name).sum(axis=0) for name in ("accuracy", "speed", "acceleration"))
        counted = sum((v > 0.0).sum(axis=0) for v in violations.values())
        return np.asarray(objective + p.weights.limit * (summed + counted))

    def _motion(self, candidates: np.ndarray) -> tuple[Any, np.ndarray]:
        """Spline over u of the joint angles (m, k), and t_T (m,)."""
        p, k, m = self.task, self.lengths.size, len(candidates)
        values = self.problem.encoding.redundancy_values
        decided = candidates[:, : values * (k - 2)].reshape(m, k - 2, values)
        elbow = np.full(m, -1.0 if p.elbow == "down" else 1.0)
        if p.elbow == "free":
            elbow = np.where(candidates[:, values * (k - 2)] >= 0.0, 1.0, -1.0)
        u_knots = self.u_points[self.indices]
        x_phi = CubicSpline(np.linspace(0.0, 1.0, values), decided, axis=2)(u_knots).clip(0.0, 1.0)
        theta = np.array([self._angles(p.path.array[i], x_phi[:, :, row], elbow) for row, i in enumerate(self.indices)])
        middle = np.zeros(k) if self.arm.joint_limits is None else np.mean(self.arm.joint_limits, axis=1)
        theta[0] = wrap_to(theta[0], middle)
        for row in range(1, len(theta)):
            theta[row] = wrap_to(theta[row], theta[row - 1])
        inner = [(u_knots[0] + u_knots[1]) / 2.0, *u_knots[1:-1], (u_knots[-2] + u_knots[-1]) / 2.0]
        knots = np.concatenate([np.zeros(4), inner, np.ones(4)])
        rest = [(1, np.zeros((m, k))), (2, np.zeros((m, k)))]
        spline = make_interp_spline(u_knots, theta, k=3, t=knots, bc_type=(rest, rest))
        if self.formulation == "paper":
            return spline, candidates[:, -1]
        return spline, self._least_time(spline, np.unique(knots))

    def _least_time(self, spline: Any, nodes: np.ndarray) -> np.ndarray:
        """Speeds at the nodes and wherever the piecewise linear acceleration is zero; accelerations at the nodes."""
        arm = self.arm
        m, v = spline.derivative(2)(nodes), spline.derivative(1)(nodes)
        h = np.diff(nodes)[:, None, None]
        turns = m[:-1] * m[1:] < 0.0
        gap = np.where(turns, m[:-1] - m[1:], 1.0)
        turning = np.where(turns, v[:-1] + h * m[:-1] ** 2 / (2.0 * gap), 0.0)
        fastest = np.maximum(np.abs(v).max(axis=0), np.abs(turning).max(axis=0)) / arm.max_speed
        sharpest = np.abs(m).max(axis=0) / arm.max_acceleration
        return np.maximum(self.problem.encoding.time_box[0], np.maximum(fastest, np.sqrt(sharpest)).max(axis=1))

    def _angles(self, point: np.ndarray, x_phi: np.ndarray, elbow: np.ndarray) -> np.ndarray:
        """Joint angles (m, k) with the tip at a point, from normalised redundancy (m, k - 2)."""
        lengths, target = self.lengths, np.full(len(elbow), complex(*point))
        psi = np.zeros((len(elbow), lengths.size))
        for j in range(lengths.size - 1, 1, -1):
            inner = max(0.0, 2.0 * lengths[:j].max() - lengths[:j].sum())
            rho, length = np.abs(target), lengths[j]
            beta_in, beta_out = (
                np.arccos(np.clip((rho**2 + length**2 - r**2) / (2.0 * rho * length), -1.0, 1.0))
                for r in (inner, lengths[:j].sum())
            )
            side = 2.0 * x_phi[:, j - 2] - 1.0
            turn = beta_in + np.abs(side) * (beta_out - beta_in)
            psi[:, j] = np.angle(target) + np.where(side >= 0.0, turn, -turn)
            target = target - length * np.exp(1j * psi[:, j])
        l1, l2 = lengths[:2]
        c = np.clip((np.abs(target) ** 2 - l1**2 - l2**2) / (2.0 * l1 * l2), -1.0, 1.0)
        theta_2 = elbow * np.arccos(c)
        psi[:, 0] = np.angle(target) - np.angle(l1 + l2 * np.exp(1j * theta_2))
        psi[:, 1] = psi[:, 0] + theta_2
        return np.diff(psi, axis=1, prepend=0.0)

    def _violations(self, spline: Any, time: np.ndarray) -> dict[str, np.ndarray]:
        """By limit (rows, m): the value or excess wherever it is broken, 0 elsewhere; speeds in the paper form only."""
        p, arm = self.task, self.arm
        theta = spline(self.u_grid)
        joints = joints_of(self.lengths, theta)
        miss = np.abs(joints_of(self.lengths, spline(self.u_points))[..., -1] - (p.path.array @ [1.0, 1j])[:, None])
        broken_by = {"accuracy": np.where(miss > p.accuracy, miss, 0.0)}
        if self.formulation == "paper":
            for name, order, bound in (("speed", 1, arm.max_speed), ("acceleration", 2, arm.max_acceleration)):
                value = np.abs(spline.derivative(order)(self.u_grid)) / time[:, None] ** order
                broken_by[name] = _rows(np.where(value > bound, value, 0.0))
        if arm.joint_limits is not None:
            low, high = np.array(arm.joint_limits).T
            low, high = low + MARGIN * (high - low), high - MARGIN * (high - low)
            broken_by["range"] = _rows(np.maximum(0.0, np.maximum(low - theta, theta - high)))
        unit = 1.0 if self.formulation == "paper" else 2.0 / self.lengths.sum()  # graded: in halves of the reach
        for number, obstacle in enumerate(p.obstacles):
            links = clearance(obstacle, joints[..., :-1], joints[..., 1:])
            sweeps = clearance(obstacle, joints[:-1, :, 1:], joints[1:, :, 1:])
            for kind, values in (("links", links), ("sweeps", sweeps)):
                broken_by[f"{kind} {number}"] = _rows(np.maximum(0.0, MARGIN * self.lengths.sum() - values) * unit)
        return broken_by


def _rows(values: np.ndarray) -> np.ndarray:
    """(times, m, k) -> (times k, m)."""
    return np.moveaxis(values, 2, 1).reshape(-1, values.shape[1])
