"""Figures draw what a problem offers, and nothing else."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from problems.tasks import MarkerKind
from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.figures.curves import curve_figures, joints_figure, progress_figures, progress_history
from tpbso_casadi.figures.path import path_figure
from tpbso_casadi.planning import SearchedMotion, plan


@cache
def planned(case: str, solver: str = "pso") -> SearchedMotion:
    content = builtin(case).model_dump()
    content["model"]["retime"] = False
    content["model"]["formulation"] = "reduced"
    budget = {"iterations": 2} if solver == "ipopt" else {"evaluations": 1000}
    content["solver"] |= {"name": solver, **budget}
    return plan(parse_scenario(content))


@pytest.mark.parametrize("solver", ["pso", "ipopt"])
def test_a_path_offers_accuracy_and_redundancy(solver: str) -> None:
    solution = planned("pentagram-time", solver)
    [accuracy] = solution.problem.progress_measures()
    history = progress_history(solution, accuracy)
    assert history.shape == solution.search.history.cost.shape
    worst = next(verdict.worst for verdict in solution.verdicts if verdict.name == "accuracy")
    assert accuracy.of_trajectory(solution.trajectory) == pytest.approx(worst)
    assert history[-1] == pytest.approx(worst, rel=1e-6)
    figures = progress_figures(solution) | curve_figures(solution)
    assert {name: caption for name, (caption, _) in figures.items()} == {
        "accuracy": "trajectory accuracy",
        "redundancy": "redundancy angle",
    }
    [curve] = solution.problem.bounded_curves(solution.trajectory)
    values = curve.value(curve.times)
    assert ((values >= curve.lower - 0.2) & (values <= curve.upper + 0.2)).all()
    [marker] = solution.problem.markers()
    assert (marker.kind, marker.points.shape) == (MarkerKind.POINTS, (50, 2))
    assert solution.problem.milestones(solution.trajectory) == ()


def test_a_path_with_four_links_has_a_panel_for_each_redundant_one() -> None:
    content = builtin("pentagram-time").model_dump()
    content["arm"] |= {"link_lengths": [0.75] * 4}
    content["solver"]["evaluations"] = 200
    [(_, figure)] = curve_figures(plan(parse_scenario(content))).values()
    assert [axes.get_ylabel().split("$")[1] for axes in figure.axes] == [r"\phi_{3}", r"\phi_{4}"]


def test_point_to_point_offers_its_control_point() -> None:
    solution = planned("obstacle-3")
    assert progress_figures(solution) == curve_figures(solution) == {}
    [milestone] = solution.problem.milestones(solution.trajectory)
    assert milestone.time == solution.trajectory.breakpoints[1]
    kinds = {marker.kind: marker.points for marker in solution.problem.markers()}
    np.testing.assert_array_equal(kinds[MarkerKind.GOAL], [[0.5, 1.5]])
    axes = path_figure(solution).axes[0]
    assert {"base", "start", "goal", "obstacle", "path of the tool"} <= set(axes.get_legend_handles_labels()[1])
    assert {"start", "goal", "control point"} <= {text.get_text() for text in axes.texts}
    vertical = [line for line in joints_figure(solution).axes[0].lines if len(set(line.get_xdata())) == 1]
    assert len(vertical) == 1
