"""Figures of scenes, motions and runs; matplotlib is slow to load, and loaded when one is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.storage import Writer


def figure_writers(plan: PlannedMotion, formats: Sequence[str]) -> list[Writer]:
    """Writers of a plan's figures into a folder; none where there are no formats."""

    def draw(folder: Path) -> None:
        from tpbso_casadi.figures.run import draw_figures  # noqa: PLC0415 (matplotlib is slow to load)

        draw_figures(folder, plan, formats)

    return [draw] if formats else []
