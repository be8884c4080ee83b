"""Frames that move, by SciPy's own splines and rotations: the oracle of moving obstacles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from problems import InvalidProblem
from problems.scene import Tabulated
from problems.scene.moving import ConstantVelocity, ObstacleMotion

KINDS = ("velocity", "table", "turning table")
Frames = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Table:
    """Rows of a table of motion.

    Attributes:
        times: (n,), s.
        places: (n, dim), m.
        turns: (n, 1), rad, or (n, 4); None where nothing turns.
    """

    times: np.ndarray
    places: np.ndarray
    turns: np.ndarray | None

    def frames(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins (n, dim) and matrices (n, dim, dim) whose columns are the axes."""
        clock, dim = np.clip(times, self.times[0], self.times[-1]), self.places.shape[1]
        origins = CubicSpline(self.times, self.places)(clock)
        if self.turns is None:
            return origins, np.broadcast_to(np.eye(dim), (len(times), dim, dim))
        if dim == 2:
            angles = CubicSpline(self.times, self.turns)(clock)[:, 0]
            rotation = Rotation.from_rotvec(angles[:, None] * [0.0, 0.0, 1.0])
            return origins, rotation.as_matrix()[:, :2, :2]
        signs = [1.0]
        for one, two in zip(self.turns[:-1], self.turns[1:], strict=True):
            signs.append(signs[-1] * (1.0 if one @ two >= 0.0 else -1.0))
        quaternions = CubicSpline(self.times, self.turns * np.array(signs)[:, None])(clock)
        return origins, Rotation.from_quat(quaternions).as_matrix()


def random_table(rng: np.random.Generator, dim: int, turning: bool) -> Table:
    """Some rows within a metre, each turned by less than 90 degrees from the one before."""
    count = int(rng.integers(2, 7))
    times = rng.uniform(-1.0, 1.0) + np.cumsum(rng.uniform(0.2, 1.0, count))
    places = rng.uniform(-1.0, 1.0, (count, dim))
    if not turning:
        return Table(times, places, None)
    if dim == 2:
        return Table(times, places, np.cumsum(rng.uniform(-1.2, 1.2, (count, 1)), axis=0))
    steps = [Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)) for _ in range(count)]
    turns = [Rotation.random(random_state=int(rng.integers(1 << 30)))]
    for step in steps[1:]:
        turns.append(step * turns[-1])
    signs = rng.choice([-1.0, 1.0], count)  # either sign is the same turn
    return Table(times, places, np.array([turn.as_quat() for turn in turns]) * signs[:, None])


def random_motion(
    rng: np.random.Generator, kind: str, around: tuple[float, ...], speed: float = 2.0
) -> tuple[ObstacleMotion, Frames]:
    """A motion near a point, and a function from times to origins and axes that was written without it."""
    dim = len(around)
    if kind == "velocity":
        velocity, origin = rng.uniform(-speed, speed, dim), around + rng.uniform(-1.0, 1.0, dim)
        motion = ConstantVelocity(tuple(velocity.tolist()), tuple(origin.tolist()))
        axes = np.broadcast_to(np.eye(dim), (1, dim, dim))
        return motion, lambda t: (origin + np.outer(t, velocity), np.repeat(axes, len(t), axis=0))
    while True:
        table = random_table(rng, dim, kind == "turning table")
        table = replace(table, places=table.places + around)
        try:
            return Tabulated.through(table.times.tolist(), table.places, table.turns), table.frames
        except InvalidProblem:  # rows that are turned too far for a spline between them
            continue
