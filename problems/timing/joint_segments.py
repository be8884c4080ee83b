"""The least time in which a joint gets from an interval of velocities to another one, whatever its accelerations there.

The farthest that it can be after a time t, from velocity u_0 to u_1, has the acceleration ``clip(J (x - s), -A, A)`` at
time s: the sooner it accelerates, the farther it is. From x to the start its velocity changes by g(x), from x to the
end by g(y), y = t - x, with the even ``g(x) = integral of clip(J s, -A, A) ds from 0 to x``. So x follows from
``u_1 - u_0 = g(x) - g(y)``. The peak of the velocity is ``u_0 + g(x)``, though x may lie before the start or after the
end, and the distance is the peak times t less H(x) and H(y), where H is the integral of g. Where the peak is beyond the
limit of speed, the joint cruises at that. The distance grows with u_0 and u_1.

A joint can be as far in more time: with its velocity v(s / c), c > 1, it has the same velocities at both ends, lower
accelerations and jerks, and goes c times as far. So if a time is too short for a distance, all that are less are, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.robots import JointLimits

HALVINGS = 16  # of an interval that holds a least duration, or a peak of the velocity
NO_SWING = 1e-12  # s, from no acceleration to the largest where jerks are not limited
ROUNDING = 1e-10  # share of how far a joint comes at full speed; what is computed is wrong by some 1e-14


@dataclass(frozen=True, eq=False)
class Ramps:
    """Limits of joints, of shapes that broadcast: speed V, acceleration A, jerk J.

    Attributes:
        speed: rad/s.
        acceleration: rad/s^2.
        swing: the time A / J from no acceleration to the largest, s.
    """

    speed: FloatArray
    acceleration: FloatArray
    swing: FloatArray

    @classmethod
    def of(cls, limits: JointLimits) -> Self:
        """The limits of joints, (k,)."""
        speed, acceleration, *jerks = limits.by_order
        return cls(speed, acceleration, acceleration / jerks[0] if jerks else np.full(limits.dof, NO_SWING))

    def shaped(self, *shape: int) -> Ramps:
        """The limits of the joints as arrays of a shape that broadcasts."""
        return Ramps(*(each.reshape(shape) for each in (self.speed, self.acceleration, self.swing)))

    @property
    def jerk(self) -> FloatArray:
        """The limit J, rad/s^3."""
        return np.asarray(self.acceleration / self.swing)

    def change(self, x: FloatArray) -> FloatArray:
        """The change of velocity g(x), rad/s."""
        size = np.abs(x)
        near = np.minimum(size, self.swing)
        return np.asarray(self.acceleration * (size - near) + self.jerk * near * near / 2.0)

    def time_of(self, change: FloatArray) -> FloatArray:
        """The time x >= 0 with g(x) = change >= 0, s."""
        short = np.sqrt(2.0 * change / self.jerk)
        return np.where(short <= self.swing, short, change / self.acceleration + self.swing / 2.0)

    def distance(self, x: FloatArray) -> FloatArray:
        """The odd integral H(x) of g, rad."""
        size = np.abs(x)
        near = np.minimum(size, self.swing)
        far = size - near
        curved = self.jerk * near**3 / 6.0
        found = curved + far * (self.jerk * near * near + self.acceleration * far) / 2.0
        return np.asarray(np.sign(x) * found)

    def halves(self, time: FloatArray, change: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The times x and y with x + y = time and g(x) - g(y) = change, s; |change| <= A time."""
        size, acceleration, swing = np.abs(change), self.acceleration, self.swing
        near = (time - 2.0 * size / (self.jerk * np.maximum(time, np.finfo(float).tiny))) / 2.0
        rest = acceleration * (time - swing / 2.0) - size
        mixed = (np.sqrt(np.maximum(acceleration**2 + 2.0 * self.jerk * rest, 0.0)) - acceleration) / self.jerk
        far = (time - size / acceleration) / 2.0
        shorter = np.where(time - near <= swing, near, np.where(far >= swing, far, np.clip(mixed, -swing, swing)))
        longer = time - shorter
        return np.where(change >= 0.0, longer, shorter), np.where(change >= 0.0, shorter, longer)


