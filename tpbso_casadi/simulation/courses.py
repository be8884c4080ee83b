"""How obstacles change course: velocities that are drawn at random, and walls at which they turn around."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray
from problems.scene.moving.tabulated import Tabulated


@dataclass(frozen=True, kw_only=True)
class Wandering:
    """Straight lines between changes of course, at times that have nothing to do with those of the planner.

    Every velocity lies in a ball, so that no two of them differ by more than its diameter.

    Attributes:
        velocity: at t = 0, (dim,), m/s, in the ball.
        center: of the ball, (dim,), m/s; zero where there are walls.
        radius: of the ball, m/s.
        changes_every: mean time between two changes, which are independent of each other, s; infinite for none.
        room: the least and the largest displacement in every coordinate, (2, dim), m; infinite without walls.
    """

    velocity: FloatArray
    center: FloatArray
    radius: float
    changes_every: float
    room: FloatArray

    def course(self, seconds: float, generator: np.random.Generator) -> Tabulated:
        """The displacement from 0 to ``seconds``, exact."""
        time, place, velocity = 0.0, np.zeros_like(self.velocity), self.velocity
        times, places = [time], [place]
        change = self._wait(generator)
        while time < seconds:
            wall, axis = self._next_wall(place, velocity)
            after = min(time + wall, change, seconds)
            place = np.clip(place + (after - time) * velocity, *self.room)
            if after == change:
                velocity, change = self._drawn(generator), change + self._wait(generator)
            elif after < seconds:
                velocity = np.where(np.arange(velocity.size) == axis, -velocity, velocity)
            if after > time:
                times.append(after)
                places.append(place)
            time = after
        return Tabulated.along_lines(times, np.array(places))

    def _wait(self, generator: np.random.Generator) -> float:
        return float(generator.exponential(self.changes_every)) if np.isfinite(self.changes_every) else np.inf

    def _drawn(self, generator: np.random.Generator) -> FloatArray:
        """Any velocity of the ball, all alike."""
        direction = generator.normal(size=self.center.size)
        size = self.radius * generator.random() ** (1.0 / self.center.size)
        return np.asarray(self.center + size * direction / np.linalg.norm(direction))

    def _next_wall(self, place: FloatArray, velocity: FloatArray) -> tuple[float, int]:
        """Time until a wall is met, s, and its axis."""
        ahead = np.where(velocity > 0.0, self.room[1], self.room[0]) - place
        with np.errstate(divide="ignore", invalid="ignore"):
            waits = np.where(velocity == 0.0, np.inf, ahead / velocity)
        axis = int(np.argmin(waits))
        return max(float(waits[axis]), 0.0), axis
