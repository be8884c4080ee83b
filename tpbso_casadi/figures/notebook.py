"""Figures that a notebook shows."""

from __future__ import annotations

from io import BytesIO

from matplotlib.figure import Figure

from tpbso_casadi.figures.run import drawings_of
from tpbso_casadi.planning import PlannedMotion

DOTS_PER_INCH = 100


class ShownFigure(Figure):
    """A figure that a notebook shows, where pyplot has never been loaded too."""

    def _repr_png_(self) -> bytes:
        return png_of(self)


def notebook_figure(figure: Figure) -> Figure:
    """A figure that a notebook shows."""
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
    return notebook_figure(drawings[kind]())
