"""Points of a front: asked for, and found; fronts with their width, hypervolume and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from problems.base import FloatArray

Pair: TypeAlias = tuple[float, float]


class Standing(StrEnum):
    """The standing of a point beside the others of its method."""

    FRONT = "front"
    DOMINATED = "dominated"  # another plan is no worse in either objective
    REPEATED = "repeated"  # the same as another to ``SAME`` of the front's width
    NOT_CERTIFIED = "not certified"


@dataclass(frozen=True)
class Scalarisation:
    """One objective out of two.

    Attributes:
        weights: of the two objectives; not both zero.
        longest: the most that the motion may take, s; None where nothing more is asked for than the scenario does.
    """

    weights: Pair
    longest: float | None = None


@dataclass(frozen=True, kw_only=True)
class Request:
    """A plan to be made.

    Attributes:
        scalarisation: what is minimised.
        attempt: 0, or how often it has been planned before.
        starts: numbers of points whose motions a refinement begins with.
    """

    scalarisation: Scalarisation
    attempt: int = 0
    starts: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Point:
    """A plan and what it is in both objectives.

    Attributes:
        number: from 1 on.
        request: that it answers; None where one run made all points.
        values: of the two objectives, exact, in their units.
        duration: of its motion, s.
        certified: whether every constraint is proven to hold for all t.
        seed: of the search.
        evaluations: of the search.
        seconds: that planning it took; 0 where one run made all points.
        folder: of the run, relative to that of the trade-off; empty where there is none.
    """

    number: int
    request: Request | None
    values: Pair
    duration: float
    certified: bool
    seed: int
    evaluations: int
    seconds: float
    folder: str


SAME = 1e-4  # of the front's width in an objective: two plans that differ by less are the same
ROUNDING = 1e-9  # of the largest value: two that differ by less are the same
REFERENCE = 0.1  # of the front's width, by which the reference of the hypervolume is worse than the worst


@dataclass(frozen=True)
class PointFront:
    """The certified points of one method that no other one dominates, by the first objective.

    Attributes:
        points: on the front.
        standings: of all points, by number.
    """

    points: tuple[Point, ...]
    standings: dict[int, Standing]

    @classmethod
    def of(cls, points: Sequence[Point]) -> PointFront:
        """The front of points; of several that are the same, to rounding, the first."""
        certified = [point for point in points if point.certified]
        standings = {point.number: Standing.NOT_CERTIFIED for point in points}
        same = SAME * width([point.values for point in certified])
        kept: list[Point] = []
        for point in sorted(certified, key=lambda each: (each.values, each.number)):
            if kept and point.values[1] >= kept[-1].values[1]:
                near = np.abs(np.subtract(point.values, kept[-1].values)) <= same
                standings[point.number] = Standing.REPEATED if near.all() else Standing.DOMINATED
                continue
            kept.append(point)
            standings[point.number] = Standing.FRONT
        return cls(tuple(kept), standings)

    @property
    def values(self) -> FloatArray:
        """Objectives of the points, (n, 2)."""
        return np.array([point.values for point in self.points]).reshape(-1, 2)

    @property
    def gaps(self) -> list[tuple[Point, Point]]:
        """Neighbours, those farthest apart first; distances are shares of the front's width."""
        scale = width([point.values for point in self.points])

        def distance(gap: tuple[Point, Point]) -> float:
            return float(np.hypot(*(np.subtract(gap[0].values, gap[1].values) / scale)))

        return sorted(pairwise(self.points), key=distance, reverse=True)


def width(values: Sequence[Pair]) -> FloatArray:
    """The distance from least to largest of each objective, (2,); 1 where that is rounding alone."""
    if not values:
        return np.ones(2)
    spread, largest = np.ptp(np.array(values), axis=0), np.abs(np.array(values)).max(axis=0)
    return np.where(spread > ROUNDING * largest, spread, 1.0)


def reference_point(values: FloatArray) -> Pair:
    """A point that is worse than all values (n, 2) in both objectives, by ``REFERENCE`` of their width."""
    first, second = values.max(axis=0) + REFERENCE * width([(a, b) for a, b in values.tolist()])
    return float(first), float(second)


def hypervolume(values: FloatArray, reference: Pair) -> float:
    """The area between the values (n, 2) and a reference point that they dominate, in the product of both units."""
    area, height = 0.0, reference[1]
    for first, second in sorted(values.tolist()):
        if first < reference[0] and second < height:
            area += (reference[0] - first) * (height - second)
            height = second
    return area


@dataclass(frozen=True)
class FrontSummary:
    """The worth of the front of a method, and what it took.

    Attributes:
        method: its name.
        points: made; of several runs of one point, each counts.
        on_front: of them.
        hypervolume: in the product of both units.
        evaluations: of all searches.
        seconds: of all plans.
    """

    method: str
    points: int
    on_front: int
    hypervolume: float
    evaluations: int
    seconds: float


@dataclass(frozen=True)
class TradeOff:
    """All points of all methods.

    Attributes:
        headings: the objectives with their units.
        points: by method.
    """

    headings: tuple[str, str]
    points: Mapping[str, list[Point]]

    @property
    def fronts(self) -> dict[str, PointFront]:
        """The fronts by method."""
        return {method: PointFront.of(points) for method, points in self.points.items()}

    @property
    def reference(self) -> Pair | None:
        """The point that all fronts dominate, from which the hypervolume is counted; None without a front."""
        values = np.concatenate([np.empty((0, 2)), *(front.values for front in self.fronts.values())])
        return reference_point(values) if len(values) else None

    @property
    def summaries(self) -> list[FrontSummary]:
        """The summaries by method."""
        reference, fronts = self.reference, self.fronts
        return [
            FrontSummary(
                method,
                len(points),
                len(fronts[method].points),
                0.0 if reference is None else hypervolume(fronts[method].values, reference),
                sum(point.evaluations for point in points),
                sum(point.seconds for point in points),
            )
            for method, points in self.points.items()
        ]

    @property
    def rows(self) -> list[list[object]]:
        """The rows of ``front.csv``: each method's points in the order in which they were made."""
        return [
            [
                point.number, *point.values, point.duration, "yes" if point.certified else "no",
                str(front.standings[point.number]), method, point.seed, point.evaluations, round(point.seconds, 3),
                point.folder,
            ]
            for method, front in self.fronts.items()
            for point in self.points[method]
        ]  # fmt: skip
