"""What a command writes, and into which folder."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Self

from solvers import Interruption
from tpbso_casadi.cli.options import (
    add_certificate,
    add_figures_option,
    add_json,
    add_no_plots,
    add_out,
    add_quiet,
    defaulting,
    figure_formats,
    listed,
    output_group,
    path,
    positive_number,
)
from tpbso_casadi.figures import figure_writers
from tpbso_casadi.planning import PlannedMotion, Progress
from tpbso_casadi.programs import DEFAULT_RATE, EXPORTERS, HIGHEST_RATE, exporter_at
from tpbso_casadi.scenario import Scenario
from tpbso_casadi.storage import (
    OtherPlan,
    OutputError,
    Writer,
    add_to_plan,
    check_certificate_file,
    check_file,
    check_run_folder,
    check_writable,
    stored_content,
    write_certificate,
    write_plan,
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
        choices=EXPORTERS.names(),
        default=[],
        metavar="KIND",
        help=defaulting(f"for a robot: {listed(EXPORTERS.names())}; repeatable", "none"),
    )
    output.add_argument(
        "--rate",
        type=positive_number(HIGHEST_RATE),
        metavar="HZ",
        help=defaulting(
            "of their rows, at equal steps of time",
            f"{DEFAULT_RATE:g}; for ROS such rows that what a controller makes of them is proven",
        ),
    )
    add_certificate(output)
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
        exports: their kinds, names in ``EXPORTERS``.
        rate: of their rows, Hz; None where none is stated.
        certificate: file for a certificate; None where none is written.
        film: animation file; None where there is none. It may lie in the run folder.
        title: of the animation.
    """

    folder: Callable[[], Path] | None
    named: bool
    formats: Sequence[str]
    exports: Sequence[str]
    rate: float | None
    certificate: Path | None
    film: Path | None
    title: str

    @classmethod
    def of(cls, options: argparse.Namespace, free_folder: Callable[[], Path], title: str) -> Self:
        """The output that the options of a command line state.

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
            certificate=options.certificate,
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
        if self.certificate is not None:
            check_writable(self.certificate.parent)
            check_file(self.certificate)
            check_certificate_file(self.certificate)
        if self.film is not None:
            from tpbso_casadi.animation.write import check_animation  # noqa: PLC0415 (loads matplotlib)

            check_animation(self.film)
            inner = None if folder is None else self._place_in(folder)
            if inner is not None and len(inner.parts) > 1:
                raise OutputError(f"--animate {self.film}: a run folder holds no other folders")

    def write(self, plan: PlannedMotion, progress: Progress) -> Path | None:
        """Write the run folder, without exports and what is drawn.

        Returns:
            The run folder; None where there is none.

        Raises:
            OutputError: it cannot be written.
        """
        if self.folder is None:
            return None
        progress.phase("writing")
        while True:
            folder = self.folder()
            with suppress(OtherPlan):  # which came while this one was being written
                write_plan(folder, plan, same_plan_only=not self.named)
                return folder

    def told(self, plan: PlannedMotion) -> Iterator[str]:
        """Remarks on files that hold another motion than the plan, or maybe do: rows and points for a controller."""
        for kind in self.exports:
            yield from exporter_at(kind, self.rate).program(plan).remarks

    def add(self, plan: PlannedMotion, folder: Path | None, progress: Progress, interruption: Interruption) -> None:
        """Add exports, figures and film to a plan that is written; after a request to stop only what is complete.

        Raises:
            OutputError: they cannot be written.
        """
        if self.certificate is not None:
            progress.phase("dividing the proof")
            if plan.feasible:
                write_certificate(self.certificate, plan.motion)
            else:
                self.certificate.unlink(missing_ok=True)  # it would be taken for one of this motion
        exports = [exporter_at(kind, self.rate).program(plan).write for kind in self.exports]
        further: list[Writer] = [*exports, *figure_writers(plan, self.formats)]
        is_inside = folder is not None and self.film is not None and self._place_in(folder) is not None
        if is_inside:
            further.append(partial(self._film, plan, progress))
        if folder is not None and further:
            progress.phase("drawing")
            add_to_plan(folder, plan, further, interruption)
        if self.film is not None and not is_inside:
            interruption.attempt(partial(self._film, plan, progress, self.film.parent))

    def _place_in(self, folder: Path) -> Path | None:
        """The animation relative to a folder; None where it lies outside."""
        assert self.film is not None
        place = self.film.parent.resolve() / self.film.name
        return place.relative_to(folder.resolve()) if place.is_relative_to(folder.resolve()) else None

    def _film(self, plan: PlannedMotion, progress: Progress, folder: Path) -> None:
        from tpbso_casadi.animation.write import animate  # noqa: PLC0415 (loads matplotlib)

        assert self.film is not None
        progress.phase("filming")
        animate(folder / self.film.name, self.title, plan.motion)


RUNS = Path("runs")
LONGEST_NAME = 120  # characters
CHANGES = {  # what an option adds to the name
    "links": "{}-links",
    "objective": "{}",
    "elbow": "elbow-{}",
    "motion": "{}",
    "formulation": "{}",
    "knot_redundancy": "{}-redundancy",
    "population": "population-{}",
    "iterations": "{}-iterations",
    "evaluations": "{}-evaluations",
    "time_limit": "{:g}-s",
    "within": "within-{:g}-s",
    "polish_starts": "polish-{}",
}


def run_folder(options: argparse.Namespace, scenario: Scenario) -> Path:
    """``runs/SCENARIO-SOLVER-SEED``, and what the command line changes; with a number where that is another plan's."""
    parts = [Path(options.scenario).stem]
    parts += [_word(scenario.solver.name), str(scenario.solver.seed)] if scenario.task.has_solver else []
    for option, form in CHANGES.items():
        value = getattr(options, option)
        if value is not None:
            parts.append(form.format(_word(value) if isinstance(value, str) else value))
    if options.retime is not None:
        parts.append("retimed" if options.retime else "not-retimed")
    parts += ["first"] if options.first else []
    if options.polish and options.polish_starts is None:
        parts.append("polish")
    return free_folder("-".join(parts), scenario)


def free_folder(name: str, scenario: Scenario) -> Path:
    """The folder of that name among the runs, with a number where it is another plan's."""
    name = re.sub(r"[^\w.+-]+", "_", name)[:LONGEST_NAME]
    numbered = (RUNS / (name if number == 1 else f"{name}-{number}") for number in count(1))
    stated = scenario.table()
    for folder in numbered:
        if not (folder.exists() or folder.is_symlink()) or stored_content(folder).get("scenario") == stated:
            return folder
    raise AssertionError("numbers have no end")


def _word(name: str) -> str:
    """The class of a plug-in's ``package.module:Class``."""
    return name.rsplit(":", maxsplit=1)[-1]
