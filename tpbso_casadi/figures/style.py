"""Figures for print: sizes, fonts, files that are the same to the byte.

Imported only where a figure is drawn: matplotlib is slow to load.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, wraps
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib as mpl
from matplotlib.figure import Figure

from tpbso_casadi.figures.palette import DEFAULT
from tpbso_casadi.storage import write_with

ONE_COLUMN, TWO_COLUMNS = 3.5, 7.16  # inches: of a page of two columns
SMALL = 8.0  # points: of ticks, legends and labels
RC: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same everywhere
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.labelsize": 8.5,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "figure.titlesize": 9.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.linewidth": 0.5,
    "hatch.linewidth": 0.5,
    "grid.alpha": 0.3,
    "pdf.fonttype": 42,  # letters are embedded as TrueType, and can be searched
    "svg.fonttype": "path",  # and drawn, so that no font is needed
}

Arguments = ParamSpec("Arguments")


def in_print(draw: Callable[Arguments, Figure]) -> Callable[Arguments, Figure]:
    """A function that makes a figure, with the settings for print wherever it is shown afterwards."""

    @wraps(draw)
    def drawn(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Figure:
        with mpl.rc_context(RC):
            figure = draw(*args, **kwargs)
            for axes in figure.get_axes():
                axes.tick_params(labelsize=SMALL)  # ticks are made later
            return figure

    return drawn


DPI = 200
METADATA: dict[str, dict[str, None]] = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None},
    "svg": {"Date": None},
}  # the same, the same bytes


def write_figure(folder: Path, name: str, figure: Figure, formats: Sequence[str] = DEFAULT) -> list[Path]:
    """Write a figure in each format; returns the paths.

    Args:
        folder: to write to.
        name: of the files, without a suffix.
        figure: to be written.
        formats: some of ``FORMATS``.

    Raises:
        OSError: a file cannot be written.
    """
    with mpl.rc_context(RC | {"svg.hashsalt": name}):
        return [
            write_with(
                folder / f"{name}.{kind}", partial(figure.savefig, format=kind, dpi=DPI, metadata=METADATA[kind])
            )
            for kind in formats
        ]
