"""The figures of a comparison, written as files and put on its page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from tpbso_casadi.campaign.analysis.best import BestPlan
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.figures.best_plan import best_plan_figure
from tpbso_casadi.campaign.figures.drawing import drawings, inline_svg, write_figures
from tpbso_casadi.campaign.page.page import Picture


def pictures_of(folder: Path, results: Results, formats: Sequence[str]) -> list[Picture]:
    """Write every figure into a folder; returns them for a page.

    Raises:
        OSError: a file cannot be written.
    """
    drawn = drawings(results)
    write_figures(folder, drawn, formats)
    of = f"of {', '.join(results.solvers)} on {', '.join(results.cases)}; the tables below have the numbers"
    return [
        Picture(
            title=drawing.kind.title,
            name=drawing.kind.name,
            reading=drawing.kind.reading,
            svg=drawing.svg(f"{drawing.kind.title} {of}"),
            reason=drawing.reason,
        )
        for drawing in drawn
    ]


def plans_of(best: Sequence[BestPlan]) -> dict[str, Markup]:
    """The picture of the best plan of each case, by its name."""
    return {plan.run.case: plan_of(f"plan-{index}", plan) for index, plan in enumerate(best)}


def plan_of(name: str, best: BestPlan) -> Markup:
    """The picture of one plan."""
    alt = f"The best plan on {best.run.case}: path, postures and obstacles"
    return inline_svg(best_plan_figure(best), name, alt)
