"""How far a motion leaves a path, for all t: whatever timed it, and without knowing how."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.joint_path import JointPath
from problems.motions.trajectory import Trajectory
from problems.timing.polynomials import composition, in_bernstein_form

NODES = 5  # of each piece of a motion, through which its course along the path is drawn: a polynomial of degree 4
LENGTH_SAMPLES = 4_000  # of a motion or a path, to measure lengths by; at least
PIECE_SAMPLES = 8  # of each piece; at least
NEWTON_STEPS = 30  # most of them needed only where the path starts from a standstill of its parameter


def departure(path: JointPath, trajectory: Trajectory) -> float:
    """A proven bound of the largest distance of a joint from where it would be on the path, over all t, rad.

    In each piece of the motion a polynomial u(t) is drawn through the path's nearest parameters at a few times. The
    difference of q(t) and the path at u(t) is then a polynomial, and its Bernstein coefficients bound it. To rounding
    it is zero where the motion runs the path, with u(t) of degree 4 at most in pieces that end where those of the path
    do; of any other motion it is an upper bound, infinite where a number is none.
    """
    durations = np.diff(trajectory.breakpoints)
    shares = np.linspace(0.0, 1.0, NODES)
    times = trajectory.breakpoints[:-1, None] + durations[:, None] * shares
    u = _nearest(path, trajectory, times.ravel()).reshape(times.shape)
    u[0, 0], u[-1, -1] = path.breakpoints[[0, -1]]
    pieces = np.clip(np.searchsorted(path.breakpoints, u[:, NODES // 2], "right") - 1, 0, path.breakpoints.size - 2)
    starts, ends = path.breakpoints[pieces], path.breakpoints[pieces + 1]
    local = np.clip(u, starts[:, None], ends[:, None]) - starts[:, None]
    course = np.asarray(np.linalg.solve(np.vander(shares, increasing=True), local.T))  # lowest power of the share first
    planned = composition(path.coefficients[::-1, pieces], course[:, :, None])
    powers = np.arange(len(trajectory.coefficients))[:, None]
    made = trajectory.coefficients[::-1] * (durations**powers)[..., None]
    difference = np.zeros((max(len(planned), len(made)), *made.shape[1:]))
    difference[: len(planned)] += planned
    difference[: len(made)] -= made
    largest = float(np.abs(in_bernstein_form(difference)).max())
    return largest if np.isfinite(largest) else np.inf


def _nearest(path: JointPath, trajectory: Trajectory, times: FloatArray) -> FloatArray:
    """The parameters of the path nearest to a motion at increasing times (n,): after equal lengths, then by Newton."""
    at, done = _lengths(trajectory.breakpoints, trajectory.at)
    u, covered = _lengths(path.breakpoints, path.at)
    total = max(float(covered[-1]), np.finfo(float).tiny)
    found = np.interp(np.interp(times, at, done) * (total / max(float(done[-1]), np.finfo(float).tiny)), covered, u)
    theta, (low, high) = trajectory.at(times), path.breakpoints[[0, -1]]
    damping = np.ones_like(found)
    for _ in range(NEWTON_STEPS):
        away, slope = theta - path.at(found), path.at(found, 1)
        curvature = np.square(slope).sum(axis=1)
        step = np.divide((away * slope).sum(axis=1), curvature, out=np.zeros_like(found), where=curvature > 0.0)
        moved = np.clip(found + damping * step, low, high)
        better = np.square(theta - path.at(moved)).sum(axis=1) < np.square(away).sum(axis=1)
        found, damping = np.where(better, moved, found), np.where(better, 1.0, damping / 4.0)
    return found


def _lengths(breakpoints: FloatArray, at: Callable[[FloatArray], FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Parameters between breakpoints, and the length in joint space of the chords up to there, rad; both (n,)."""
    count = max(PIECE_SAMPLES, LENGTH_SAMPLES // (breakpoints.size - 1))
    steps = np.arange(count) / count
    inner = breakpoints[:-1, None] + np.diff(breakpoints)[:, None] * steps
    parameters = np.append(inner.ravel(), breakpoints[-1])
    chords = np.linalg.norm(np.diff(at(parameters), axis=0), axis=1)
    return parameters, np.concatenate([[0.0], np.cumsum(chords)])