@dataclass(frozen=True, eq=False)
class JointSegments:
    """Moves of joints over a distance >= 0, from one interval of velocities to another; of shapes that broadcast.

    Attributes:
        ramps: the limits.
        distance: rad.
        first: lowest and highest velocity at the start, rad/s.
        last: at the end.
    """

    ramps: Ramps
    distance: FloatArray
    first: tuple[FloatArray, FloatArray]
    last: tuple[FloatArray, FloatArray]

    def farthest(self, time: FloatArray) -> FloatArray:
        """The largest distance in a time, rad."""
        ramps, gained = self.ramps, self.ramps.acceleration * time
        start, end = np.minimum(self.first[1], self.last[1] + gained), np.minimum(self.last[1], self.first[1] + gained)
        x, y = ramps.halves(time, end - start)
        peak = start + ramps.change(x)
        cruises = (x > 0.0) & (y > 0.0) & (peak > ramps.speed)
        x = np.where(cruises, ramps.time_of(np.maximum(ramps.speed - start, 0.0)), x)
        y = np.where(cruises, ramps.time_of(np.maximum(ramps.speed - end, 0.0)), y)
        return np.where(cruises, ramps.speed, peak) * time - ramps.distance(x) - ramps.distance(y)

    def durations(self) -> FloatArray:
        """Durations that none is below, s."""
        ramps, d, (start, end) = self.ramps, self.distance, (self.first[1], self.last[1])
        gap = np.maximum(np.maximum(self.last[0] - start, self.first[0] - end), 0.0)
        least = np.maximum(gap / ramps.acceleration, steepest_time(ramps, d, start, end))
        allowed = d - ROUNDING * ramps.speed * (least + ramps.swing)
        found = least + _first_time(
            lambda later: self.farthest(least + later) >= allowed, 2.0 * ramps.swing, least.shape
        )
        return self.beyond_overshoot(found)

    def beyond_overshoot(self, time: FloatArray) -> FloatArray:
        """The next of the durations in which the joint need not go beyond the distance, even without jerk limits, s."""
        ramps, d, (start, end) = self.ramps, self.distance, (-self.first[0], -self.last[0])
        slower, gained = np.minimum(start, end), ramps.acceleration * time
        peak = np.maximum((start + end + gained) / 2.0, np.maximum(start, end))
        tent = peak * time - ((peak - start) ** 2 + (peak - end) ** 2) / (2.0 * ramps.acceleration)
        nearest = np.where(gained < np.abs(start - end), (slower + gained / 2.0) * time, tent)
        overshoots = nearest < -d - ROUNDING * ramps.speed * time
        return np.where(overshoots, np.maximum(time, steepest_time(ramps, -d, start, end)), time)


def steepest_time(ramps: Ramps, distance: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """The last time in which a distance is just reached without jerk limits, from and to velocities no higher, s."""
    v, a = ramps.speed, ramps.acceleration
    slower, squares = np.minimum(start, end), start**2 + end**2
    peak = np.sqrt(np.maximum(2.0 * a * distance + squares, 0.0) / 2.0)
    both = (2.0 * peak - start - end) / a
    cruise = (2.0 * v - start - end) / a + (distance - (2.0 * v**2 - squares) / (2.0 * a)) / v
    one = (np.sqrt(np.maximum(slower**2 + 2.0 * a * distance, 0.0)) - slower) / a
    return np.where(peak < np.maximum(start, end), one, np.where(peak > v, cruise, both))


def _first_time(
    reaches: Callable[[FloatArray], NDArray[np.bool_]], scale: FloatArray, shape: tuple[int, ...]
) -> FloatArray:
    """A time from 0 on, a little before the first that reaches, of those that do not before and do after it, s."""
    low, high = np.zeros(shape), np.broadcast_to(scale, shape).copy()
    while not (there := reaches(high)).all():
        low, high = np.where(there, low, high), np.where(there, high, 2.0 * high)
    at_once = reaches(low)
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        there = reaches(middle)
        low, high = np.where(there, low, middle), np.where(there, middle, high)
    return np.where(at_once, 0.0, low)


def from_rest(ramps: Ramps, distance: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Durations that no move over a distance >= 0 is below, from rest without acceleration to a velocity, s.

    Backward in time it is the way to rest from that velocity.

    Where the velocity has a peak P on the way, the joint needs ``P / A + A / J`` to get there, or ``2 sqrt(P / J)``.

    Args:
        ramps: the limits.
        distance: rad.
        low: the least velocity at the other end, rad/s.
        high: the largest.
    """
    rest = np.zeros_like(high)
    least = JointSegments(ramps, distance, (rest, rest), (low, high)).durations()
    least = np.maximum(least, ramps.time_of(np.maximum(np.maximum(low, -high), 0.0)))
    least = np.maximum(least, _rising_time(ramps, distance))
    base = np.maximum(high, 0.0)
    time, reached = _over_peak(ramps, base, high)
    allowed = distance - ROUNDING * ramps.speed * (time + ramps.swing)
    peak = base + _first_time(
        lambda more: (base + more >= ramps.speed) | (_over_peak(ramps, base + more, high)[1] >= allowed),
        ramps.speed - base + NO_SWING * ramps.speed,
        reached.shape,
    )
    time, _ = _over_peak(ramps, peak, high)
    top, most = _over_peak(ramps, ramps.speed, high)
    cruising = top + np.maximum(allowed - most, 0.0) / ramps.speed
    passing = np.where(most < allowed, cruising, time)
    return np.where(reached < allowed, np.maximum(least, passing), least)


def _over_peak(ramps: Ramps, peak: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The time, s, and the distance, rad, from rest without acceleration over a peak to a last velocity below it."""
    rising = np.where(
        peak < ramps.acceleration * ramps.swing,
        2.0 * np.sqrt(peak / ramps.jerk),
        peak / ramps.acceleration + ramps.swing,
    )
    falling = ramps.time_of(peak - last)
    return rising + falling, peak * rising / 2.0 + peak * falling - ramps.distance(falling)


def _rising_time(ramps: Ramps, distance: FloatArray) -> FloatArray:
    """The least time from rest without acceleration over a distance, s: by the jerk, then by the acceleration alone."""
    jerk, a, swing = ramps.jerk, ramps.acceleration, ramps.swing
    beyond = distance - jerk * swing**3 / 6.0
    speed = a * swing / 2.0
    later = swing + (np.sqrt(speed**2 + 2.0 * a * np.maximum(beyond, 0.0)) - speed) / a
    return np.where(beyond > 0.0, later, np.cbrt(6.0 * distance / jerk))
