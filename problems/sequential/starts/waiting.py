"""Motions that let obstacles pass before they begin."""

from __future__ import annotations

import numpy as np

from problems.motions.trajectory import Trajectory


def delayed(trajectory: Trajectory, seconds: float) -> Trajectory:
    """The same after it has stood still at its start for so many seconds."""
    first = np.zeros_like(trajectory.coefficients[:, :1])
    first[-1, 0] = trajectory.coefficients[-1, 0]
    breakpoints = np.concatenate([[0.0], trajectory.breakpoints + seconds])
    return Trajectory(breakpoints, np.concatenate([first, trajectory.coefficients], axis=1))
