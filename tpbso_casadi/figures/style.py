"""Figures for print: sizes, fonts, files that are the same to the byte, and labels that do not overlap."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial, wraps
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from problems.base import FloatArray
from tpbso_casadi.figures.palette import DEFAULT
from tpbso_casadi.storage import write_with

ONE_COLUMN, TWO_COLUMNS = 3.5, 7.16  # inches: of a page of two columns
SMALL = 8.0  # points: of ticks, legends and labels
RC: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same everywhere
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.labelsize": 8.5,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "figure.titlesize": 9.5,
    "lines.linewidth": 1.3,
    "lines.markersize": 4.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.linewidth": 0.5,
    "hatch.linewidth": 0.5,
    "grid.alpha": 0.3,
    "pdf.fonttype": 42,  # letters are embedded as TrueType, and can be searched
    "svg.fonttype": "path",  # and drawn, so that no font is needed
}

Arguments = ParamSpec("Arguments")


def in_print(draw: Callable[Arguments, Figure]) -> Callable[Arguments, Figure]:
    """A function that makes a figure, with the settings for print wherever it is shown afterwards."""

    @wraps(draw)
    def drawn(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Figure:
        with mpl.rc_context(RC):
            figure = draw(*args, **kwargs)
            for axes in figure.get_axes():
                axes.tick_params(labelsize=SMALL)  # ticks are made later
            return figure

    return drawn


DPI = 200
SAVED: dict[str, dict[str, Any]] = {  # level 3 takes 0.6 of the time of 6, for a tenth more bytes
    "png": {"metadata": {"Software": None}, "pil_kwargs": {"compress_level": 3}},
    "pdf": {"metadata": {"CreationDate": None}},
    "svg": {"metadata": {"Date": None}},
}  # the same, the same bytes


def write_figure(folder: Path, name: str, figure: Figure, formats: Sequence[str] = DEFAULT) -> list[Path]:
    """Write a figure in each format; returns the paths.

    Args:
        folder: to write to.
        name: of the files, without a suffix.
        figure: to be written.
        formats: some of ``FORMATS``.

    Raises:
        OSError: a file cannot be written.
    """
    with mpl.rc_context(RC | {"svg.hashsalt": name}):
        figure.set_dpi(DPI)
        lay_out(figure)
        return [
            write_with(folder / f"{name}.{kind}", partial(figure.savefig, format=kind, dpi=DPI, **SAVED[kind]))
            for kind in formats
        ]


def lay_out(figure: Figure) -> None:
    """Give the parts of a figure the places that they keep, once: with an engine they are drawn twice."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)
    for axes in figure.get_axes():
        axes.apply_aspect()


WORD = re.compile(r"\S*\s?")
PART = re.compile(r"[^-_/.,;:(+]*[-_/.,;:(+]?\s?")  # of a word that is wider than a line
MARGIN = 0.1  # inches beside a title


def title_figure(figure: Figure, text: str) -> None:
    """Give a figure a title whose lines, broken where needed, are no wider than the figure."""
    size = RC["figure.titlesize"]
    figure.suptitle(fitted(text, figure.get_figwidth() - 2.0 * MARGIN, size), fontsize=size)


def fitted(text: str, inches: float, size: float = SMALL) -> str:
    """A text in lines of at most so many inches: broken between words, within one only where that alone is wider.

    Args:
        text: of one line or more.
        inches: of a line.
        size: of the letters, points.
    """
    return "\n".join(line for given in text.split("\n") for line in _lines(given, inches, size))


def _lines(text: str, inches: float, size: float) -> Iterator[str]:
    line = ""
    for word in WORD.findall(text):
        for part in [word] if _fits(word, inches, size) else PART.findall(word):
            for piece in [part] if _fits(part, inches, size) else part:
                if line and not _fits(line + piece, inches, size):
                    yield line.rstrip()
                    line = ""
                line += piece
    yield line.rstrip()


