"""The option ``--figures``: in which formats figures are drawn."""

from __future__ import annotations

import argparse

from tpbso_casadi.cli.options import defaulting, listed
from tpbso_casadi.figures.style.formats import DEFAULT, FORMATS
from tpbso_casadi.scenario.validation import shown


def add_figures_option(group: argparse._ActionsContainer) -> None:
    """``--figures png,pdf,svg``; without it PNG."""
    group.add_argument(
        "--figures",
        type=formats,
        default=DEFAULT,
        metavar="FORMATS",
        help=defaulting(f"of figures: {listed(FORMATS)}, or several with commas between them", ",".join(DEFAULT)),
    )


def formats(text: str) -> tuple[str, ...]:
    """Formats with commas between them, for argparse; each once."""
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    unknown = [name for name in names if name not in FORMATS]
    if unknown:
        raise argparse.ArgumentTypeError(f"{shown(unknown[0])} is not a format of figures: say {', '.join(FORMATS)}")
    return names


def figure_formats(options: argparse.Namespace) -> tuple[str, ...]:
    """The formats of the options; none with ``--no-plots``."""
    return () if options.no_plots else options.figures
