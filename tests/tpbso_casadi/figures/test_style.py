"""What all figures share: letters, files, labels that do not overlap, colours that anybody can tell apart."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from oracles.colour_vision import VISIONS, differences, lab, seen
from scipy.optimize import minimize

from tpbso_casadi.figures.palette import DASHES, FORMATS, MARKERS, SERIES, colour_of, line_of, marker_of, shade_of
from tpbso_casadi.figures.style import (
    ONE_COLUMN,
    SMALL,
    EndLabel,
    fitted,
    in_print,
    label_ends,
    legend_columns,
    spread,
    width_of,
    write_figure,
)

PLACES = st.lists(st.floats(0.0, 1.0), max_size=8).map(np.array)


@in_print
def drawn() -> Figure:
    figure = Figure(figsize=(ONE_COLUMN, 2.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0])
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0), xlabel="time [s]")
    return figure


def test_letters_are_those_of_print_wherever_a_figure_is_shown() -> None:
    before = mpl.rcParams["font.size"]
    figure = drawn()
    assert mpl.rcParams["font.size"] == before
    figure.draw_without_rendering()
    [axes] = figure.axes
    assert {text.get_fontsize() for text in axes.get_xticklabels()} == {SMALL}
    assert axes.xaxis.label.get_fontsize() == 8.5
    assert not axes.spines["top"].get_visible()


def test_files_are_the_same_to_the_byte_and_hold_their_letters(tmp_path: Path) -> None:
    first, second = tmp_path / "1", tmp_path / "2"
    for folder in (first, second):
        folder.mkdir()
        written = write_figure(folder, "path", drawn(), FORMATS)
        assert [path.name for path in written] == ["path.png", "path.pdf", "path.svg"]
    for kind in FORMATS:
        assert (first / f"path.{kind}").read_bytes() == (second / f"path.{kind}").read_bytes()
    pdf, svg = (first / "path.pdf").read_bytes(), (first / "path.svg").read_text()
    assert b"/FontFile2" in pdf and b"/Type3" not in pdf  # TrueType, embedded
    assert b"/Subtype /Image" not in pdf and "<image" not in svg  # lines, not pixels
    assert "<text" not in svg and "<path" in svg  # letters are drawn: no font is needed


@given(PLACES, st.floats(0.01, 0.3))
def test_labels_are_apart_in_order_and_within(places: np.ndarray, gap: float) -> None:
    moved = spread(places, gap)
    order = np.argsort(places, kind="stable")
    assert (np.diff(moved[order]) >= gap - 1e-9).all()
    if len(places) and gap * (len(places) - 1) <= 1.0:
        assert moved.min() >= -1e-9 and moved.max() <= 1.0 + 1e-9
    if len(places) < 2 or (np.diff(places[order]) >= gap).all():
        np.testing.assert_allclose(moved, places, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_labels_move_as_little_as_can_be(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places, gap = np.sort(rng.uniform(0.0, 1.0, 6)), 0.12
    apart = {"type": "ineq", "fun": lambda x: np.diff(x) - gap}
    start = np.linspace(0.0, 1.0, 6)
    best = minimize(lambda x: ((x - places) ** 2).sum(), start, bounds=[(0.0, 1.0)] * 6, constraints=apart)
    assert ((spread(places, gap) - places) ** 2).sum() <= best.fun + 1e-6


def test_labels_at_the_ends_of_lines_do_not_overlap() -> None:
    figure = drawn()
    [axes] = figure.axes
    figure.draw_without_rendering()
    label_ends(axes, [EndLabel(f"joint {n}", place, "black") for n, place in enumerate((0.5, 0.51, 0.52, 7.0))])
    figure.draw_without_rendering()
    boxes = sorted((Text.get_window_extent(text) for text in axes.texts), key=lambda box: box.y0)
    assert all(below.y1 <= above.y0 + 0.5 for below, above in pairwise(boxes))
    assert [text.get_text() for text in axes.texts] == ["joint 0", "joint 1", "joint 2", "joint 3"]
    assert boxes[-1].y0 < axes.bbox.y1  # what ends outside is named at the edge


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
    assert differences(pair, "deuteranopia")[0, 1] < 10.0 < LEAST
    assert differences(pair, "normal")[0, 1] > 30.0


@pytest.mark.parametrize("vision", VISIONS)
def test_no_two_series_look_alike(vision: str) -> None:
    between = differences(COLOURS, vision) + np.diag(np.full(len(SERIES), np.inf))
    assert between.min() > LEAST
    assert between[:4, :4].min() > LEAST_OF_FOUR
    assert differences(np.vstack([COLOURS, WHITE]), vision)[-1, :-1].min() > LEAST_FROM_WHITE


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


@pytest.mark.parametrize(
    "text",
    [
        "",
        "one",
        "T = 1.219 s, certified for all t",
        "a-name-of_parts/of(many=kinds,even=0.5)+polish12",
        "x" * 60,
        "two\nlines of it",
    ],
)
@pytest.mark.parametrize("inches", [0.05, 0.5, 1.0, 20.0])
def test_lines_are_broken_where_they_have_to_be_and_nothing_is_lost(text: str, inches: float) -> None:
    lines = fitted(text, inches).split("\n")
    assert "".join("".join(lines).split()) == "".join(text.split())
    assert all(width_of(line) <= inches or len(line) <= 1 for line in lines)
    assert inches < 20.0 or "\n".join(lines) == text


def test_words_stay_whole_where_they_fit() -> None:
    assert fitted("clearance 9.1 mm", width_of("clearance 9.1")) == "clearance 9.1\nmm"
    assert fitted("at 1.219 s", width_of("1.219")) == "at\n1.219\ns"
    assert fitted("long-name", width_of("long-n")) == "long-\nname"


def test_a_legend_has_as_many_columns_as_fit() -> None:
    labels = ["a", "b", "a label of some length"]
    assert [legend_columns(labels, inches) for inches in (0.1, 2.0, 3.0, 30.0)] == [1, 1, 2, 3]
