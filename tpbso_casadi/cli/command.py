"""A command run: verbosity, exit status, the folder of its run."""

from __future__ import annotations

import argparse
import logging
import re
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import count
from pathlib import Path

from problems.evaluation import InvalidEvaluation
from tpbso_casadi.cli.common import Exit, one_line, print_error
from tpbso_casadi.cli.options import OneLineParser
from tpbso_casadi.plain import versions
from tpbso_casadi.scenario import Scenario, ScenarioError
from tpbso_casadi.storage import InvalidRun, OutputError, stored_content

LOGGERS = ("tpbso_casadi", "problems", "solvers")  # the packages, parents of their modules' loggers
LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)


class LineFormatter(logging.Formatter):
    """One line a record, with the milliseconds since the command began; with the logger's name where all is shown."""

    def __init__(self, named: bool) -> None:
        super().__init__("{relativeCreated:.0f} ms: " + "{name}: " * named + "{message}", style="{")

    def format(self, record: logging.LogRecord) -> str:
        """The record as a line."""
        return one_line(super().format(record))


@contextmanager
def logged(verbosity: int) -> Iterator[None]:
    """Show on standard error what the library logs meanwhile.

    Args:
        verbosity: 0 for nothing, 1 for what is done and how long it took, 2 for everything.
    """
    if not verbosity:
        yield
        return
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(LineFormatter(named=verbosity > 1))
    with ExitStack() as listening:
        for name in LOGGERS:
            logger = logging.getLogger(name)
            listening.callback(logger.setLevel, logger.level)
            logger.setLevel(LEVELS[min(verbosity, len(LEVELS) - 1)])
            listening.callback(logger.removeHandler, handler)
            logger.addHandler(handler)
        yield


LOG = logging.getLogger(__name__)
FAILURES: tuple[type[Exception], ...] = (ScenarioError, OutputError, InvalidRun, InvalidEvaluation)


def run_command(
    parser: OneLineParser,
    work: Callable[[argparse.Namespace], int],
    arguments: Sequence[str] | None,
    *,
    failures: tuple[type[Exception], ...] = FAILURES,
    interrupted: str = "interrupted",
) -> int:
    """Parse the arguments and do the work that they ask for; returns the exit status.

    Args:
        parser: of the command.
        work: the command: takes its options, returns the exit status.
        arguments: after the name of the command; None for those of this process.
        failures: what the user may have caused: the message is printed, the status is 2.
        interrupted: what is said after Ctrl-C.
    """
    options = parser.parse_args(arguments)
    with logged(options.verbose):
        began = time.perf_counter()
        LOG.debug("%s", ", ".join(f"{name} {version}" for name, version in versions().items()))
        status = exit_code_of(lambda: work(options), failures, interrupted)
        LOG.info("%s: exit status %d after %.3f s", parser.prog, status, time.perf_counter() - began)
        return status


def exit_code_of(work: Callable[[], int], failures: tuple[type[Exception], ...], interrupted: str) -> int:
    """The exit status of a command; an error is reported in one line."""
    try:
        return work()
    except failures as error:
        print_error(str(error))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        print_error(interrupted)
        return Exit.INTERRUPTED


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
    parts += [_word(scenario.solver.name), str(scenario.solver.seed)] if scenario.task.is_searched else []
    for option, form in CHANGES.items():
        value = getattr(options, option)
        if value is not None:
            parts.append(form.format(_word(value) if isinstance(value, str) else value))
    if options.retime is not None:
        parts.append("retimed" if options.retime else "not-retimed")
    if options.polish and options.polish_starts is None:
        parts.append("polish")
    return free_folder("-".join(parts), scenario)


def free_folder(name: str, scenario: Scenario) -> Path:
    """The folder of that name among the runs, with a number where it is another plan's."""
    name = re.sub(r"[^\w.+-]+", "_", name)[:LONGEST_NAME]
    numbered = (RUNS / (name if number == 1 else f"{name}-{number}") for number in count(1))
    return next(folder for folder in numbered if _is_free(folder, scenario))


def _word(name: str) -> str:
    """The class of a plug-in's ``package.module:Class``."""
    return name.rsplit(":", maxsplit=1)[-1]


def _is_free(folder: Path, scenario: Scenario) -> bool:
    """Whether there is nothing, or the same plan."""
    if not folder.exists() and not folder.is_symlink():
        return True
    return stored_content(folder).get("scenario") == scenario.model_dump(mode="json")