def _fits(text: str, inches: float, size: float) -> bool:
    return width_of(text.rstrip(), size) <= inches


def width_of(text: str, size: float = SMALL) -> float:
    """The width of one line, inches, in letters of so many points."""
    width, _, _ = text_to_path.get_text_width_height_descent(text, FontProperties(size=size), ismath=False)
    return float(width) / 72.0


HANDLE = 0.65  # inches beside a label of a legend: what is drawn, and space


def legend_columns(labels: Sequence[str], inches: float) -> int:
    """The number of columns in which a legend is no wider than so many inches; at least 1."""
    widths = [max(map(width_of, label.split("\n"))) + HANDLE for label in labels]
    for columns in range(len(widths), 1, -1):
        if sum(max(column) for column in np.array_split(widths, columns)) <= inches:
            return columns
    return 1


LINE_HEIGHT = 1.2  # of the size of its letters
LEADER = 8.0  # points from the end of a line to its label
BESIDE = {
    "relpos": (0.0, 0.5),
    "patchA": None,
    "shrinkA": 2.0,
    "shrinkB": 0.0,
}  # ends of a leader: to cut it takes long


@dataclass(frozen=True)
class EndLabel:
    """A label at the right end of a line.

    Attributes:
        text: of the label.
        place: the line's last value.
        colour: of both.
    """

    text: str
    place: float
    colour: Any


def label_ends(axes: Axes, labels: Sequence[EndLabel]) -> None:
    """Write labels to the right of axes whose limits are set, each as near to the end of its line as the others let it.

    Labels of lines that end outside are written at the edge.
    """
    (_, bottom), (_, top) = axes.transAxes.transform([(0.0, 0.0), (0.0, 1.0)])
    low, high = sorted(axes.get_ylim())
    places = np.clip([label.place for label in labels], low, high)
    ends = np.array([axes.transData.transform((1.0, place))[1] for place in places])
    ends = (ends - bottom) / (top - bottom)
    height = 72.0 * (top - bottom) / axes.get_figure(root=True).dpi  # type: ignore[union-attr]
    lines = max((label.text.count("\n") + 1 for label in labels), default=1)
    moved = spread(ends, lines * LINE_HEIGHT * SMALL / height)
    for label, place, away in zip(labels, places, (moved - ends) * height, strict=True):
        leader = {"arrowstyle": "-", "color": label.colour, "linewidth": 0.6, **BESIDE}
        axes.annotate(
            label.text, (1.0, place), (LEADER, away), xycoords=axes.get_yaxis_transform(),
            textcoords="offset points", color=label.colour, fontsize=SMALL, va="center", ha="left", linespacing=1.0,
            arrowprops=leader, annotation_clip=False, parse_math=False,
        )  # fmt: skip


def spread(places: FloatArray, gap: float) -> FloatArray:
    """Places from 0 to 1, (n,), moved as little as possible, in squares, so that no two are nearer than a gap.

    They keep their order, and stay from 0 to 1 if all fit there.
    """
    order = np.argsort(places, kind="stable")
    blocks: list[list[float]] = []  # of neighbours that touch: where the lowest of all places would be, one by one
    for rank, number in enumerate(order):
        blocks.append([float(places[number]) - rank * gap])
        while len(blocks) > 1 and np.mean(blocks[-2]) > np.mean(blocks[-1]):
            last = blocks.pop()
            blocks[-1] += last
    lowest = np.array([np.mean(block) for block in blocks for _ in block])
    spare = 1.0 - gap * max(len(order) - 1, 0)
    lowest = np.clip(lowest, 0.0, spare) if spare > 0.0 else np.full(len(order), spare / 2.0)
    moved = np.empty(len(order))
    moved[order] = lowest + gap * np.arange(len(order))
    return moved


