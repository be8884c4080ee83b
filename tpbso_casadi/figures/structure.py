"""The figure of a scenario's audit: the sparsity of the Jacobian of each constraint.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import casadi as ca
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import MaxNLocator

from problems import Constraint
from problems.base.matrix import FloatArray
from problems.certify.structure import jacobian_pattern
from problems.limits.limit import SAMPLING_MARGIN
from tpbso_casadi.figures.limits import spans
from tpbso_casadi.figures.style.colours import BLUE
from tpbso_casadi.figures.style.files import write_figure
from tpbso_casadi.figures.style.formats import DEFAULT
from tpbso_casadi.figures.style.paper import SMALL, TWO_COLUMNS, in_print
from tpbso_casadi.scenario.scenario import Scenario

SMALLEST_PANEL = 0.08  # of the height of all panels
HEIGHT = 4.6  # inches


def draw_structure(folder: Path, scenario: Scenario, formats: Sequence[str] = DEFAULT) -> list[Path]:
    """Draw ``structure.png`` into a folder, or the same in other formats."""
    return write_figure(folder, "structure", structure_figure(scenario), formats)


@in_print
def structure_figure(scenario: Scenario) -> Figure:
    """The search model on the left, the nonlinear program on the right."""
    problem = scenario.problem()
    models = [("search model", problem.constraints, problem.model.x)]
    if problem.has_program:
        program = problem.nlp()
        models.append(("nonlinear program", tuple(program.constraints(SAMPLING_MARGIN)), program.x))
    figure = Figure(figsize=(TWO_COLUMNS, HEIGHT), layout="constrained")
    halves = figure.add_gridspec(1, len(models))
    for side, (title, constraints, x) in enumerate(models):
        draw_model(figure.add_subfigure(halves[0, side]), title, constraints, x)
    return figure


def draw_model(figure: SubFigure, title: str, constraints: Sequence[Constraint], x: ca.SX) -> None:
    """One panel per constraint, its height proportional to its rows but large enough to be visible."""
    patterns = [jacobian_pattern(constraint, x) for constraint in constraints]
    rows, nonzeros = (sum(counts) for counts in ([len(p) for p in patterns], [int(p.sum()) for p in patterns]))
    heights = [max(len(pattern), SMALLEST_PANEL * rows) for pattern in patterns]
    panels = figure.subplots(len(patterns), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": heights})
    for axes, pattern, constraint in zip(panels[:, 0], patterns, constraints, strict=True):
        axes.add_collection(PolyCollection(runs(pattern), facecolor=BLUE, linewidths=0.0))
        axes.set(xlim=(-0.5, pattern.shape[1] - 0.5), ylim=(len(pattern), 0.0), yticks=[])
        label = f"{constraint.name}\n{len(pattern)} rows"
        axes.set_ylabel(label, rotation=0, ha="right", va="center", fontsize=SMALL)
    panels[-1, 0].set_xlabel("variable")
    panels[-1, 0].xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.suptitle(f"{title}: {rows} rows, {x.shape[0]} variables,\n{nonzeros} structural nonzeros")


def runs(pattern: np.ndarray) -> list[FloatArray]:
    """Rectangles (4, 2) around the nonzeros of a pattern (rows, columns) that follow each other in a column."""
    return [
        np.array([(column - 0.5, top), (column + 0.5, top), (column + 0.5, bottom + 1), (column - 0.5, bottom + 1)])
        for column, mask in enumerate(pattern.T.astype(bool))
        for top, bottom in spans(mask)
    ]
