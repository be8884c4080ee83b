"""The figures of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from tpbso_casadi.figures.curves import convergence_figure, curve_figure, curve_groups, joints_figure, progress_figure
from tpbso_casadi.figures.limits import clearance_drawings, limits_figure
from tpbso_casadi.figures.palette import DEFAULT
from tpbso_casadi.figures.path import path_figure
from tpbso_casadi.figures.style import write_figure
from tpbso_casadi.planning import PlannedMotion

__all__ = ["FIGURES", "convergence_figure", "draw_figures", "drawings_of", "joints_figure"]


def draw_figures(folder: Path, plan: PlannedMotion, formats: Sequence[str] = DEFAULT) -> list[Path]:
    """Draw every figure of a plan into a folder; returns their paths."""
    return [path for name, draw in drawings_of(plan).items() for path in write_figure(folder, name, draw(), formats)]


def drawings_of(plan: PlannedMotion) -> dict[str, Callable[[], Figure]]:
    """Drawings of each figure of a plan, by file name."""
    drawings: dict[str, Callable[[], Figure]] = {name: partial(draw, plan) for name, draw in FIGURES.items()}
    drawings |= clearance_drawings(plan)
    problem = None if plan.search is None or not plan.search.evaluations else plan.problem
    if problem is not None:
        drawings["convergence"] = partial(convergence_figure, plan)
    drawings |= {name: partial(curve_figure, plan.times, group) for name, group in curve_groups(plan).items()}
    if problem is not None:
        measures = problem.progress_measures()
        drawings |= {measure.name: partial(progress_figure, plan, measure) for measure in measures}
    return drawings


FIGURES: dict[str, Callable[[PlannedMotion], Figure]] = {
    "path": path_figure,
    "joints": joints_figure,
    "limits": limits_figure,
}  # of every motion; a search has others
