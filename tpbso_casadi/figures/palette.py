"""Colours, lines and markers that tell apart, and the formats of figures; loads no matplotlib.

The colours are those of Okabe and Ito, "Color Universal Design", 2008, without yellow, which is lost on white; each is
moved a little so that with protanopia, deuteranopia and tritanopia no two are nearer than 22 in CIELAB (16 before),
and the first four are no nearer than 32. Colour alone never carries a meaning: lines have dashes, points have markers.
"""

from __future__ import annotations

from typing import Any

FORMATS = ("png", "pdf", "svg")
DEFAULT = ("png",)


BLUE, VERMILLION, SKY, PURPLE = "#075692", "#c04a07", "#25aff8", "#c081a1"
GREEN, ORANGE, BLACK = "#009053", "#e88f17", "#000000"

SERIES = (BLUE, VERMILLION, SKY, PURPLE, GREEN, ORANGE, BLACK)
DASHES = ("-", (0, (5, 1.5)), (0, (1, 1.2)), (0, (5, 1.2, 1, 1.2)), (0, (8, 2)), (0, (3, 1, 1, 1, 1, 1)), (0, (2, 2)))
MARKERS = ("o", "s", "^", "D", "v", "P", "X")

OBSTACLE, COURSE = VERMILLION, "#8c3d00"  # and the way of one that moves
CLOSEST = "#a03070"
BROKEN = "#c8102e"  # where a limit is
GIVEN, PATH = GREEN, BLUE  # what a task states, and the way that was planned for the tool
LIMIT = "0.25"
NEUTRAL = "#b4bcc4"  # of links whose colour nobody states
FIRST, LAST = (0.66, 0.75, 0.85), (0.07, 0.11, 0.16)  # of postures over time, RGB: from light to dark, in grey too


def colour_of(index: int) -> str:
    """The colour of a joint, or of a solver, (0-based) in every figure."""
    return SERIES[index % len(SERIES)]


def line_of(index: int) -> dict[str, Any]:
    """Colour and dashes of a line, for ``Axes.plot``: two lines of one colour never have the same dashes."""
    return {"color": colour_of(index), "linestyle": DASHES[(index + index // len(SERIES)) % len(DASHES)]}


def marker_of(index: int) -> str:
    """The marker of a joint, or of a solver, (0-based)."""
    return MARKERS[index % len(MARKERS)]


def shade_of(share: float) -> tuple[float, float, float]:
    """The colour of a posture at a share of the time of its motion, from 0 to 1, as RGB from 0 to 1."""
    red, green, blue = (first + share * (last - first) for first, last in zip(FIRST, LAST, strict=True))
    return red, green, blue
