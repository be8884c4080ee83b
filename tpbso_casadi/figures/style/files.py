"""Figures as files: PNG for a screen, PDF and SVG for print.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from tpbso_casadi.figures.style.formats import DEFAULT
from tpbso_casadi.figures.style.paper import RC
from tpbso_casadi.storage.files import write_with

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
