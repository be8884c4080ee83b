"""Figures of scenes, motions and runs; matplotlib is slow to load, and loaded when one is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from problems.base import shown
from solvers import Interruption
from tpbso_casadi.figures.palette import DEFAULT
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.storage import Writer, write_plan


def write_run(
    folder: Path,
    plan: PlannedMotion,
    plots: bool = True,
    further: Sequence[Writer] = (),
    interruption: Interruption | None = None,
    same_plan_only: bool = False,
    formats: Sequence[str] = DEFAULT,
) -> list[str]:
    """Write the files of a plan in place of everything in the folder: at every moment it holds one run, complete.

    Args:
        folder: of the run.
        plan: to be written.
        plots: whether to draw the figures.
        further: each writes files into the folder that it is given.
        interruption: after its request, figures and further files that are not complete yet are left out.
        same_plan_only: whether a run in the folder has to be of the same scenario.
        formats: of the figures.

    Returns:
        The names of the files.

    Raises:
        OutputError: the folder cannot be written, or holds anything but a run; it is left as it was. Or a figure or a
            further file cannot be; the plan is written without it.
        OtherPlan: it holds the run of another scenario, where that must not be; it is left as it was.
    """
    if not isinstance(plan, PlannedMotion):
        raise TypeError(f"plan: what plan(scenario) returns is needed, not {shown(plan)}")
    figures = figure_writers(plan, formats if plots else ())
    return write_plan(Path(folder), plan, [*figures, *further], interruption, same_plan_only)


def figure_writers(plan: PlannedMotion, formats: Sequence[str]) -> list[Writer]:
    """Writers of a plan's figures into a folder; none where there are no formats."""

    def draw(folder: Path) -> None:
        from tpbso_casadi.figures.run import draw_figures  # noqa: PLC0415 (matplotlib is slow to load)

        draw_figures(folder, plan, formats)

    return [draw] if formats else []
