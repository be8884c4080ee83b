"""Numbers in the texts of files: those that every reader of such files takes, and no others."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from problems.base import number_of

STRICT = {
    "0": 0.0,
    "-0": -0.0,
    "+7": 7.0,
    "010": 10.0,
    "1.": 1.0,
    ".5": 0.5,
    "-1.25e-3": -1.25e-3,
    "1E5": 1e5,
    "1e999": math.inf,
    " 2.5\t": 2.5,
    "inf": math.inf,
    "-Infinity": -math.inf,
}
NONE = ["", " ", "1_0", "1_000.5", "1e1_0", "0x10", "1,5", "1 2", "--1", "+-1", "e5", ".", "1e", "1.2.3", "one", "١٢"]


def test_numbers_and_what_is_none() -> None:
    for text, number in STRICT.items():
        assert (number_of(text), math.copysign(1.0, number_of(text))) == (number, math.copysign(1.0, number)), text
    assert math.isnan(number_of("nan")) and math.isnan(number_of("-NaN"))
    for text in NONE:
        with pytest.raises(ValueError, match="^" + re.escape(f"not a number: {text!r}")):
            number_of(text)


@given(st.floats())
def test_what_python_writes_is_read_back(number: float) -> None:
    for text in (repr(number), f"{number:.17e}", f"{number:.17g}"):
        assert number_of(text) == number or (math.isnan(number) and math.isnan(number_of(text)))


@given(st.text("0123456789_.eE+- infatyx٣", max_size=12))
@example("1_0")
def test_it_takes_what_python_takes_but_for_underscores_and_other_digits(text: str) -> None:
    try:
        expected = float(text)
    except ValueError:
        expected = None
    usual = text.isascii() and "_" not in text
    if expected is None or not usual:
        with pytest.raises(ValueError, match="not a number"):
            number_of(text)
    else:
        assert number_of(text) == expected or math.isnan(expected)
