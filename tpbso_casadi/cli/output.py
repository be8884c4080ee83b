"""What ``solve`` writes: a run folder, exports in it, an animation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from solvers.driver.interruption import Interruption
from tpbso_casadi.animation import animate, check_animation
from tpbso_casadi.planning.plan import Plan
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.storage.exporting import export_motion
from tpbso_casadi.storage.files import OutputError
from tpbso_casadi.storage.run_folder import check_run_folder, write_run


@dataclass(frozen=True, kw_only=True)
class Output:
    """Files to be written.

    Attributes:
        folder: of the run; None where there is none.
        plots: whether to draw figures.
        exports: their kinds, keys of ``EXPORTS``.
        rate: of their rows, Hz.
        film: animation file; None where there is none. It may lie in the run folder.
        title: of the animation.
    """

    folder: Path | None
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
        if self.folder is not None:
            check_run_folder(self.folder)
        elif self.exports:
            raise OutputError("--export: needs a run folder; say --out DIR too")
        if self.film is not None:
            check_animation(self.film)

    def write(self, plan: Plan, progress: Progress, interruption: Interruption) -> None:
        """Write all of it; once there is a request to stop, the run folder without what is not complete.

        Raises:
            OutputError: it cannot be written.
        """
        if self.folder is not None:
            progress.phase("writing")
            further: list[Callable[[Path], object]] = [
                partial(export_motion, motion=plan.motion, kind=kind, rate=self.rate) for kind in self.exports
            ]
            if self._films_into_folder:
                further.append(partial(self._film, plan, progress))
            write_run(self.folder, plan, self.plots, further, interruption)
        if self.film is not None and not self._films_into_folder:
            interruption.attempt(partial(self._film, plan, progress, self.film.parent))

    @property
    def _films_into_folder(self) -> bool:
        return None not in (self.film, self.folder) and self.film.parent.resolve() == self.folder.resolve()  # type: ignore[union-attr]

    def _film(self, plan: Plan, progress: Progress, folder: Path) -> None:
        assert self.film is not None
        progress.phase("filming")
        animate(folder / self.film.name, self.title, plan.motion)
