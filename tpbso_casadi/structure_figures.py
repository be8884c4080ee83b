"""The picture of a scenario's audit: where the Jacobian of each constraint can differ from zero.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from problems.problem import SAMPLING_MARGIN
from problems.structure import jacobian_pattern
from tpbso_casadi.scenario import Scenario


def draw_structure(folder: Path, scenario: Scenario) -> Path:
    """Draw ``structure.png`` into a folder: the search model on the left, the nonlinear program on the right."""
    problem = scenario.problem()
    program = problem.nlp()
    models = (
        ("search model", problem.constraints, problem.model.x),
        ("nonlinear program", program.constraints(SAMPLING_MARGIN), program.x),
    )
    figure = Figure(figsize=(11.0, 6.5), layout="constrained")
    for axes, (title, constraints, x) in zip(figure.subplots(1, 2), models, strict=True):
        patterns = [jacobian_pattern(constraint, x) for constraint in constraints]
        whole = np.vstack(patterns)
        axes.imshow(whole, aspect="auto", cmap="Blues", vmin=0, vmax=1.3, interpolation="nearest")
        edges = np.cumsum([0, *(len(pattern) for pattern in patterns)])
        for edge in edges[1:-1]:
            axes.axhline(edge - 0.5, color="0.4", linewidth=0.8)
        axes.set_yticks((edges[:-1] + edges[1:]) / 2.0 - 0.5, [constraint.name for constraint in constraints])
        axes.set_xlabel("variable")
        axes.set_title(f"{title}: {whole.shape[0]} rows, {whole.shape[1]} variables, {int(whole.sum())} nonzeros")
    path = folder / "structure.png"
    figure.savefig(path, dpi=150)
    return path
