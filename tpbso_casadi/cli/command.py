"""A command as it is run: its parser, its verbosity, its errors of one line, its exit status."""

from __future__ import annotations

import argparse
import logging
import os
import re
import shlex
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from enum import IntEnum
from functools import partial
from typing import Any, NoReturn

from problems.evaluation import InvalidEvaluation
from problems.library import NoCore
from tpbso_casadi.cli.steps import steps_shown
from tpbso_casadi.plain import one_line, version_text, versions
from tpbso_casadi.planning import NoMotion
from tpbso_casadi.scenario import ScenarioError
from tpbso_casadi.storage import InvalidRun, OutputError

LONGEST_PART = 100  # characters without a space, of a path for example


class Exit(IntEnum):
    """The exit statuses of all commands."""

    FEASIBLE = 0
    INFEASIBLE = 1
    BAD_INPUT = 2
    INTERRUPTED = 130


def print_error(message: str) -> None:
    """Print a message as one line on standard error; where that is closed or full, it is lost and nothing happens."""
    if sys.stderr is None:
        return
    encoding = getattr(sys.stderr, "encoding", None) or "ascii"
    line = one_line(f"error: {message}", LONGEST_PART).encode(encoding, "backslashreplace").decode(encoding)
    try:
        print(line, file=sys.stderr, flush=True)
    except (OSError, ValueError):
        with suppress(OSError, ValueError):  # what is left in its buffer must not change the status
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, sys.stderr.fileno())
            os.close(nowhere)


WIDEST = 100  # columns of a help text


class Help(argparse.HelpFormatter):
    """Help texts of at most ``WIDEST`` columns, in which every option that takes a value ends with its default."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=30, width=min(shutil.get_terminal_size().columns, WIDEST) - 2)

    def _get_help_string(self, action: argparse.Action) -> str:
        text = action.help or ""
        nothing_to_say = action.nargs == 0 or action.default in (None, argparse.SUPPRESS) or "[default:" in text
        return text if nothing_to_say else f"{text} [default: %(default)s]"

    def _format_action_invocation(self, action: argparse.Action) -> str:
        """``-o, --out DIR``, the value once."""
        if not action.option_strings or action.nargs == 0:
            return super()._format_action_invocation(action)
        return f"{', '.join(action.option_strings)} {self._format_args(action, action.dest.upper())}"


NEGATIVE = re.compile(r"-(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$", re.IGNORECASE)


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors take one line.

    Args:
        examples: arguments of the command, one string for each example.
        arguments, options: of the parser.
    """

    def __init__(self, *arguments: Any, examples: Sequence[str] = (), **options: Any) -> None:
        super().__init__(*arguments, **{"formatter_class": Help, **options})
        self._negative_number_matcher = NEGATIVE  # also with an exponent, as numbers are printed
        self.examples = tuple(examples)

    def error(self, message: str) -> NoReturn:
        """Print the reason alone and exit with status 2."""
        print_error(message)
        raise SystemExit(Exit.BAD_INPUT)

    def format_help(self) -> str:
        """The help, with the examples at its end."""
        lines = [f"  {self.prog} {example}".rstrip() for example in self.examples]
        return super().format_help() + ("\nexamples:\n" + "\n".join(lines) + "\n") * bool(lines)

    def parse_example(self, example: str) -> argparse.Namespace:
        """The options that an example of the help states."""
        return self.parse_args(shlex.split(example))


class PrintVersion(argparse.Action):
    """Print the version and which core answers, found out only then, and exit."""

    def __init__(self, option_strings: Sequence[str], dest: str, help: str) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, default=argparse.SUPPRESS, help=help)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        """Print the version and end the process."""
        print(version_text())
        parser.exit()


def command_parser(name: str, description: str, examples: Sequence[str]) -> OneLineParser:
    """The parser of a command, with the options that every command has.

    Args:
        name: of the command.
        description: what it does.
        examples: arguments of the command, one string for each example.
    """
    parser = OneLineParser(called(name), description=description, examples=examples)
    parser.add_argument("-V", "--version", action=PrintVersion, help="print the version and which core answers")
    add_verbose(parser, default=0)
    return parser


def add_verbose(parser: argparse.ArgumentParser, default: int | str) -> None:
    """The option of every command, and of the commands below it, where ``argparse.SUPPRESS`` is the default."""
    parser.add_argument(
        "-v",
        "--verbose",
        action="count",
        default=default,
        help="say on standard error what is done and how long it took; -vv says more",
    )


def called(name: str) -> str:
    """How the user has called a command: ``tpbso NAME``, or with ``python -m tpbso_casadi``."""
    return sys.argv[0] if sys.argv[0].endswith((f" {name}", f".{name}")) else f"tpbso {name}"


LOGGERS = ("tpbso_casadi", "problems", "solvers")  # the packages, parents of their modules' loggers
LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)


class LineFormatter(logging.Formatter):
    """One line a record, with the milliseconds since the command began; with the logger's name where all is shown."""

    def __init__(self, named: bool) -> None:
        super().__init__("{relativeCreated:.0f} ms: " + "{name}: " * named + "{message}", style="{")

    def format(self, record: logging.LogRecord) -> str:
        """The record as a line."""
        return one_line(super().format(record), LONGEST_PART)


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
        interrupted: what is said after Ctrl-C; a subcommand's parser may have another default of that name.
    """
    options = parser.parse_args(arguments)
    with logged(options.verbose), steps_shown(getattr(options, "quiet", False)):
        began = time.perf_counter()
        LOG.debug("%s", ", ".join(f"{name} {version}" for name, version in versions().items()))
        told = getattr(options, "interrupted", interrupted)
        status = exit_code_of(partial(work, options), failures, told)
        LOG.info("%s: exit status %d after %.3f s", parser.prog, status, time.perf_counter() - began)
        return status


def exit_code_of(work: Callable[[], int], failures: tuple[type[Exception], ...], interrupted: str) -> int:
    """The exit status of a command; an error is reported in one line."""
    expected: tuple[type[Exception], ...] = (*failures, NoCore)
    try:
        return work()
    except NoMotion as error:
        print_error(str(error))
        return Exit.INFEASIBLE
    except expected as error:
        print_error(str(error))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        print_error(interrupted)
        return Exit.INTERRUPTED
