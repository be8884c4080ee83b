"""Figs 2 to 16: the pictures of one case, and a player that shows the arm moving.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from string import ascii_lowercase

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from tpbso_casadi.animation import frames_of, player
from tpbso_casadi.figures.measures import curve_figures, progress_figures
from tpbso_casadi.figures.paths import path_figure
from tpbso_casadi.figures.run import convergence_figure, joints_figure
from tpbso_casadi.planning.plan import plan
from tpbso_casadi.planning.planned_motion import SearchedMotion
from tpbso_casadi.scenario.scenario import parse_scenario

DPI = 200


@dataclass(frozen=True)
class Picture:
    """An image for a page.

    Attributes:
        caption: what it shows.
        image: WebP.
    """

    caption: str
    image: bytes


@dataclass(frozen=True)
class Illustration:
    """A case to look at.

    Attributes:
        case: its name.
        seed: of the run that is shown.
        objective: that this run has when it is done again for the pictures.
        pictures: in the paper's order.
        player: the arm in motion, HTML.
    """

    case: str
    seed: int
    objective: float
    pictures: tuple[Picture, ...]
    player: Markup


def illustrate(case: str, scenario: str, histories: Sequence[Sequence[float | None]]) -> Illustration:
    """Repeat a run and draw it.

    Args:
        case: its name.
        scenario: JSON, with solver and seed.
        histories: the best costs over the iterations of all runs of the same solver.
    """
    repeated = plan(parse_scenario(json.loads(scenario))).searched
    assert repeated is not None
    convergence = convergence_figure(repeated)
    add_other_runs(convergence, repeated, histories)
    figures = [("convergence; grey: the other runs", convergence), *progress_figures(repeated).values()]
    figures.append(("path and postures", path_figure(repeated)))
    figures += curve_figures(repeated).values() or [("joints", joints_figure(repeated))]
    pictures = tuple(
        Picture(f"({letter}) {caption}", webp(figure))
        for letter, (caption, figure) in zip(ascii_lowercase, figures, strict=False)
    )
    moving = player(case, frames_of(repeated.motion))
    return Illustration(case, repeated.scenario.solver.seed, repeated.objective, pictures, moving)


def add_other_runs(figure: Figure, repeated: SearchedMotion, histories: Sequence[Sequence[float | None]]) -> None:
    """Draw the convergence of other runs behind that of the plan, where they have something feasible."""
    axes = figure.axes[0]
    for history in histories:
        cost = np.array(history, dtype=np.float64)
        cost[~(cost <= repeated.problem.objective_upper_bound)] = np.nan
        axes.step(np.arange(cost.size), cost, where="post", color="0.75", linewidth=0.7, zorder=0)


def webp(figure: Figure) -> bytes:
    """A figure as an image."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="webp", dpi=DPI, pil_kwargs={"lossless": True, "method": 4})
    return buffer.getvalue()
