"""TOML from files that are not trusted."""

from __future__ import annotations

import re
import tomllib
from typing import Any

DOTTED_KEY = re.compile(  # of 50 parts or more: nothing needs it, and the parser's time grows with the square of them
    r"""(?<![\w"'-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){50}"""
)


def toml_tables(text: str) -> dict[str, Any]:
    """The content of a TOML text of at most a megabyte, which takes a second to parse.

    Raises:
        ValueError: it is no TOML, or needs more than Python or patience has; the reason in one line.
    """
    if DOTTED_KEY.search(text):
        raise ValueError("a key of more than 50 parts")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"not TOML: {error}") from error
    except (ValueError, RecursionError) as error:
        raise ValueError(too_much(error)) from error


def too_much(error: Exception) -> str:
    """Which of Python's own limits the content of a file exceeds."""
    return "nested too deeply" if isinstance(error, RecursionError) else "a whole number of thousands of digits"
