"""Points of a front: asked for, and found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

Pair: TypeAlias = tuple[float, float]


class Standing(StrEnum):
    """What a point is beside the others of its method."""

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
