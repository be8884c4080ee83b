"""Filled outlines and capsules by dense points, in NumPy alone: the oracle of shapes and clearances in the plane."""

from __future__ import annotations

import numpy as np

from problems import PlanarArm


def along(start: np.ndarray, end: np.ndarray, count: int) -> np.ndarray:
    """Points of a segment, both ends included, (count, 2)."""
    return start + np.linspace(0.0, 1.0, count)[:, None] * (np.asarray(end) - start)


def dense(corners: np.ndarray, count: int) -> np.ndarray:
    """Points of an outline, ``count`` a side, (n, 2)."""
    return np.vstack([along(a, b, count) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])


def inside(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Which points (n, 2) are within an outline, by how often a ray to the right crosses it; (n,)."""
    (ax, ay), (bx, by) = corners.T, np.roll(corners, -1, axis=0).T
    x, y = points[:, :1], points[:, 1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        crosses = ((ay > y) != (by > y)) & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return np.asarray(crosses.sum(axis=1) % 2 == 1)


def nearest(points: np.ndarray, others: np.ndarray) -> float:
    """The least distance of two sets of points."""
    return float(np.sqrt(((points[:, None] - others[None]) ** 2).sum(axis=2).min()))


def to_segment(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distances of points (n, 2) from a segment, (n,)."""
    way = np.asarray(end) - start
    share = np.clip((points - start) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
    return np.asarray(np.hypot(*(points - start - share[:, None] * way).T))


def skeletons(arm: PlanarArm, theta: np.ndarray) -> np.ndarray:
    """Where base, joints, the last link's end and the tool are, (n, k + 2, 2), of an arm's plain numbers."""
    turn = np.exp(1j * (arm.base_angle + np.cumsum(theta, axis=1)))
    base = np.full((len(theta), 1), complex(*arm.base_point))
    ends = base + np.cumsum(np.array(arm.link_lengths) * turn, axis=1)
    z = np.hstack([base, ends, ends[:, -1:] + complex(*arm.tool_offset) * turn[:, -1:]])
    return np.stack([z.real, z.imag], axis=2)
