"""Path following written again in NumPy and SciPy, one candidate at a time: the oracle of (25)."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline, make_interp_spline

from problems import Ellipse, PathFollowing


class PathOracle:
    """Prices candidates of a problem from its fields alone."""

    def __init__(self, problem: PathFollowing) -> None:
        self.problem = problem
        self.lengths = np.array(problem.arm.link_lengths)
        n = len(problem.path.points)
        self.u_points = np.arange(n) / (n - 1)
        self.u_grid = np.linspace(0.0, 1.0, problem.steps * (n - 1) + 1)
        self.indices = list(problem.knot_indices)

    def cost(self, candidates: np.ndarray) -> np.ndarray:
        return np.array([self._cost(x) for x in candidates])

    def breaks_a_limit(self, x: np.ndarray) -> bool:
        return any(np.any(v) for v in self._violations(*self._motion(x)).values())

    def _motion(self, x: np.ndarray) -> tuple[object, float]:
        """Spline over u of the joint angles, and t_T."""
        p, k = self.problem, self.lengths.size
        values = x[: p.redundancy_values * (k - 2)].reshape(k - 2, p.redundancy_values)
        elbow = {"up": 1.0, "down": -1.0}.get(p.elbow) or (1.0 if x[values.size] >= 0.0 else -1.0)
        u_knots = self.u_points[self.indices]
        decided = np.linspace(0.0, 1.0, p.redundancy_values)
        x_phi = np.clip(np.array([CubicSpline(decided, row)(u_knots) for row in values]), 0.0, 1.0)
        theta = [self._angles(p.path.array[i], x_phi[:, m], elbow) for m, i in enumerate(self.indices)]
        if p.arm.joint_limits is None:
            theta[0] = np.pi - (np.pi - theta[0]) % (2.0 * np.pi)
        else:
            middle = np.mean(p.arm.joint_limits, axis=1)
            theta[0] = middle + np.pi - (np.pi - (theta[0] - middle)) % (2.0 * np.pi)
        for m in range(1, len(theta)):
            theta[m] = theta[m - 1] + np.pi - (np.pi - (theta[m] - theta[m - 1])) % (2.0 * np.pi)
        inner = [(u_knots[0] + u_knots[1]) / 2.0, *u_knots[1:-1], (u_knots[-2] + u_knots[-1]) / 2.0]
        knots = np.concatenate([np.zeros(4), inner, np.ones(4)])
        rest = [(1, np.zeros(k)), (2, np.zeros(k))]
        spline = make_interp_spline(u_knots, np.array(theta), k=3, t=knots, bc_type=(rest, rest))
        if p.formulation == "paper":
            return spline, float(x[-1])
        fine = np.unique(np.concatenate([knots, *self._turning_points(spline, np.unique(knots))]))
        speed = np.abs(spline.derivative(1)(fine)) / p.arm.max_speed
        acceleration = np.abs(spline.derivative(2)(np.unique(knots))) / p.arm.max_acceleration
        return spline, max(p.time_box[0], speed.max(), np.sqrt(acceleration.max()))

    @staticmethod
    def _turning_points(spline: object, nodes: np.ndarray) -> list[np.ndarray]:
        """Where the piecewise linear acceleration of each joint is zero."""
        m = spline.derivative(2)(nodes)  # type: ignore[attr-defined]
        before, after = m[:-1], m[1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = before / (before - after)
        at = nodes[:-1, None] + np.diff(nodes)[:, None] * share
        return [at[before * after < 0.0]]

    def _angles(self, point: np.ndarray, x_phi: np.ndarray, elbow: float) -> np.ndarray:
        lengths, target, phi = self.lengths, np.array(point), {}
        for j in range(lengths.size - 1, 1, -1):
            inner = max(0.0, 2.0 * lengths[:j].max() - lengths[:j].sum())
            rho, alpha, length = np.hypot(*target), np.arctan2(target[1], target[0]), lengths[j]
            betas = [
                np.arccos(np.clip((rho**2 + length**2 - r**2) / (2.0 * rho * length), -1.0, 1.0))
                for r in (inner, lengths[:j].sum())
            ]
            side = 2.0 * x_phi[j - 2] - 1.0
            phi[j] = alpha + (1.0 if side >= 0.0 else -1.0) * (betas[0] + abs(side) * (betas[1] - betas[0]))
            target = target - length * np.array([np.cos(phi[j]), np.sin(phi[j])])
        l1, l2 = lengths[:2]
        c = np.clip((target @ target - l1**2 - l2**2) / (2.0 * l1 * l2), -1.0, 1.0)
        theta_2 = elbow * np.arccos(c)
        theta_1 = np.arctan2(target[1], target[0]) - np.arctan2(l2 * np.sin(theta_2), l1 + l2 * np.cos(theta_2))
        psi = [theta_1, theta_1 + theta_2, *(phi[j] for j in sorted(phi))]
        return np.diff([0.0, *psi])

    def _joints(self, theta: np.ndarray) -> np.ndarray:
        """Complex positions of base, joints and tip."""
        steps = self.lengths * np.exp(1j * np.cumsum(theta, axis=1))
        return np.concatenate([np.zeros((len(theta), 1)), np.cumsum(steps, axis=1)], axis=1)

    def _violations(self, spline: object, time: float) -> dict[str, np.ndarray]:
        """By limit, the value wherever it is broken and 0 elsewhere (speed limits only in the paper form)."""
        p = self.problem
        theta = spline(self.u_grid)  # type: ignore[operator]
        joints = self._joints(theta)
        given = p.path.array @ [1.0, 1j]
        miss = np.abs(self._joints(spline(self.u_points))[:, -1] - given)  # type: ignore[operator]
        found = {"accuracy": np.where(miss > p.accuracy, miss, 0.0)}
        if p.formulation == "paper":
            v = np.abs(spline.derivative(1)(self.u_grid)) / time  # type: ignore[attr-defined]
            a = np.abs(spline.derivative(2)(self.u_grid)) / time**2  # type: ignore[attr-defined]
            found["speed"] = np.where(v > p.arm.max_speed, v, 0.0)
            found["acceleration"] = np.where(a > p.arm.max_acceleration, a, 0.0)
        if p.arm.joint_limits is not None:
            low, high = np.array(p.arm.joint_limits).T
            found["range"] = np.maximum(0.0, np.maximum(low - theta, theta - high))
        for number, obstacle in enumerate(p.obstacles):
            links = [_clearance(obstacle, joints[:, j], joints[:, j + 1]) for j in range(p.arm.links)]
            sweeps = [_clearance(obstacle, joints[:-1, j + 1], joints[1:, j + 1]) for j in range(p.arm.links)]
            for kind, rows in (("links", links), ("sweeps", sweeps)):
                found[f"{kind} {number}"] = np.maximum(0.0, p.margin - np.array(rows))
        return found

    def _cost(self, x: np.ndarray) -> float:
        p = self.problem
        spline, time = self._motion(x)
        theta = spline(self.u_grid)  # type: ignore[operator]
        objective = {
            "time": time,
            "rotation": np.abs(np.diff(theta, axis=0)).sum(),
            "length": np.abs(np.diff(self._joints(theta)[:, -1])).sum(),
        }[p.objective]
        violations = self._violations(spline, time)
        if p.formulation == "reduced":
            scale = {"accuracy": p.accuracy}
            excess = sum(v.sum() for name, v in violations.items() if name != "accuracy")
            miss = violations["accuracy"]
            excess += ((miss - p.accuracy) / scale["accuracy"])[miss > 0.0].sum()
            return float(p.feasible_below + excess if excess > 0.0 else objective)
        summed = sum(v.sum() for name, v in violations.items() if name in ("accuracy", "speed", "acceleration"))
        counted = sum(
            (v > 0.0).sum() for name, v in violations.items() if name.split()[0] in ("range", "links", "sweeps")
        )
        return float(objective + p.lambda_1 * (summed + counted))


def _clearance(obstacle: Ellipse, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Clearance of segments between complex points, by minimising the convex distance along each."""
    turned = np.exp(-1j * obstacle.angle)
    ends = []
    for z in (start, end):
        local = (z - complex(*obstacle.center)) * turned
        ends.append(local.real / obstacle.semi_axes[0] + 1j * local.imag / obstacle.semi_axes[1])
    step = ends[1] - ends[0]
    square = np.maximum(np.abs(step) ** 2, 1e-300)
    share = np.clip(-(ends[0] * np.conj(step)).real / square, 0.0, 1.0)
    return (np.abs(ends[0] + share * step) - 1.0) * min(obstacle.semi_axes)
