"""Figures of a plan by name, and figures that a notebook shows.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from io import BytesIO

from matplotlib.figure import Figure

from tpbso_casadi.figures.clearance import clearance_figures
from tpbso_casadi.figures.measures import curve_figures, progress_figure
from tpbso_casadi.figures.run import FIGURES, convergence_figure
from tpbso_casadi.planning.planned_motion import PlannedMotion

DOTS_PER_INCH = 100


class ShownFigure(Figure):
    """A figure that a notebook shows, where pyplot has never been loaded too."""

    def _repr_png_(self) -> bytes:
        return png_of(self)


def shown(figure: Figure) -> Figure:
    """The same figure as one that a notebook shows."""
    figure.__class__ = ShownFigure  # Matplotlib's own class has no picture of itself
    return figure


def png_of(figure: Figure) -> bytes:
    """The content of a PNG file."""
    file = BytesIO()
    figure.savefig(file, format="png", dpi=DOTS_PER_INCH)
    return file.getvalue()


def figure_of(plan: PlannedMotion, kind: str) -> Figure:
    """One figure of a plan.

    Raises:
        ValueError: there is no such figure of this plan; lists those that there are.
    """
    drawings = drawings_of(plan)
    if kind not in drawings:
        raise ValueError(f"kind: there is no figure {kind!r} of this plan; there are {', '.join(drawings)}")
    return shown(drawings[kind]())


def drawings_of(plan: PlannedMotion) -> dict[str, Callable[[], Figure]]:
    """What draws each figure of a plan, by name."""
    drawings: dict[str, Callable[[], Figure]] = {name: partial(draw, plan) for name, draw in FIGURES.items()}
    if plan.criteria.task.is_timed:
        drawings["clearance"] = lambda: clearance_figures(plan)["clearance"]
    for curve in plan.criteria.bounded_curves(plan.trajectory):
        drawings[curve.name] = lambda name=curve.name: curve_figures(plan)[name][1]  # type: ignore[misc]
    if plan.searched is not None:
        drawings["convergence"] = partial(convergence_figure, plan.searched)
        for measure in plan.searched.problem.progress_measures():
            drawings[measure.name] = partial(progress_figure, plan.searched, measure)
    return drawings
