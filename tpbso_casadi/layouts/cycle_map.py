"""Maps of the least cycle over two coordinates of a place, everything else as in one layout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.layouts.search import EvaluatedLayouts


@dataclass(frozen=True, eq=False)
class CycleMap:
    """The least cycle where a place stands elsewhere.

    Attributes:
        place: "robot", or the name of a frame.
        x: its coordinates, (n,), m.
        y: likewise, (m,).
        seconds: of the least cycle, (m, n); infinite where there is none.
    """

    place: str
    x: FloatArray
    y: FloatArray
    seconds: FloatArray


def cycle_map(layouts: EvaluatedLayouts, x: FloatArray, mounting: int, place: str, points: int) -> CycleMap:
    """The map of a place around a layout.

    Args:
        layouts: evaluates them.
        x: the searched point of the layout, (d,).
        mounting: its number among the template's.
        place: "robot", or the name of a frame, whose x and y are free.
        points: in each direction.

    Raises:
        ScenarioError: its x and y are not free.
    """
    template = layouts.evaluator.template
    first, second = template.across(place)
    axes = [np.linspace(*template.variables[number].bounds, points) for number in (first, second)]
    grid = np.tile(x, (points * points, 1))
    grid[:, first], grid[:, second] = (each.ravel() for each in np.meshgrid(*axes))
    seconds = layouts.seconds(grid, mounting).reshape(points, points)
    return CycleMap(place, axes[0], axes[1], seconds)
