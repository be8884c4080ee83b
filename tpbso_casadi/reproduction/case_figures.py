"""Figs 2 to 16: the pictures of one case, and its arm in motion.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from problems import PathFollowing
from tpbso_casadi.animation import frames_of, player
from tpbso_casadi.figures.path import PATH_FIGURES
from tpbso_casadi.figures.run import convergence_figure, joints_figure, path_figure
from tpbso_casadi.planning.plan import Plan, plan
from tpbso_casadi.scenario.scenario import parse_scenario

DPI = 110


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
    """Do a run again and draw it.

    Args:
        case: its name.
        scenario: JSON, with solver and seed.
        histories: the best costs over the iterations of all runs of the same arm.
    """
    found = plan(parse_scenario(json.loads(scenario)))
    convergence = convergence_figure(found)
    add_other_runs(convergence, found, histories)
    way = path_figure(found)
    if isinstance(found.problem, PathFollowing):
        rest = [
            ("(b) trajectory accuracy", PATH_FIGURES["accuracy"](found)),
            ("(c) path and postures", way),
            ("(d) redundancy angle", PATH_FIGURES["redundancy"](found)),
        ]
    else:
        rest = [("(b) path and postures", way), ("(c) joints", joints_figure(found))]
    drawn = [("(a) convergence; grey: the other runs", convergence), *rest]
    pictures = tuple(Picture(caption, webp(figure)) for caption, figure in drawn)
    moving = player(case, frames_of(found.motion))
    return Illustration(case, found.scenario.solver.seed, found.objective, pictures, moving)


def add_other_runs(figure: Figure, found: Plan, histories: Sequence[Sequence[float | None]]) -> None:
    """Draw the convergence of other runs behind that of the plan, where they have something feasible."""
    axes = figure.axes[0]
    for history in histories:
        cost = np.array(history, dtype=np.float64)
        cost[~(cost <= found.problem.objective_upper_bound)] = np.nan
        axes.step(np.arange(cost.size), cost, where="post", color="0.75", linewidth=0.7, zorder=0)


def webp(figure: Figure) -> bytes:
    """A figure as an image."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="webp", dpi=DPI, pil_kwargs={"lossless": True, "method": 4})
    return buffer.getvalue()
