"""What a command writes."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Self

from solvers import Interruption
from tpbso_casadi.animation.write import animate, check_animation
from tpbso_casadi.cli.common import path, positive_number
from tpbso_casadi.cli.options import (
    add_figures_option,
    add_json,
    add_no_plots,
    add_out,
    add_quiet,
    defaulting,
    figure_formats,
    listed,
    output_group,
)
from tpbso_casadi.figures import write_run
from tpbso_casadi.planning import PlannedMotion, Progress
from tpbso_casadi.storage import (
    DEFAULT_RATE,
    EXPORTS,
    HIGHEST_RATE,
    OtherPlan,
    OutputError,
    check_run_folder,
    export_motion,
)


def add_output_options(parser: argparse.ArgumentParser, default: str) -> None:
    """The options of every command that makes a motion.

    Args:
        parser: to add them to.
        default: what the run folder is called where it is not named.
    """
    output = output_group(parser)
    add_out(output, default)
    add_json(output)
    add_no_plots(output)
    add_figures_option(output)
    output.add_argument(
        "--animate", type=path, metavar="FILE", help=defaulting("the motion as .gif, .mp4 or .html", "none")
    )
    output.add_argument(
        "--export",
        action="append",
        choices=EXPORTS,
        default=[],
        metavar="KIND",
        help=defaulting(f"for a robot, at equal steps of time: {listed(EXPORTS)}; repeatable", "none"),
    )
    output.add_argument(
        "--rate", type=positive_number(HIGHEST_RATE), default=DEFAULT_RATE, metavar="HZ", help="of these steps, Hz"
    )
    output.add_argument("--certify", action="store_true", help="prove the plan for all t; always done, in milliseconds")
    add_quiet(output)


@dataclass(frozen=True, kw_only=True)
class Output:
    """Files to be written.

    Attributes:
        folder: says where the run goes to; it is asked before the search and again when the plan is written, as another
            plan may have taken the place. None where there is no folder.
        named: whether the user named the folder, who may have a run of another plan replaced there.
        formats: of the figures; none where none are drawn.
        exports: their kinds, keys of ``EXPORTS``.
        rate: of their rows, Hz.
        film: animation file; None where there is none. It may lie in the run folder.
        title: of the animation.
    """

    folder: Callable[[], Path] | None
    named: bool
    formats: Sequence[str]
    exports: Sequence[str]
    rate: float
    film: Path | None
    title: str

    @classmethod
    def of(cls, options: argparse.Namespace, free_folder: Callable[[], Path], title: str) -> Self:
        """What the options of a command line state.

        Args:
            options: of :func:`add_output_options`.
            free_folder: where the run goes to if the user names no folder; not asked where only JSON is printed.
            title: of the animation.
        """
        folder: Callable[[], Path] | None = free_folder
        if options.out is not None:
            folder = partial(Path, options.out)
        elif options.json:
            folder = None
        return cls(
            folder=folder,
            named=options.out is not None,
            formats=figure_formats(options),
            exports=options.export,
            rate=options.rate,
            film=options.animate,
            title=title,
        )

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
                write_run(folder, plan, bool(self.formats), further, interruption, not self.named, formats=self.formats)
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
