"""From the arguments of a command to its exit status; what goes wrong on the way is one line."""

from __future__ import annotations

import argparse
import logging
import time
from collections.abc import Callable, Sequence

from problems.evaluation import InvalidEvaluation
from tpbso_casadi.cli.common import Exit, print_error
from tpbso_casadi.cli.parser import OneLineParser
from tpbso_casadi.cli.verbosity import logged
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import OutputError
from tpbso_casadi.storage.stored_run import InvalidRun
from tpbso_casadi.storage.versions import versions

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
