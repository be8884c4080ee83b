"""What all figures share: letters, files, labels that do not overlap."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.text import Text
from scipy.optimize import minimize

from tpbso_casadi.figures.palette import FORMATS
from tpbso_casadi.figures.style import ONE_COLUMN, SMALL, EndLabel, in_print, label_ends, spread, write_figure

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


@pytest.mark.parametrize("seed", range(6))
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
