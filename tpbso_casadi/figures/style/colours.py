"""Colours and line styles that a reader can tell apart, in print and with any kind of colour vision.

The colours are those of Okabe and Ito, "Color Universal Design", 2008, without yellow, which is lost on white.
"""

from __future__ import annotations

from typing import Any

BLUE, VERMILLION, GREEN, PURPLE = "#0072b2", "#d55e00", "#009e73", "#cc79a7"
ORANGE, SKY, BLACK = "#e69f00", "#56b4e9", "#000000"

SERIES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (5, 1.2, 1, 1.2)), (0, (8, 2)), (0, (3, 1, 1, 1, 1, 1)), (0, (2, 2)))
MARKERS = ("o", "s", "^", "D", "v", "P", "X")

OBSTACLE, COURSE = VERMILLION, "#8c3d00"  # and the way of one that moves
CLOSEST = "#a03070"


def colour_of(index: int) -> str:
    """The colour of a joint, or of a solver, (0-based) in every figure."""
    return SERIES[index % len(SERIES)]


def line_of(index: int) -> dict[str, Any]:
    """Colour and dashes of a line, for ``Axes.plot``: two lines of one colour never have the same dashes."""
    return {"color": colour_of(index), "linestyle": DASHES[(index + index // len(SERIES)) % len(DASHES)]}


def marker_of(index: int) -> str:
    """The marker of a joint, or of a solver, (0-based)."""
    return MARKERS[index % len(MARKERS)]
