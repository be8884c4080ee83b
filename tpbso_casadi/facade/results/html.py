"""Tables and pictures in HTML, as a notebook shows them."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape


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
