"""How obstacles of random scenes move, in NumPy and SciPy alone: what motions are judged with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from problems.base import FloatArray

ROWS, LAST_ROW = 7, 4.0  # of a table of motion; s
MOST_TURN = 1.0  # rad from row to row
STRAIGHT = 0.4  # of the courses that are at a constant velocity


@dataclass(frozen=True)
class Course:
    """Where an obstacle's frame is over time; before the first time of a table and after the last it stands still.

    Attributes:
        times: of the rows, (n,), s; of one that moves at a constant velocity, 0 and 1.
        places: (n, dim), m.
        turns: angles (n, 1), rad, or quaternions x, y, z, w, (n, 4); None where it does not turn.
        tabled: whether it is a table, not a constant velocity.
    """

    times: FloatArray
    places: FloatArray
    turns: FloatArray | None = None
    tabled: bool = True

    @property
    def velocity(self) -> FloatArray:
        """The constant one, (dim,), m/s."""
        return np.asarray(self.places[1] - self.places[0])

    def frames(self, times: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Origins (n, dim), m, and matrices (n, dim, dim) with the axes in their columns, None where it never turns."""
        if not self.tabled:
            return self.places[0] + np.outer(times, self.velocity), None
        clock = np.clip(times, self.times[0], self.times[-1])
        origins = np.asarray(CubicSpline(self.times, self.places)(clock))
        if self.turns is None:
            return origins, None
        turns = np.asarray(CubicSpline(self.times, self.turns)(clock))
        if turns.shape[1] == 4:
            return origins, np.asarray(Rotation.from_quat(turns).as_matrix())
        cosine, sine = np.cos(turns[:, 0]), np.sin(turns[:, 0])
        return origins, np.moveaxis(np.array([[cosine, -sine], [sine, cosine]]), 2, 0)

    def stopped(self) -> Course:
        """The same, standing where it is at t = 0."""
        origins, _ = self.frames(np.zeros(1))
        turns = None if self.turns is None else self.turns[:1].repeat(2, axis=0)
        return Course(np.array([0.0, 1.0]), origins.repeat(2, axis=0), turns)

    def seen(self, points: FloatArray, times: FloatArray) -> FloatArray:
        """Points (n, m, dim) at times (n,) as seen from the frame."""
        origins, axes = self.frames(times)
        away = points - origins[:, None]
        return away if axes is None else np.asarray(np.einsum("nij,nmi->nmj", axes, away))

    @property
    def rows(self) -> list[list[float]]:
        """The table as a scenario states it."""
        parts = [self.times[:, None], self.places, *([] if self.turns is None else [self.turns])]
        return [[float(number) for number in row] for row in np.hstack(parts)]


def random_course(
    rng: np.random.Generator, point: FloatArray, time: float, speed: float, straight: float = STRAIGHT
) -> Course:
    """Through a point at a time at a speed: at a constant velocity, or along a bent table, turning or not."""
    dim = len(point)
    way = rng.normal(size=dim)
    velocity = speed * way / np.linalg.norm(way)
    if rng.random() < straight:
        start = point - time * velocity
        return Course(np.array([0.0, 1.0]), np.array([start, start + velocity]), tabled=False)
    times = np.linspace(0.0, LAST_ROW, ROWS)
    bend = rng.normal(size=dim) * rng.uniform(0.0, 0.3)
    places = point + np.outer(times - time, velocity) + np.outer((times - time) ** 2, bend)
    return Course(times, places, _random_turns(rng, dim) if rng.random() < 0.6 else None)


def _random_turns(rng: np.random.Generator, dim: int) -> FloatArray:
    """From row to row by one angle, (ROWS, 1) or (ROWS, 4)."""
    angles = rng.uniform(-MOST_TURN, MOST_TURN) * np.arange(ROWS)
    if dim == 2:
        return np.asarray(angles[:, None] + rng.uniform(0.0, 3.0))
    axis = rng.normal(size=3)
    turned = Rotation.from_rotvec(np.outer(angles, axis / np.linalg.norm(axis)))
    quaternions = (turned * Rotation.random(random_state=int(rng.integers(1 << 30)))).as_quat()
    signs = np.where((quaternions[1:] * quaternions[:-1]).sum(axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(quaternions * np.cumprod(np.append(1.0, signs))[:, None])
