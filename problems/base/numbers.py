"""Numbers in texts: read from files, rounded up to be shown."""

from __future__ import annotations

import math
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


def rounded_up(value: float, digits: int = 2) -> float:
    """The least number with few digits that is no smaller than a positive one; 0 for 0."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(value)) + 1 - digits)
    found = float(f"{math.ceil(value / unit) * unit:.{digits}g}")
    return found if found >= value else float(f"{(math.ceil(value / unit) + 1) * unit:.{digits}g}")
