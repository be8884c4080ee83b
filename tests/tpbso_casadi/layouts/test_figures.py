"""Maps and searches of layouts: what is drawn is what is there."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

from problems.base import FloatArray
from tpbso_casadi.layouts import CycleMap
from tpbso_casadi.layouts.figures import convergence_figure, map_figure

SECONDS = np.array([[3.0, 4.0, np.inf], [3.5, 4.5, 5.0]])
X, Y = np.array([0.0, 0.1, 0.2]), np.array([-0.1, 0.1])


def square(x: float, y: float, size: float = 0.1) -> FloatArray:
    return np.array([x, y]) + size * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@pytest.mark.parametrize("hatched", [True, False])
def test_a_map_says_what_stands_where_and_where_no_cycle_is(hatched: bool) -> None:
    seconds = SECONDS if hatched else np.minimum(SECONDS, 9.0)
    outlines = [
        ("bin", square(0.5, 0.0)),
        ("bin", square(0.7, 0.0)),
        ("", square(0.5, 0.3)),
        ("floor", square(-1, -1, 3)),
    ]
    figure = map_figure(CycleMap("pedestal", X, Y, seconds), outlines, (0.1, -0.1))
    axes, colours = figure.axes
    [mesh] = [each for each in axes.collections if isinstance(each, QuadMesh)]
    assert np.array_equal(np.ma.getmaskarray(mesh.get_array()), ~np.isfinite(seconds))
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["best layout", *["no cycle"] * hatched]
    assert [text.get_text() for text in axes.texts] == ["bin"]  # once, and neither what has no name nor the floor
    assert axes.get_xlim() == pytest.approx((-0.05, 0.85)) and axes.get_ylim() == pytest.approx((-0.15, 0.45))
    assert colours.get_position().bounds[1::2] == pytest.approx(axes.get_position().bounds[1::2])  # as high as the map


def test_a_hatched_rectangle_holds_every_cell() -> None:
    figure = map_figure(CycleMap("robot", X, Y, SECONDS), [], (0.0, 0.1))
    [hatched] = [patch for patch in figure.axes[0].patches if patch.get_hatch()]
    assert hatched.get_extents().transformed(figure.axes[0].transData.inverted()).bounds == pytest.approx(
        (-0.05, -0.2, 0.3, 0.4)
    )


def test_a_search_begins_where_a_cycle_is_possible() -> None:
    history = (np.array([10.0, 20.0, 30.0]), np.array([np.inf, 4.0, 3.8]))
    [axes] = convergence_figure([history, history], [3.9, 3.7]).axes
    first, second, *certified = axes.lines
    assert np.isnan(np.asarray(first.get_ydata())[0]) and np.asarray(first.get_ydata())[2] == 3.8
    assert first.get_linestyle() != second.get_linestyle() or first.get_color() != second.get_color()
    assert [np.asarray(line.get_ydata())[0] for line in certified] == [3.7, 3.9]
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["search 1", "search 2", "certified plans"]
    low, high = axes.get_ylim()
    assert low < 3.7 and high > 4.0
