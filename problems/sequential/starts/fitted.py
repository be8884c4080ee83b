"""A first path and speed: those of a motion that is there already, or of a line that is bent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.sequential.path_speed import RESTING, MotionSpace, PathSpeed

SAMPLES = 400


def fitted(trajectory: Trajectory, space: MotionSpace) -> PathSpeed:
    """The path nearest to a motion, with the share of its duration as the parameter, run at constant speed."""
    u = np.linspace(0.0, 1.0, SAMPLES)
    theta = trajectory.at(u * trajectory.duration)
    basis = space.path.matrix(u)
    controls = np.repeat(theta[[0, -1]], [space.path.size - RESTING, RESTING], axis=0)
    controls[:RESTING] = theta[0]
    inner = slice(RESTING, -RESTING)
    fixed = controls.copy()
    fixed[inner] = 0.0
    controls[inner] = np.linalg.lstsq(basis[:, inner], theta - basis @ fixed, rcond=None)[0]
    return PathSpeed(space, controls, np.full(space.speed.size, 1.0 / trajectory.duration))


def bent(motion: PathSpeed, bend: FloatArray) -> PathSpeed:
    """The same motion with its path moved sideways, by ``bend`` (k,) rad in the middle and not at the ends."""
    share = np.linspace(0.0, 1.0, len(motion.controls) - 2 * RESTING + 2)[1:-1, None]
    controls = motion.controls.copy()
    controls[RESTING:-RESTING] += 4.0 * share * (1.0 - share) * bend
    return replace(motion, controls=controls)
