"""The motion of a path and its speed, exact in time."""

from __future__ import annotations

import numpy as np

from problems.motions.trajectory import Trajectory
from problems.sequential.clock import Clock
from problems.sequential.path_speed import PathSpeed
from problems.sequential.starts.waiting import delayed

LEAST_DELAY = 1e-6  # s
IN_PIECE = 8  # pieces in time for each of the speed


def timed(motion: PathSpeed, in_piece: int = IN_PIECE) -> Trajectory:
    """Polynomials of degree 5 in time that agree with it in angles, velocities and accelerations where they meet."""
    grid = motion.space.grid(motion.space.even(in_piece))
    q, (v, a, _) = motion.theta(grid), motion.derivatives(grid)
    steps = Clock(motion.space, grid.u).steps(motion.speeds)
    h = steps[:, None]
    q0, q1 = q[:-1], q[1:]
    v0, v1, a0, a1 = v[:-1] * h, v[1:] * h, a[:-1] * h**2 / 2.0, a[1:] * h**2 / 2.0
    way = q1 - q0 - v0 - a0
    turn, bend = v1 - v0 - 2.0 * a0, a1 - a0
    scaled = np.stack([6.0 * way - 3.0 * turn + bend, -15.0 * way + 7.0 * turn - 2.0 * bend,
                       10.0 * way - 4.0 * turn + bend, a0, v0, q0])  # fmt: skip
    powers = np.arange(5, -1, -1)[:, None]
    moving = Trajectory(np.concatenate([[0.0], np.cumsum(steps)]), scaled / (steps**powers)[..., None])
    return moving if motion.delay < LEAST_DELAY else delayed(moving, motion.delay)
