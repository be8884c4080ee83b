"""The figures of a comparison, written as files and put on its page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from tpbso_casadi.campaign.analysis.best import Best
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.figures.drawing import drawings, inline_svg, write_figures
from tpbso_casadi.campaign.page.page import Picture
from tpbso_casadi.figures.paths import path_figure
from tpbso_casadi.planning.planned_motion import PlannedMotion


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
            title=drawing.kind.title_of(results.measure),
            name=drawing.kind.name,
            reading=drawing.kind.reading_of(results.measure),
            svg=drawing.svg(f"{drawing.kind.title_of(results.measure)} {of}"),
            reason=drawing.reason,
        )
        for drawing in drawn
    ]


def plans_of(best: Sequence[Best]) -> dict[str, Markup]:
    """The picture of the best plan of each case, by its name; none of a case without motions."""
    plans = {each.run.case: each.found.planned for each in best}
    return {
        case: plan_of(f"plan-{index}", case, planned)
        for index, (case, planned) in enumerate(plans.items())
        if planned is not None
    }


def plan_of(name: str, case: str, planned: PlannedMotion) -> Markup:
    """The picture of one plan: the path of the tool, with postures and obstacles."""
    alt = f"The best plan on {case}: path, postures and obstacles"
    return inline_svg(path_figure(planned), name, alt)
