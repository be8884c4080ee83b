"""A plan that was read back from its run folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Self

from tpbso_casadi.facade.arguments.values import file_path
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.results.export import RATE, chosen, exports_of
from tpbso_casadi.figures.style.formats import FORMATS
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.storage.motion_table import write_motion
from tpbso_casadi.storage.result import RunResult
from tpbso_casadi.storage.run_folder import replace_folder
from tpbso_casadi.storage.stored_run import StoredRun


@dataclass(frozen=True, eq=False, repr=False)
class StoredPlan(Plan):
    """A plan whose folder was read, and whose numbers were computed again. Its search is known by its record alone.

    Attributes:
        run: the content of the folder.
    """

    run: StoredRun

    @classmethod
    def of(cls, run: StoredRun) -> Self:
        """The plan of a run."""
        return cls(PlannedMotion(scenario=run.scenario, motion=run.motion), run)

    @property
    def result(self) -> RunResult:
        """The content of ``result.json``."""
        return self.run.result

    def as_run(self) -> StoredRun:
        """What was read."""
        return self.run

    def save(
        self, folder: str | Path, export: Sequence[str] = (), figures: Sequence[str] = ("png",), rate: float = RATE
    ) -> Path:
        """Write the run to another folder, as :meth:`Plan.save` does; figures of its search are left out."""
        place = file_path("folder", folder)
        formats, exports = chosen("figures", figures, FORMATS), exports_of(self.motion, export, rate)
        replace_folder(
            place,
            needed=[lambda staged: write_motion(staged / "trajectory.csv", self.motion, self.times)],
            further=[*([partial(self._draw, formats)] if formats else []), *exports],
            result=lambda files: self.result.model_copy(update={"files": files}).to_json(),
        )
        return place

    def _draw(self, formats: Sequence[str], folder: Path) -> None:
        from tpbso_casadi.figures.run import draw_figures  # noqa: PLC0415 (matplotlib is slow to load)

        draw_figures(folder, self.planned, formats)
