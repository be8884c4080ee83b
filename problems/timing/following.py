"""The largest distances of a motion from a path, and of a path from the waypoints that it was made of."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from problems.base import FloatArray, bernstein, composition, derivative, in_bernstein_form, peak
from problems.motions import JointPath, Trajectory

COURSE_NODES = 5  # of each piece of a motion, through which its course along the path is drawn
LENGTH_SAMPLES = 4_000  # intervals of a motion or a path, to measure lengths by; at least
PIECE_SAMPLES = 8  # of each piece; at least, and a multiple of the intervals between nodes
GAUSS_POINTS = 3  # evaluations in each interval, to integrate its length
NEWTON_STEPS = 30  # most of them needed only where the path starts from a standstill of its parameter
FIT_NODES, FIT_STEPS = 11, 8  # of a piece whose course is fitted: where a path turns back, nearest nodes are ambiguous
ANGLE_ROUNDING = 1e-11  # rad, for angles up to 1 rad, and a share of larger ones
MOST_FITTED_PIECES = 1_000  # a motion with more that are far away is no case of rounding
LENGTH_ROUNDING = 1e-6  # of a path's length: where pieces of a motion meet, a smaller gap is rounding


def departure(path: JointPath, trajectory: Trajectory) -> float:
    """A proven bound of the largest distance of a joint from where it would be on the path, over all t, rad.

    In each piece of the motion a polynomial u(t) is drawn through the path's nearest parameters at a few times. The
    difference of q(t) and the path at u(t) is then a polynomial, and its Bernstein coefficients bound it. To rounding
    it is zero where the motion runs the path, with u(t) of degree 4 at most in pieces that end where those of the path
    do; of any other motion it is an upper bound, infinite where a number is none.
    """
    durations = np.diff(trajectory.breakpoints)
    shares = np.linspace(0.0, 1.0, COURSE_NODES)
    times = trajectory.breakpoints[:-1, None] + durations[:, None] * shares
    u = _nearest(path, trajectory, times.ravel()).reshape(times.shape)
    u[0, 0], u[-1, -1] = path.breakpoints[[0, -1]]
    pieces = np.clip(
        np.searchsorted(path.breakpoints, u[:, COURSE_NODES // 2], "right") - 1, 0, path.breakpoints.size - 2
    )
    starts, ends = path.breakpoints[pieces], path.breakpoints[pieces + 1]
    local = np.clip(u, starts[:, None], ends[:, None]) - starts[:, None]
    course = np.asarray(np.linalg.solve(np.vander(shares, increasing=True), local.T))  # lowest power of the share first
    planned = path.coefficients[::-1, pieces]
    powers = np.arange(len(trajectory.coefficients))[:, None]
    made = trajectory.coefficients[::-1] * (durations**powers)[..., None]
    away = _away(planned, course, made)
    sure = ANGLE_ROUNDING * max(1.0, float(np.abs(made[0]).max()))
    for start in _starts(course) if np.isfinite(made).all() else ():
        unsure = np.flatnonzero(~(away <= sure))
        if not 0 < unsure.size <= MOST_FITTED_PIECES:
            break
        fitted = _fitted(planned[:, unsure], start[:, unsure], made[:, unsure])
        nearer = _away(planned[:, unsure], fitted, made[:, unsure])
        better = nearer < away[unsure]
        course[:, unsure], away[unsure] = (
            np.where(better, fitted, course[:, unsure]),
            np.where(better, nearer, away[unsure]),
        )
    largest = max(float(away.max()), _skipped(path, starts + course[0], starts + course.sum(axis=0)))
    return largest if np.isfinite(largest) else np.inf


def deviation(path: JointPath, waypoints: FloatArray) -> float:
    """The largest distance of a joint from straight lines between waypoints, for all u, rad; 1e-11 too large at most.

    The parameter of the path is the length along the lines, so that each point has its own on them.

    Args:
        path: from the first to the last waypoint.
        waypoints: (n, k), rad.
    """
    steps = np.diff(waypoints, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    corners = np.concatenate([[0.0], np.cumsum(lengths)])
    cuts = np.union1d(path.breakpoints, np.clip(corners, *path.breakpoints[[0, -1]]))
    starts, extents = cuts[:-1], np.diff(cuts)
    lines = np.clip(np.searchsorted(corners, starts + extents / 2.0, "right") - 1, 0, len(steps) - 1)
    apart = path.restarted(starts)
    slopes = (steps / lengths[:, None])[lines]
    apart[-1] -= waypoints[lines] + slopes * (starts - corners[lines])[:, None]
    apart[-2] -= slopes
    return peak(bernstein(apart, extents).reshape(len(apart), -1))


def _skipped(path: JointPath, first: FloatArray, last: FloatArray) -> float:
    """The longest part of a path, rad, that is left out before, between and after pieces from first to last (N,)."""
    u, covered = _lengths(path.breakpoints, path.at)
    left = np.append(u[0], last), np.append(first, u[-1])
    longest = float(np.abs(np.diff([np.interp(at, u, covered) for at in left], axis=0)).max())
    return longest if not longest <= LENGTH_ROUNDING * float(covered[-1]) else 0.0


def _starts(course: FloatArray) -> list[FloatArray]:
    """Courses (5, N) to start fits from: as it is, and straight ones through two of its nodes, not all wrong."""
    shares = np.linspace(0.0, 1.0, COURSE_NODES)
    at = np.vander(shares, increasing=True) @ course
    lines = []
    for i, j in combinations(range(COURSE_NODES), 2):
        slope = (at[j] - at[i]) / (shares[j] - shares[i])
        lines.append(np.stack([at[i] - slope * shares[i], slope, *np.zeros((COURSE_NODES - 2, course.shape[1]))]))
    return [course.copy(), *lines]


def _away(planned: FloatArray, course: FloatArray, made: FloatArray) -> FloatArray:
    """Distance bounds (N,) of pieces of a motion (n, N, k) from pieces of a path (m, N, k) on a course (5, N).

    All lowest power first; the path's in its local parameter, the others in shares of the duration.
    """
    run = composition(planned, course[:, :, None])
    difference = np.zeros((max(len(run), len(made)), *made.shape[1:]))
    difference[: len(run)] += run
    difference[: len(made)] -= made
    return np.asarray(np.abs(in_bernstein_form(difference)).max(axis=(0, 2)))


def _fitted(planned: FloatArray, course: FloatArray, made: FloatArray) -> FloatArray:
    """Courses (5, N) by Gauss-Newton steps on all their coefficients at once; arguments as of :func:`_away`."""
    shares = np.linspace(0.0, 1.0, FIT_NODES)
    powers = np.vander(shares, COURSE_NODES, increasing=True)
    theta = _values(made, np.broadcast_to(shares[:, None], (FIT_NODES, made.shape[1])))
    fitted = course
    for _ in range(FIT_STEPS):
        local = powers @ fitted
        slope = _values(derivative(planned), local)
        length = np.linalg.norm(slope, axis=2)
        along = ((theta - _values(planned, local)) * slope).sum(axis=2)
        miss = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
        rows = length.T[:, :, None] * powers
        if not (np.isfinite(rows).all() and np.isfinite(miss).all()):
            return course
        fitted = fitted + (np.linalg.pinv(rows) @ miss.T[:, :, None])[:, :, 0].T
    return fitted


def _values(polynomials: FloatArray, at: FloatArray) -> FloatArray:
    """Values (S, N, k) of polynomials (n, N, k), lowest power first, at (S, N)."""
    value = np.zeros((*at.shape, polynomials.shape[2]))
    for coefficient in polynomials[::-1]:
        value = value * at[:, :, None] + coefficient
    return value


def _nearest(path: JointPath, trajectory: Trajectory, times: FloatArray) -> FloatArray:
    """The parameters of the path nearest to a motion at increasing times (n,): after equal lengths, then by Newton."""
    at, done = _lengths(trajectory.breakpoints, trajectory.at)
    u, covered = _lengths(path.breakpoints, path.at)
    total = max(float(covered[-1]), np.finfo(float).tiny)
    nearest = np.interp(np.interp(times, at, done) * (total / max(float(done[-1]), np.finfo(float).tiny)), covered, u)
    theta, (low, high) = trajectory.at(times), path.breakpoints[[0, -1]]
    damping = np.ones_like(nearest)
    for _ in range(NEWTON_STEPS):
        away, slope = theta - path.at(nearest), path.at(nearest, 1)
        curvature = np.square(slope).sum(axis=1)
        step = np.divide((away * slope).sum(axis=1), curvature, out=np.zeros_like(nearest), where=curvature > 0.0)
        moved = np.clip(nearest + damping * step, low, high)
        better = np.square(theta - path.at(moved)).sum(axis=1) < np.square(away).sum(axis=1)
        nearest, damping = np.where(better, moved, nearest), np.where(better, 1.0, damping / 4.0)
    return nearest


def _lengths(breakpoints: FloatArray, at: Callable[[FloatArray, int], FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Parameters between breakpoints, and the length in joint space up to there, rad; both (n,)."""
    count = max(PIECE_SAMPLES, LENGTH_SAMPLES // (breakpoints.size - 1) // (COURSE_NODES - 1) * (COURSE_NODES - 1))
    steps = np.arange(count) / count
    inner = breakpoints[:-1, None] + np.diff(breakpoints)[:, None] * steps
    parameters = np.append(inner.ravel(), breakpoints[-1])
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    widths = np.diff(parameters)
    slopes = at((parameters[:-1, None] + widths[:, None] * (nodes + 1.0) / 2.0).ravel(), 1)
    lengths = widths * (np.linalg.norm(slopes, axis=1).reshape(-1, nodes.size) @ weights) / 2.0
    return parameters, np.concatenate([[0.0], np.cumsum(lengths)])
