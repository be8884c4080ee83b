"""Recorded motions of an arm of two links: a quintic from rest to rest, as rows and as a file."""

from __future__ import annotations

import numpy as np

from problems.base import FloatArray

ARM = "[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 2.0\nmax_acceleration = 10.0\n"
TIMES = np.linspace(0.0, 2.0, 9)
START = (0.1, 0.3)


def states(
    way: tuple[float, float] = (1.0, -0.4), times: FloatArray = TIMES, start: tuple[float, float] = START
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions, velocities and accelerations (n, 2) at the times of a motion that takes the last of them."""
    u, total = times / times[-1], times[-1]
    position = np.array(start) + np.outer(10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5, way)
    velocity = np.outer(30.0 * u**2 * (1.0 - u) ** 2 / total, way)
    return position, velocity, np.outer((60.0 * u - 180.0 * u**2 + 120.0 * u**3) / total**2, way)


def write_rows(name: str, seconds: float, columns: int = 7) -> None:
    """A table of nine rows, from where all angles are zero; with five columns it has no accelerations."""
    times = np.linspace(0.0, seconds, 9)
    table = np.column_stack([times, *states(times=times, start=(0.0, 0.0))])[:, :columns]
    header = ",".join(["t", "q1", "q2", "qd1", "qd2", "qdd1", "qdd2"][:columns])
    np.savetxt(name, table, delimiter=",", header=header, comments="", fmt="%.17g")
