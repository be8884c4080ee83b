"""Two objectives as one falling number: how much of the best known front a run has not reached.

[1] D. Brockhoff, A. Auger, N. Hansen and T. Tušar, "Using well-understood single-objective functions in multiobjective
    black-box optimization test suites", Evolutionary Computation 30(2), 2022: the indicator of bbob-biobj.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from math import hypot, inf

from tpbso_casadi.suite.kernels import FloatArray

CORNER = 1.1  # of both objectives, where 0 is the best of the known front and 1 the worst: volumes end here
FEASIBLE = 2.0  # the number up to which a run has a feasible candidate


@dataclass(frozen=True, kw_only=True)
class BestFront:
    """The best front that is known of a problem.

    Attributes:
        ideal: the least of each objective on it, (2,).
        nadir: the largest, (2,).
        hypervolume: of all candidates that were found, where objectives are 0 at the ideal and 1 at the nadir, up to
            1.1 in both.
        x: some of these candidates, (k, d).
        values: their objectives, (k, 2), ascending in the first.
        ways: by the name of a way to search, what share of the hypervolume its run had.
    """

    ideal: FloatArray
    nadir: FloatArray
    hypervolume: float
    x: FloatArray
    values: FloatArray
    ways: dict[str, float]


class Attainment:
    """The front that a run has so far, and what is missing of the best known one.

    Attributes:
        value: 1 less the share of the known hypervolume, once a feasible candidate is better than the corner in both
            objectives, so that 0 is as good as the known front; before, from 1 to 2 with the distance d from there,
            1 + d / (1 + d) [1]; above 2 as long as nothing is feasible, by as much as the best candidate breaks.
            Infinite before the first candidate.

    Args:
        known: the front that is known.
        bound: the first merit up to which a candidate is feasible.
    """

    def __init__(self, known: BestFront, bound: float) -> None:
        self._bound, self._volume = bound, known.hypervolume
        self._ideal, self._extent = known.ideal.tolist(), (known.nadir - known.ideal).tolist()
        self._first: list[float] = []  # of the front, ascending
        self._second: list[float] = []  # descending
        self.hypervolume = 0.0
        self.value = inf

    def add(self, merits: tuple[float, float]) -> float:
        """The value with one more candidate, of which both merits are given."""
        self.value = min(self.value, self._with(merits))
        return self.value

    def _with(self, merits: tuple[float, float]) -> float:
        if merits[0] > self._bound:
            return FEASIBLE + merits[0] - self._bound
        first, second = ((m - i) / e for m, i, e in zip(merits, self._ideal, self._extent, strict=True))
        if first < CORNER and second < CORNER:
            self.hypervolume += self._gained(first, second)
            return 1.0 - self.hypervolume / self._volume
        distance = hypot(max(first - CORNER, 0.0), max(second - CORNER, 0.0))
        return 1.0 + distance / (1.0 + distance)

    def _gained(self, first: float, second: float) -> float:
        """Put a point in its place on the front; the area that only it dominates."""
        place = end = bisect_left(self._first, first)
        height = self._second[place - 1] if place else CORNER
        is_known = place < len(self._first) and (self._first[place], self._second[place]) <= (first, second)
        if height <= second or is_known:
            return 0.0
        area, left = 0.0, first
        while end < len(self._first) and self._second[end] >= second:
            area += (self._first[end] - left) * (height - second)
            left, height = self._first[end], self._second[end]
            end += 1
        right = self._first[end] if end < len(self._first) else CORNER
        self._first[place:end], self._second[place:end] = [first], [second]
        return area + (right - left) * (height - second)
