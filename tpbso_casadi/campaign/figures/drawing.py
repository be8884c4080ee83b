"""The figures of a comparison as files, and within a page."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
from markupsafe import Markup, escape
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.figures.catalogue import FIGURES, FigureKind
from tpbso_casadi.campaign.figures.comparison import EQUAL
from tpbso_casadi.figures.style.colours import SERIES
from tpbso_casadi.figures.style.files import METADATA, write_figure
from tpbso_casadi.figures.style.paper import RC

INK = ("#000000", to_hex("0.2"))  # what letters and axes are drawn with
OF_PAGE = {EQUAL: "shade"} | {colour: f"series-{index}" for index, colour in enumerate(SERIES)}  # its variables


@dataclass(frozen=True)
class Drawing:
    """A figure, or why there is none.

    Attributes:
        kind: of the figure.
        figure: itself; None where it is left out.
        reason: why it is left out; empty where it is not.
    """

    kind: FigureKind
    figure: Figure | None
    reason: str

    def svg(self, alt: str) -> Markup:
        """The figure for a page; see :func:`inline_svg`."""
        return Markup("") if self.figure is None else inline_svg(self.figure, self.kind.name, alt)


def drawings(results: Results) -> list[Drawing]:
    """Every figure, drawn unless it makes no sense."""
    reasons = [(kind, kind.left_out(results)) for kind in FIGURES]
    return [Drawing(kind, None if reason else kind.draw(results), reason) for kind, reason in reasons]


def write_figures(folder: Path, drawn: Sequence[Drawing], formats: Sequence[str]) -> None:
    """Write each figure in each format; of one that is left out an older file of these formats is removed.

    Raises:
        OSError: a file cannot be written.
    """
    for drawing in drawn:
        if drawing.figure is not None:
            write_figure(folder, drawing.kind.name, drawing.figure, formats)
        else:
            for kind in formats:
                (folder / f"{drawing.kind.name}.{kind}").unlink(missing_ok=True)


def inline_svg(figure: Figure, name: str, alt: str) -> Markup:
    """A figure as an element of an HTML page, in the colours of the page, which may be dark.

    Args:
        figure: to be written.
        name: unique within the page.
        alt: what it shows, for those who do not see it.
    """
    buffer = io.StringIO()
    with mpl.rc_context(RC | {"svg.hashsalt": name}):
        figure.savefig(buffer, format="svg", transparent=True, metadata=METADATA["svg"])
    text = re.sub(r"<metadata>.*?</metadata>", "", buffer.getvalue(), flags=re.DOTALL)
    text = text[text.index("<svg") :]
    text = re.sub(r'(\bid="|xlink:href="#|url\(#)', rf"\g<1>{name}-", text)
    for ink in INK:
        text = re.sub(rf"(fill|stroke): {ink}", r"\1: currentColor", text)
    for colour, variable in OF_PAGE.items():
        text = re.sub(rf"(fill|stroke): {to_hex(colour)}", rf"\1: var(--{variable})", text)
    width, height = (round(72 * inches) for inches in figure.get_size_inches())
    opening = f'<svg class="figure" role="img" aria-label="{escape(alt)}" viewBox="0 0 {width} {height}"'
    opening += f' style="max-width: {width * 1.4:.0f}px" xmlns:xlink="http://www.w3.org/1999/xlink">'
    return Markup(re.sub(r"^<svg[^>]*>", lambda _: opening, text))
