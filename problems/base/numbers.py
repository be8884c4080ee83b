"""Numbers in the texts of files."""

from __future__ import annotations

import re

DIGITS = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[-+]?[0-9]+)?"
NUMBER = re.compile(rf"[-+]?(?:{DIGITS}|inf|infinity|nan)", re.ASCII | re.IGNORECASE)
WHOLE = re.compile(r"[-+]?[0-9]+", re.ASCII)


def whole_of(text: str) -> int:
    """The whole number in decimal digits in a text, with or without blanks around it.

    Raises:
        ValueError: it says none, or one of thousands of digits.
    """
    stripped = text.strip()
    if WHOLE.fullmatch(stripped) is None:
        raise ValueError(f"not a whole number: {text!r:.60}")
    return int(stripped)


def number_of(text: str) -> float:
    """The number in a text, with or without blanks around it; NaN and infinity too.

    Python's ``float`` takes ``1_0`` for ten, and digits of other scripts, which no other reader of such files does.

    Raises:
        ValueError: it says none.
    """
    stripped = text.strip()
    if NUMBER.fullmatch(stripped) is None:
        raise ValueError(f"not a number: {text!r:.60}")
    return float(stripped)
