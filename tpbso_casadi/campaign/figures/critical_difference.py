"""The critical-difference diagram: mean ranks over cases, and which solvers do not differ significantly (Demsar)."""

from __future__ import annotations

from math import ceil, floor

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tpbso_casadi.campaign.analysis.ranks import Ranking, ranking
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.statistics import p_text
from tpbso_casadi.figures.style.colours import colour_of, marker_of
from tpbso_casadi.figures.style.paper import TWO_COLUMNS, in_print

BAR, BAR_STEP = 0.35, 0.3  # the first bar below the axis, and from one to the next, in rows


@in_print
def critical_difference_figure(results: Results) -> Figure:
    """Solvers on an axis of mean ranks, the best on the left; a thick bar joins those that do not differ."""
    found = ranking(results.solvers, results.scores())
    half = ceil(len(found.solvers) / 2)
    depth = BAR + BAR_STEP * len(found.groups)
    figure = Figure(figsize=(TWO_COLUMNS, 1.2 + 0.3 * (depth + half)), layout="constrained")
    axes = figure.subplots()
    axes.set_title(
        f"Mean ranks of median runs over {found.cases} cases; Friedman test: p {equals(found.p)}",
        loc="left",
    )
    draw_axis(axes, found)
    for step, (first, last) in enumerate(found.groups):
        y = -BAR - BAR_STEP * step
        axes.plot(found.ranks[[first, last]] + (-0.04, 0.04), [y, y], color="0.2", linewidth=4, solid_capstyle="butt")
    for place, (solver, rank) in enumerate(zip(found.solvers, found.ranks, strict=True)):
        row = place if place < half else len(found.solvers) - 1 - place
        draw_solver(axes, found, results.solvers.index(solver), solver, float(rank), place < half, -depth - row)
    axes.set_ylim(-depth - half + 0.3, 1.2)
    return figure


def equals(p: float) -> str:
    """P behind its name."""
    text = p_text(p)
    return text if text.startswith("<") else f"= {text}"


def limits(found: Ranking) -> tuple[int, int]:
    """The whole ranks around all mean ranks."""
    return floor(found.ranks[0]), max(floor(found.ranks[0]) + 1, ceil(found.ranks[-1]))


def draw_axis(axes: Axes, found: Ranking) -> None:
    """The line of ranks at the top, with its ticks and numbers."""
    low, high = limits(found)
    margin = 0.45 * (high - low)
    axes.set_axis_off()
    axes.set_xlim(low - margin, high + margin)
    axes.plot([low, high], [0.0, 0.0], color="black", linewidth=1.2)
    for rank in range(low, high + 1):
        axes.plot([rank, rank], [0.0, 0.15], color="black", linewidth=1.2)
        axes.text(rank, 0.25, str(rank), ha="center", va="bottom")


def draw_solver(axes: Axes, found: Ranking, index: int, name: str, rank: float, left: bool, y: float) -> None:
    """A solver's mark on the axis, and its name on the side where it is nearer."""
    low, high = limits(found)
    side = low - 0.05 * (high - low) if left else high + 0.05 * (high - low)
    axes.plot([rank, rank, side], [0.0, y, y], color=colour_of(index), linewidth=1.0)
    axes.plot(rank, 0.0, marker_of(index), color=colour_of(index), markersize=7, clip_on=False)
    text = f"{name}  {rank:.2f}" if left else f"{rank:.2f}  {name}"
    offset = -4 if left else 4
    axes.annotate(text, (side, y), (offset, 0), textcoords="offset points", ha="right" if left else "left", va="center")
