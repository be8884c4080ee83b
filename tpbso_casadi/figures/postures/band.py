"""The band that a tool has to stay in: as wide as it is allowed to be, in metres.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from problems.base.matrix import FloatArray
from problems.tasks.drawing import Marker
from tpbso_casadi.figures.style.colours import GIVEN

CORNERS = 48  # of a circle


def draw_band(axes: Axes, marker: Marker) -> None:
    """Shade what is near enough to the points of a marker, (n, 2), or to the lines between them, if it says so."""
    if not marker.tolerance > 0.0:
        return
    pieces = outlines(marker.points, marker.tolerance, joined=marker.joined)
    path = Path.make_compound_path(*(Path(piece, closed=True) for piece in pieces))
    label = f"within {1000.0 * marker.tolerance:.4g} mm of {'the path' if marker.joined else 'a given point'}"
    axes.add_patch(PathPatch(path, facecolor=GIVEN, alpha=0.16, linewidth=0.0, label=label, zorder=1))


def outlines(points: FloatArray, width: float, *, joined: bool) -> Sequence[FloatArray]:
    """Outlines (m, 2), all counter-clockwise, that together are all within a width of points (n, 2), or of lines."""
    turn = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    circle = width * np.column_stack([np.cos(turn), np.sin(turn)])
    found = [point + circle for point in points]
    for start, end in pairwise(points) if joined else ():
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            across = width * np.array([[0.0, -1.0], [1.0, 0.0]]) @ (end - start) / length
            corners = [start - across, end - across, end + across, start + across]
            found.append(np.array([*corners, corners[0]]))
    return found
