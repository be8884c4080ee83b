"""The paper's figures of a run: (a) convergence, (b) path, (c) joints over time.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from tpbso_casadi.figures.clearance import clearance_figures
from tpbso_casadi.figures.curves.convergence import convergence_figure
from tpbso_casadi.figures.curves.joints import joints_figure
from tpbso_casadi.figures.limits import limits_figure
from tpbso_casadi.figures.measures import curve_figures, progress_figures
from tpbso_casadi.figures.paths import path_figure
from tpbso_casadi.figures.style.files import write_figure
from tpbso_casadi.figures.style.formats import DEFAULT
from tpbso_casadi.planning.planned_motion import PlannedMotion

__all__ = ["FIGURES", "convergence_figure", "draw_figures", "joints_figure"]


def draw_figures(folder: Path, plan: PlannedMotion, formats: Sequence[str] = DEFAULT) -> list[Path]:
    """Draw every figure of a plan into a folder; returns their paths."""
    figures = {name: draw(plan) for name, draw in FIGURES.items()} | clearance_figures(plan)
    further = curve_figures(plan)
    if plan.searched is not None:
        figures |= {"convergence": convergence_figure(plan.searched)}
        further |= progress_figures(plan.searched)
    figures |= {name: figure for name, (_, figure) in further.items()}
    return [path for name, figure in figures.items() for path in write_figure(folder, name, figure, formats)]


FIGURES: dict[str, Callable[[PlannedMotion], Figure]] = {
    "path": path_figure,
    "joints": joints_figure,
    "limits": limits_figure,
}  # of every motion; a search has others
