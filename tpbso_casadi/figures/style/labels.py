"""Labels beside what they name, where they do not overlap.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.style.paper import SMALL

LINE_HEIGHT = 1.2  # of the size of its letters
LEADER = 8.0  # points from the end of a line to its label


@dataclass(frozen=True)
class EndLabel:
    """What stands at the right end of a line.

    Attributes:
        text: of the label.
        place: the line's last value.
        colour: of both.
    """

    text: str
    place: float
    colour: Any


def label_ends(axes: Axes, labels: Sequence[EndLabel]) -> None:
    """Write labels to the right of axes whose limits are set, each as near to the end of its line as the others let it.

    Labels of lines that end outside are written at the edge.
    """
    (_, bottom), (_, top) = axes.transAxes.transform([(0.0, 0.0), (0.0, 1.0)])
    low, high = sorted(axes.get_ylim())
    places = np.clip([label.place for label in labels], low, high)
    ends = np.array([axes.transData.transform((1.0, place))[1] for place in places])
    ends = (ends - bottom) / (top - bottom)
    height = 72.0 * (top - bottom) / axes.get_figure(root=True).dpi  # type: ignore[union-attr]
    moved = spread(ends, LINE_HEIGHT * SMALL / height)
    for label, place, away in zip(labels, places, (moved - ends) * height, strict=True):
        leader = {"arrowstyle": "-", "color": label.colour, "linewidth": 0.6, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate(
            label.text, (1.0, place), (LEADER, away), xycoords=axes.get_yaxis_transform(),
            textcoords="offset points", color=label.colour, fontsize=SMALL, va="center", ha="left",
            arrowprops=leader | {"relpos": (0.0, 0.5)}, annotation_clip=False, parse_math=False,
        )  # fmt: skip


def spread(places: FloatArray, gap: float) -> FloatArray:
    """Places from 0 to 1, (n,), moved as little as possible, in squares, so that no two are nearer than a gap.

    They keep their order, and stay from 0 to 1 if all fit there.
    """
    order = np.argsort(places, kind="stable")
    blocks: list[list[float]] = []  # of neighbours that touch: where the lowest of all places would be, one by one
    for rank, number in enumerate(order):
        blocks.append([float(places[number]) - rank * gap])
        while len(blocks) > 1 and np.mean(blocks[-2]) > np.mean(blocks[-1]):
            last = blocks.pop()
            blocks[-1] += last
    lowest = np.array([np.mean(block) for block in blocks for _ in block])
    spare = 1.0 - gap * max(len(order) - 1, 0)
    lowest = np.clip(lowest, 0.0, spare) if spare > 0.0 else np.full(len(order), spare / 2.0)
    moved = np.empty(len(order))
    moved[order] = lowest + gap * np.arange(len(order))
    return moved
