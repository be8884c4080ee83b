"""Pieces of HTML: headings, tables, pictures within a page, numbers."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from math import isfinite


def heading(text: str) -> str:
    """A line in bold."""
    return f"<p><b>{escape(text)}</b></p>"


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; numbers with six digits, the rest as text, nothing for None."""

    def cell(value: object) -> str:
        text = "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
        return f"<td>{escape(text)}</td>"

    head = "".join(f"<th>{escape(text)}</th>" for text in headings)
    body = "".join(f"<tr>{''.join(map(cell, row))}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def data_address(content: bytes, kind: str) -> str:
    """The address of an image that is part of the page: its content, and what kind it is, "png" or "webp"."""
    return f"data:image/{kind};base64,{b64encode(content).decode('ascii')}"


def picture(png: bytes, alternative: str) -> str:
    """A picture that is part of the page, and what it shows, in words."""
    return f'<img alt="{escape(alternative)}" style="max-width: 100%" src="{data_address(png, "png")}">'


def number(value: float | None, digits: int = 5, negligible: float = 0.0) -> str:
    """A number for a table: 0 where it is as small as the negligible, a dash where there is none."""
    if value is None or not isfinite(value):
        return "-"
    return f"{value:.{digits}g}" if abs(value) > negligible else "0"
