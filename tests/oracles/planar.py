"""Point-to-point motions written again in NumPy, for many candidates at once: the oracle of (15).

Positions are complex numbers; arrays of a motion are (times, candidates, joints).
"""

from __future__ import annotations

import numpy as np

from problems import Ellipse, PointToPointProblem

MARGIN = 1e-3  # kept at the samples, of the reach or of a joint's range


class PointToPointOracle:
    """Evaluates candidates (m, d) of a problem in the paper's formulation from its fields alone."""

    def __init__(self, problem: PointToPointProblem) -> None:
        self.problem, self.task, self.arm = problem, problem.encoding.task, problem.criteria.robot
        self.lengths = np.array(self.arm.link_lengths)

    def cost(self, candidates: np.ndarray) -> np.ndarray:
        p = self.problem
        weights = p.weights
        k_s, k_f, theta, speed, acceleration, duration = self._motion(candidates)
        objective = objective_of(p.criteria.objective.name, duration, theta, self.lengths)
        penalty = self._penalty(theta, speed, acceleration)
        unreachable = weights.reach * (np.abs(k_s) + np.abs(k_f))
        reachable = (np.abs(k_s) <= 1.0) & (np.abs(k_f) <= 1.0)
        return np.where(reachable, objective + weights.limit * penalty, unreachable)

    def kinds(self, candidates: np.ndarray) -> np.ndarray:
        """0 feasible, 1 breaks a limit, 2 unreachable; (m,)."""
        k_s, k_f, *motion, _ = self._motion(candidates)
        unreachable = (np.abs(k_s) > 1.0) | (np.abs(k_f) > 1.0)
        return np.where(unreachable, 2, np.where(self._penalty(*motion) > 0.0, 1, 0))

    def _motion(self, x: np.ndarray) -> tuple[np.ndarray, ...]:
        p, k = self.task, self.lengths.size
        theta_m, dtheta_m, phi_s, phi_f = np.split(x, np.cumsum([k, k, k - 2, k - 2]), axis=1)[:4]
        free = p.elbow == "free"
        fixed = np.full((len(x), 2), -1.0 if p.elbow == "down" else 1.0)
        elbow = np.where(x[:, -4:-2] >= 0.0, 1.0, -1.0) if free else fixed
        t1, t2 = x[:, -2:-1], x[:, -1:]
        theta_s, k_s = self._inverse(complex(*p.start), phi_s, elbow[:, 0])
        theta_f, k_f = self._inverse(complex(*p.goal), phi_f, elbow[:, 1])
        middle = np.zeros(k) if self.arm.joint_limits is None else np.mean(self.arm.joint_limits, axis=1)
        theta_s = wrap_to(theta_s, middle)
        theta_f = wrap_to(theta_f, theta_s)
        if self.arm.joint_limits is not None:
            low, high = np.array(self.arm.joint_limits).T
            theta_f = theta_f - 2.0 * np.pi * (theta_f > high)
            theta_f = theta_f + 2.0 * np.pi * (theta_f < low)
        first = solve_polynomial([(0, 0, theta_s), (0, 1, 0), (0, 2, 0), (1, 0, theta_m), (1, 1, dtheta_m * t1)])
        bend = sum(n * (n - 1) * first[n] for n in range(2, 5)) / t1**2
        second = solve_polynomial(
            [(0, 0, theta_m), (0, 1, dtheta_m * t2), (0, 2, bend * t2**2), (1, 0, theta_f), (1, 1, 0), (1, 2, 0)]
        )
        tau = np.linspace(0.0, 1.0, self.problem.motion.steps + 1)
        blocks = []
        for n in range(3):
            early, late = (sampled(c, tau, n) / t**n for c, t in ((first, t1), (second, t2)))
            blocks.append(np.concatenate([early, late[1:]]))
        return k_s, k_f, *blocks, (t1 + t2).ravel()

    def _inverse(self, point: complex, phi: np.ndarray, elbow: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        l1, l2 = self.lengths[:2]
        wrist = point - (self.lengths[2:] * np.exp(1j * phi)).sum(axis=1)
        cosine = (np.abs(wrist) ** 2 - l1**2 - l2**2) / (2.0 * l1 * l2)
        theta_2 = elbow * np.arccos(np.clip(cosine, -1.0, 1.0))
        theta_1 = np.angle(wrist) - np.angle(l1 + l2 * np.exp(1j * theta_2))
        psi = np.column_stack([theta_1, theta_1 + theta_2, phi])
        return np.diff(psi, axis=1, prepend=0.0), cosine

    def _penalty(self, theta: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """h_1 g_1 + h_2 g_2 + h_3 g_3 of (16)-(18), and the joint limits counted likewise."""
        total = np.zeros(theta.shape[1])
        for values, limit in ((speed, self.arm.max_speed), (acceleration, self.arm.max_acceleration)):
            total += np.where(np.abs(values) > limit, np.abs(values), 0.0).sum(axis=(0, 2))
        if self.arm.joint_limits is not None:
            low, high = np.array(self.arm.joint_limits).T
            spare = MARGIN * (high - low)
            total += ((theta < low + spare) | (theta > high - spare)).sum(axis=(0, 2))
        joints, margin = joints_of(self.lengths, theta), MARGIN * self.lengths.sum()
        for obstacle in self.task.obstacles:
            total += (clearance(obstacle, joints[..., :-1], joints[..., 1:]) < margin).sum(axis=(0, 2))
            total += (clearance(obstacle, joints[:-1, :, 1:], joints[1:, :, 1:]) < margin).sum(axis=(0, 2))
        return total


def joints_of(lengths: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Complex positions of base, joints and tip, (times, m, k + 1)."""
    steps = lengths * np.exp(1j * np.cumsum(theta, axis=2))
    return np.concatenate([np.zeros((*theta.shape[:2], 1)), np.cumsum(steps, axis=2)], axis=2)


def objective_of(name: str, duration: np.ndarray, theta: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """What is to be least, of each candidate: (m,)."""
    if name == "time":
        return duration
    if name == "rotation":
        return np.abs(np.diff(theta, axis=0)).sum(axis=(0, 2))
    return np.abs(np.diff(joints_of(lengths, theta)[..., -1], axis=0)).sum(axis=0)


def solve_polynomial(conditions: list[tuple[int, int, np.ndarray | int]]) -> list[np.ndarray]:
    """Coefficients, lowest first, of the polynomial with given (tau, derivative, value) at tau 0 or 1."""
    count = len(conditions)
    rows = np.zeros((count, count))
    for row, (tau, derivative, _) in enumerate(conditions):
        for n in range(derivative, count):
            falling = np.prod(np.arange(n - derivative + 1, n + 1)) if derivative else 1.0
            rows[row, n] = falling * float(tau) ** (n - derivative)
    values = np.broadcast_arrays(*(np.asarray(value, dtype=float) for _, _, value in conditions))
    return list(np.tensordot(np.linalg.inv(rows), np.stack(values), axes=1))


def sampled(coefficients: list[np.ndarray], tau: np.ndarray, derivative: int) -> np.ndarray:
    """(times, m, k): the derivative with respect to tau."""
    return np.polynomial.polynomial.polyval(
        tau, np.polynomial.polynomial.polyder(np.stack(coefficients), derivative)
    ).transpose(2, 0, 1)


def wrap_to(angle: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Within (reference - pi, reference + pi]."""
    return reference + np.pi - (np.pi - (angle - reference)) % (2.0 * np.pi)


def clearance(obstacle: Ellipse, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Clearance of segments between complex points, any shape."""
    ends = []
    for z in (start, end):
        local = (z - complex(*obstacle.center)) * np.exp(-1j * obstacle.angle)
        ends.append(local.real / obstacle.semi_axes[0] + 1j * local.imag / obstacle.semi_axes[1])
    step = ends[1] - ends[0]
    square = np.maximum(np.abs(step) ** 2, 1e-12)
    share = np.clip(-(ends[0] * np.conj(step)).real / square, 0.0, 1.0)
    return (np.abs(ends[0] + share * step) - 1.0) * min(obstacle.semi_axes)