DIRECTIONS = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)], dtype=np.float64)
DISTANCES = (6.0, 11.0, 20.0, 32.0)  # points from the place to the label
MARKER = 4.0  # points: half the size of what marks a place
JOINED = 15.0  # points, from which on a line joins the two
CUT, COVERED, OUTSIDE, FAR = 1e4, 150.0, 120.0, 0.15  # penalties: beyond the figure, of another label, beyond
# the axes, for each point of distance
SPACING = 3.0  # points between two looks along a line


@dataclass(frozen=True)
class PlaceLabel:
    """A label beside a point.

    Attributes:
        text: of the label.
        place: the point, (2,), in data.
        colour: of the text.
    """

    text: str
    place: FloatArray
    colour: Any = "0.1"


def label_places(axes: Axes, labels: Sequence[PlaceLabel], lines: Sequence[FloatArray] = ()) -> None:
    """Write labels beside points of axes whose limits and place are final, where they cover little.

    Args:
        axes: to write into.
        labels: the first find a place first.
        lines: what should not be covered, each (n, 2), in data.
    """
    scale = 72.0 / axes.get_figure(root=True).dpi  # type: ignore[union-attr]
    ink = np.vstack([np.empty((0, 2)), *(dense(scale * axes.transData.transform(line)) for line in lines)])
    frame, page = (scale * box.get_points() for box in (axes.get_window_extent(), axes.figure.bbox))
    places = [scale * axes.transData.transform(label.place) for label in labels]
    taken = [np.array([place - MARKER, place + MARKER]) for place in places]  # lower and upper corners, (2, 2), points
    for label, place in zip(labels, places, strict=True):
        middle, box = _best(place, size_of(label.text), ink, (frame, page), taken)
        taken.append(box)
        far = float(np.linalg.norm(middle - place)) > JOINED
        leader = {"arrowstyle": "-", "color": label.colour, "linewidth": 0.6, "shrinkA": 1.0, "shrinkB": 2.0}
        axes.annotate(
            label.text, tuple(label.place), tuple(middle - place), textcoords="offset points",
            color=label.colour, fontsize=SMALL, ha="center", va="center", zorder=8, annotation_clip=False,
            parse_math=False,
            bbox={"boxstyle": "square,pad=0.08", "facecolor": "white", "alpha": 0.75, "linewidth": 0.0},
            arrowprops=leader if far else None,
        ).set_in_layout(False)  # fmt: skip


def _best(
    place: FloatArray, size: FloatArray, ink: FloatArray, frames: Sequence[FloatArray], taken: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """The middle of the best box of a size around a place, and its corners, all in points; frames: of axes, figure."""
    found: list[tuple[float, int, FloatArray, FloatArray]] = []
    for distance in DISTANCES:
        for direction in DIRECTIONS:
            middle = place + direction * (size / 2.0 + distance / max(1.0, float(np.linalg.norm(direction))))
            box = np.array([middle - size / 2.0, middle + size / 2.0])
            inside = ((ink > box[0]) & (ink < box[1])).all(axis=1).sum()
            covered = sum(bool(((box[0] < other[1]) & (other[0] < box[1])).all()) for other in taken)
            off, cut = (bool((box[0] < frame[0]).any() or (box[1] > frame[1]).any()) for frame in frames)
            penalty = inside + COVERED * covered + OUTSIDE * off + CUT * cut + FAR * distance
            found.append((penalty, len(found), middle, box))
    _, _, middle, box = min(found)
    return middle, box


def size_of(text: str) -> FloatArray:
    """Width and height of a label, (2,), points."""
    return np.array([72.0 * width_of(text) + 2.0, 1.15 * SMALL])


def dense(line: FloatArray) -> FloatArray:
    """Points of a line (n, 2), in points, no farther apart than ``SPACING``."""
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    if lengths[-1] == 0.0:
        return line[:1]
    at = np.linspace(0.0, lengths[-1], int(np.ceil(lengths[-1] / SPACING)) + 1)
    return np.column_stack([np.interp(at, lengths, column) for column in line.T])
