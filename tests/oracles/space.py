"""The small arm of tests/helpers/space.py, and distances from paths in space, by NumPy and SciPy alone."""

from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from tests.helpers.space import LENGTHS, TOOL


def tool_poses(theta: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Positions (n, 3) and orientations of the small arm's tool in postures (n, dof)."""
    position, rotation = np.zeros((len(theta), 3)), Rotation.identity(len(theta))
    for joint, (angles, length) in enumerate(zip(theta.T, LENGTHS, strict=False)):
        position = position + rotation.apply([0.0, 0.0, length])
        rotation = rotation * Rotation.from_euler("zy"[joint % 2], angles[:, None])
    return position + rotation.apply([0.0, 0.0, TOOL]), rotation


def away_from_path(
    poses: tuple[np.ndarray, Rotation], points: np.ndarray, quaternions: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    """Of n poses the distances from a whole path, and the angles to its orientation at the nearest point, (n,)."""
    position, rotation = poses
    best, angle = np.full(len(position), np.inf), np.zeros(len(position))
    for i, (a, b) in enumerate(pairwise(points)):
        share = np.clip((position - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        away = np.linalg.norm(position - a - share[:, None] * (b - a), axis=1)
        nearer = away < best
        best = np.where(nearer, away, best)
        if quaternions is not None:
            wanted = Slerp([0.0, 1.0], Rotation.from_quat(quaternions[i : i + 2]))(share)
            angle = np.where(nearer, (wanted.inv() * rotation).magnitude(), angle)
    return best, angle
