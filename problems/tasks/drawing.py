"""Data of a problem for figures and tables, as plain numbers: a figure need not know which problem it draws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory


class MarkerKind(StrEnum):
    """The role of a marker in the task."""

    START = "start"
    GOAL = "goal"
    POINTS = "points"  # on the way


@dataclass(frozen=True, kw_only=True)
class Marker:
    """Positions that the tip has to reach.

    Attributes:
        label: for a legend.
        points: (n, dim), m.
        kind: which role they have.
        tolerance: how near each has to be passed, m; 0 where a figure need not show it.
        joined: whether the tool stays as near to the lines between them.
    """

    label: str
    points: FloatArray
    kind: MarkerKind
    tolerance: float = 0.0
    joined: bool = False


@dataclass(frozen=True, kw_only=True)
class Milestone:
    """A time of interest within a motion.

    Attributes:
        label: for a legend.
        time: from the start of the motion, s.
    """

    label: str
    time: float


@dataclass(frozen=True, kw_only=True)
class BoundedCurve:
    """A scalar quantity over the time of one motion, with bounds that are known at some times.

    Attributes:
        name: short, for a file name; the curves of one name belong into one figure.
        label: for an axis and a caption.
        symbol: of the quantity, in LaTeX.
        unit: of values and bounds.
        value: the quantity (n,) at times (n,) in s.
        times: at which the bounds are known, (m,), s.
        lower: bounds at these times, (m,).
        upper: likewise.
        event: what happens at these times, for a legend.
    """

    name: str
    label: str
    symbol: str
    unit: str
    value: Callable[[FloatArray], FloatArray]
    times: FloatArray
    lower: FloatArray
    upper: FloatArray
    event: str


@dataclass(frozen=True, kw_only=True)
class ProgressMeasure:
    """A number, beside the cost, that shows the progress of a search: smaller is better.

    Attributes:
        name: short, for a file name.
        label: for an axis and a caption.
        title: what it is, in words.
        unit: of the number and its limit.
        limit: the largest value that is allowed.
        of_candidates: (m,) values of candidates (m, d) of a search.
        of_trajectory: the value of one motion.
    """

    name: str
    label: str
    title: str
    unit: str
    limit: float
    of_candidates: Callable[[FloatArray], FloatArray]
    of_trajectory: Callable[[Trajectory], float]
