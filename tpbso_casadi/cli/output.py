"""What ``solve`` writes: a run folder, exports in it, an animation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from solvers.driver.interruption import Interruption
from tpbso_casadi.animation import animate, check_animation
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.storage.exporting import export_motion
from tpbso_casadi.storage.files import OutputError
from tpbso_casadi.storage.run_folder import OtherPlan, check_run_folder, write_run


@dataclass(frozen=True, kw_only=True)
class Output:
    """Files to be written.

    Attributes:
        folder: says where the run goes to; it is asked before the search and again when the plan is written, as another
            plan may have taken the place. None where there is no folder.
        named: whether the user named the folder, who may have a run of another plan replaced there.
        plots: whether to draw figures.
        exports: their kinds, keys of ``EXPORTS``.
        rate: of their rows, Hz.
        film: animation file; None where there is none. It may lie in the run folder.
        title: of the animation.
    """

    folder: Callable[[], Path] | None
    named: bool
    plots: bool
    exports: Sequence[str]
    rate: float
    film: Path | None
    title: str

    def check(self) -> None:
        """Make sure before the search that everything can be written.

        Raises:
            OutputError: it cannot.
        """
        folder = None if self.folder is None else self.folder()
        if folder is not None:
            check_run_folder(folder)
        elif self.exports:
            raise OutputError("--export: needs a run folder; say --out DIR too")
        if self.film is not None:
            check_animation(self.film)
            inner = None if folder is None else self._place_in(folder)
            if inner is not None and len(inner.parts) > 1:
                raise OutputError(f"--animate {self.film}: a run folder holds no other folders")

    def write(self, plan: PlannedMotion, progress: Progress, interruption: Interruption) -> Path | None:
        """Write all of it; once there is a request to stop, the run folder without what is not complete.

        Returns:
            The run folder.

        Raises:
            OutputError: it cannot be written.
        """
        folder = None if self.folder is None else self._write_run(self.folder, plan, progress, interruption)
        if self.film is not None and (folder is None or self._place_in(folder) is None):
            interruption.attempt(partial(self._film, plan, progress, self.film.parent))
        return folder

    def _write_run(
        self, next_folder: Callable[[], Path], plan: PlannedMotion, progress: Progress, interruption: Interruption
    ) -> Path:
        progress.phase("writing")
        while True:
            folder = next_folder()
            further: list[Callable[[Path], object]] = [
                partial(export_motion, motion=plan.motion, kind=kind, rate=self.rate) for kind in self.exports
            ]
            if self.film is not None and self._place_in(folder) is not None:
                further.append(partial(self._film, plan, progress))
            with suppress(OtherPlan):  # which came while this one was being drawn
                write_run(folder, plan, self.plots, further, interruption, same_plan_only=not self.named)
                return folder

    def _place_in(self, folder: Path) -> Path | None:
        """The animation relative to a folder; None where it lies outside."""
        assert self.film is not None
        place = self.film.parent.resolve() / self.film.name
        return place.relative_to(folder.resolve()) if place.is_relative_to(folder.resolve()) else None

    def _film(self, plan: PlannedMotion, progress: Progress, folder: Path) -> None:
        assert self.film is not None
        progress.phase("filming")
        animate(folder / self.film.name, self.title, plan.motion)
