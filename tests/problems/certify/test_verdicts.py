"""What a worst value is, in words."""

from __future__ import annotations

import pytest

from problems.certify import WorstIs


@pytest.mark.parametrize(
    ("what", "metres", "words"),
    [
        (WorstIs.EXACT, 0.0123, "12.3 mm"),
        (WorstIs.FOUND, 0.05219, "52.2 mm found"),
        (WorstIs.FOUND, -0.0031, "-3.1 mm found"),
        (WorstIs.BOUND, 0.04909, "at least 49.0 mm, proven"),  # not 49.1
        (WorstIs.BOUND, -0.00301, "at least -3.1 mm, proven"),
    ],
)
def test_distances_say_what_they_are_and_proven_ones_are_rounded_down(what: WorstIs, metres: float, words: str) -> None:
    assert what.distance(metres) == words


@pytest.mark.parametrize(
    ("what", "value", "words"),
    [
        (WorstIs.EXACT, -44.334712, "-44.3347"),
        (WorstIs.FOUND, 0.012829678, "0.0128297 found"),
        (WorstIs.BOUND, 0.012829678, "at least 0.0128296, proven"),
        (WorstIs.BOUND, 0.012829631, "at least 0.0128296, proven"),
        (WorstIs.BOUND, -0.012829618, "at least -0.0128297, proven"),
        (WorstIs.BOUND, 0.0, "at least 0, proven"),
        (WorstIs.BOUND, 0.0999999999, "at least 0.0999999, proven"),
    ],
)
def test_proven_numbers_are_rounded_down(what: WorstIs, value: float, words: str) -> None:
    assert what.number(value) == words


def test_the_same_words_in_any_unit() -> None:
    assert [what.in_words("0.02 rad") for what in WorstIs] == [
        "0.02 rad",
        "at least 0.02 rad, proven",
        "0.02 rad found",
    ]
