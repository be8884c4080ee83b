"""Results that show themselves: data frames, exports, figures, HTML.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Collection, Iterable, Sequence
from functools import partial
from html import escape
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from tpbso_casadi.facade.arguments import in_words_of_python, positive
from tpbso_casadi.figures.run import drawings_of
from tpbso_casadi.planning import Motion, PlannedMotion
from tpbso_casadi.scenario import shown
from tpbso_casadi.storage import DEFAULT_RATE, EXPORTS, Writer, equal_steps, export_motion

if TYPE_CHECKING:
    import pandas as pd


def heading(text: str) -> str:
    """A line in bold."""
    return f"<p><b>{escape(text)}</b></p>"


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; numbers with six digits, the rest as text."""
    head = "".join(f"<th>{escape(text)}</th>" for text in headings)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell(value))}</td>' for value in row)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def cell(value: object) -> str:
    """A value as text."""
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def picture(png: bytes, alternative: str) -> str:
    """A picture that is part of the page.

    Args:
        png: the file's content.
        alternative: what it shows, in words.
    """
    data = b64encode(png).decode()
    return f'<img alt="{escape(alternative)}" style="max-width: 100%" src="data:image/png;base64,{data}">'


def data_frame(content: Any) -> pd.DataFrame:
    """A data frame of columns by name, or of rows.

    Raises:
        ImportError: pandas is not installed; says how to install it.
    """
    if find_spec("pandas") is None:
        raise ImportError("a data frame needs the package pandas: pip install 'tpbso-casadi[pandas]'")
    import pandas as pd  # noqa: PLC0415 (optional, and slow to load)

    return pd.DataFrame(content)


RATE = DEFAULT_RATE  # Hz


def chosen(argument: str, kinds: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Kinds of files, one alone or several.

    Raises:
        ValueError: there is no such kind; lists those that there are.
    """
    if not isinstance(kinds, Iterable):
        raise ValueError(f"{argument}: kinds are needed, of {', '.join(known)}, or () for none; not {shown(kinds)}")
    kinds = (kinds,) if isinstance(kinds, str) else tuple(kinds)
    unknown = next((kind for kind in kinds if not isinstance(kind, str) or kind not in known), None)
    if unknown is not None:
        raise ValueError(f"{argument}: there is no kind {unknown!r}; there are {', '.join(known)}")
    return kinds


def exports_of(motion: Motion, kinds: Sequence[str], rate: float = RATE) -> list[Writer]:
    """What writes each export, at a rate in Hz.

    Raises:
        ValueError: there is no such kind, or the rate is no number above 0.
        OutputError: it makes too many rows.
    """
    hertz, exports = positive("rate", rate, "Hz"), chosen("export", kinds, EXPORTS)
    if exports:
        with in_words_of_python():
            equal_steps(motion, hertz)
    return [partial(export_motion, motion=motion, kind=kind, rate=hertz) for kind in exports]


DOTS_PER_INCH = 100


class ShownFigure(Figure):
    """A figure that a notebook shows, where pyplot has never been loaded too."""

    def _repr_png_(self) -> bytes:
        return png_of(self)


def notebook_figure(figure: Figure) -> Figure:
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
    return notebook_figure(drawings[kind]())
