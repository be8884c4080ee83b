"""Colours that are told apart with any kind of colour vision, and in grey."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from oracles.colour_vision import VISIONS, differences, lab, seen

from tpbso_casadi.figures.palette import DASHES, MARKERS, SERIES, colour_of, line_of, marker_of, shade_of

LEAST, LEAST_OF_FOUR = 22.0, 30.0  # CIELAB differences of any two series, and of any two of the first four
LEAST_FROM_WHITE = 35.0
COLOURS = np.array([to_rgb(colour) for colour in SERIES])
WHITE = np.ones((1, 3))


def test_the_oracle_of_colours_by_hand() -> None:
    # the corners of sRGB in CIELAB under D65, as tables have them
    corners = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    expected = [[100.0, 0.0, 0.0], [53.24, 80.09, 67.20], [32.30, 79.19, -107.86]]
    np.testing.assert_allclose(lab(corners), expected, atol=0.02)
    for vision in VISIONS:  # greys stay greys
        np.testing.assert_allclose(seen(np.full(3, 0.4), vision), 0.4, atol=1e-3)
    # red and green of one lightness are one colour without the cones for green, far apart with them
    pair = np.array([to_rgb("#b06a00"), to_rgb("#7f8000")])
    assert differences(pair, "deuteranopia")[0, 1] < 10.0
    assert differences(pair, "normal")[0, 1] > 30.0


@pytest.mark.parametrize("vision", VISIONS)
def test_no_two_series_look_alike(vision: str) -> None:
    between = differences(COLOURS, vision) + np.diag(np.full(len(SERIES), np.inf))
    assert between.min() > LEAST
    assert between[:4, :4].min() > LEAST_OF_FOUR
    assert differences(np.vstack([COLOURS, WHITE]), vision)[-1, :-1].min() > LEAST_FROM_WHITE


def test_the_test_would_find_colours_that_look_alike() -> None:
    rainbow = np.array([to_rgb(colour) for colour in ("#d62728", "#2ca02c", "#1f77b4")])
    assert differences(rainbow, "deuteranopia")[0, 1] < LEAST


def test_colour_is_never_all() -> None:
    for first, second in pairwise(range(12)):
        assert line_of(first)["linestyle"] != line_of(second)["linestyle"]
        assert marker_of(first) != marker_of(second)
    looks = {(line_of(number)["color"], line_of(number)["linestyle"]) for number in range(len(SERIES) * len(DASHES))}
    assert len(looks) == len(SERIES) * len(DASHES)
    assert len(set(SERIES)) == len(SERIES) == len(set(DASHES)) == len(set(MARKERS))
    assert colour_of(len(SERIES)) == colour_of(0)


def test_postures_get_darker_with_time() -> None:
    shades = np.array([shade_of(share) for share in np.linspace(0.0, 1.0, 9)])
    for vision in VISIONS:
        assert (np.diff(lab(seen(shades, vision))[:, 0]) < -5.0).all()
