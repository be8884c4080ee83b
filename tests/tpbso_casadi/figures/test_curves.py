"""Joints, limits and costs over time: what stands beside the lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.space_plans import space_plan
from matplotlib.figure import Figure

from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.figures.curves import Row, convergence_figure, draw_limits, joints_figure, limit_labels, numbers
from tpbso_casadi.figures.limits import STYLES, limits_figure, runs, structure_figure
from tpbso_casadi.figures.palette import line_of
from tpbso_casadi.planning import SearchedMotion, convergence, plan


def searched(**solver: object) -> SearchedMotion:
    content = builtin("rotation-3").model_dump()
    content["model"]["retime"] = False
    content["solver"] |= {"evaluations": 600, **solver}
    found = plan(parse_scenario(content)).searched
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("joints", "text"), [([1], "1"), ([1, 2], "1-2"), ([1, 2, 3, 5], "1-3, 5"), ([2, 4, 6, 7], "2, 4, 6-7")]
)
def test_joints_are_named_by_ranges(joints: list[int], text: str) -> None:
    assert numbers(np.array(joints)) == text


def test_limits_are_named_once_each() -> None:
    assert limit_labels(np.array([4.0, 4.0])) == [(4.0, "± 4")]
    assert limit_labels(np.array([87.0, 12.0, 87.0])) == [(12.0, "± 12, joint 2"), (87.0, "± 87, joint 1, 3")]


def test_a_limit_far_away_does_not_stretch_the_axis() -> None:
    axes = Figure().subplots()
    axes.set_xlim(0.0, 1.0)
    draw_limits(axes, Row("speed", np.zeros((2, 2)), np.array([2.0, 90.0])), largest=1.0)
    assert axes.get_ylim() == pytest.approx((-2.16, 2.16))
    assert [line.get_ydata()[0] for line in axes.lines] == [-2.0, 2.0]
    assert [text.get_text() for text in axes.texts] == ["± 2, joint 1", "± 90, joint 2"]


def test_every_joint_has_its_line_and_its_label() -> None:
    figure = joints_figure(space_plan())
    labels = [text.get_text() for text in figure.axes[0].texts]
    assert labels == [f"joint {joint}" for joint in range(1, 5)]
    for axes in figure.axes:
        curves = [line for line in axes.lines if str(line.get_label()).startswith("joint")]
        assert [line.get_color() for line in curves] == [line_of(joint)["color"] for joint in range(4)]
        assert len({line.get_linestyle() for line in curves}) > 1
    assert figure.axes[-1].get_xlabel() == "time [s]"


def test_every_kind_of_limit_is_named_at_its_line() -> None:
    above, below = limits_figure(space_plan()).axes
    assert [text.get_text() for text in above.texts] == ["speed", "acceleration", "jerk"]
    assert [label.get_text() for label in below.get_yticklabels()] == [f"joint {joint}" for joint in range(1, 5)]
    assert len({style[1:] for style in STYLES.values()}) == len(STYLES)  # apart without colour


def test_convergence_says_what_was_reached() -> None:
    solution = searched()
    [axes] = convergence_figure(solution).axes
    _, cost = convergence(solution.search)
    assert f"{cost[-1]:.4g}" in [text.get_text() for text in axes.texts]
    assert axes.get_title().endswith(f": {solution.search.evaluations} evaluations")
    assert axes.get_ylabel() == "best rotation so far [rad]"
    assert axes.get_yscale() == "linear"


def test_costs_over_decades_have_a_logarithmic_axis() -> None:
    solution = searched()
    history = solution.search.history
    falling = np.geomspace(1e3, 1e-1, history.cost.size)
    wide = replace(solution, search=replace(solution.search, history=replace(history, cost=falling)))
    assert convergence_figure(wide).axes[0].get_yscale() == "log"


def test_a_search_without_anything_feasible_says_so() -> None:
    solution = searched()
    history = solution.search.history
    penalties = np.full(history.cost.size, 1e12)
    none = replace(solution, search=replace(solution.search, history=replace(history, cost=penalties)))
    [axes] = convergence_figure(none).axes
    assert axes.get_title().endswith(": no feasible candidate")
    assert axes.get_ylabel() == "penalised cost"


def test_runs_of_nonzeros_by_hand() -> None:
    pattern = np.array([[1, 0], [1, 1], [0, 1], [1, 0]])
    corners = [rectangle[[0, 2]].tolist() for rectangle in runs(pattern)]
    assert corners == [[[-0.5, 0], [0.5, 2]], [[-0.5, 3], [0.5, 4]], [[0.5, 1], [1.5, 3]]]


def test_the_structure_covers_each_nonzero_once() -> None:
    figure = structure_figure(builtin("obstacle-3"))
    search, program = figure.subfigs
    for half in (search, program):
        said = int(half.get_suptitle().split("\n")[1].split()[0])
        boxes = [path.get_extents() for axes in half.axes for path in axes.collections[0].get_paths()]
        assert round(sum(box.width * box.height for box in boxes)) == said
