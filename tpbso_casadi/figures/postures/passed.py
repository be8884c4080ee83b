"""Places of interest that a tool passes on its way.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.style.colours import ORANGE
from tpbso_casadi.planning.motion import Motion

DIAMOND: dict[str, Any] = {
    "marker": "D", "linestyle": "none", "color": ORANGE, "markeredgecolor": "0.1", "markeredgewidth": 0.6,
    "markersize": 5.0, "zorder": 6,
}  # fmt: skip


@dataclass(frozen=True)
class Points:
    """Positions (n, dim), m, and what they are called."""

    label: str
    places: FloatArray


def passed_by(motion: Motion) -> list[Points]:
    """Where the tool is at the motion's times of interest, each (1, dim), m."""
    return [
        Points(milestone.label, motion.joint_positions(np.array([milestone.time]))[:, -1])
        for milestone in motion.criteria.milestones(motion.trajectory)
    ]


def draw_passed(axes: Axes, passed: Sequence[Points]) -> None:
    """Draw such places in the plane."""
    for points in passed:
        axes.plot(*points.places.T, **DIAMOND)
