"""Parsers of command lines: one line of error, a default for every option, examples at the end of the help."""

from __future__ import annotations

import argparse
import shlex
import shutil
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any, NoReturn

from tpbso_casadi.cli.common import Exit, print_error

WIDEST = 100  # columns of a help text


class Help(argparse.HelpFormatter):
    """At most ``WIDEST`` columns wide; ends the help of every option that takes a value with its default."""

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


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors take one line.

    Args:
        examples: arguments of the command, one string for each example.
        arguments, options: of the parser.
    """

    def __init__(self, *arguments: Any, examples: Sequence[str] = (), **options: Any) -> None:
        super().__init__(*arguments, **{"formatter_class": Help, **options})
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
        """What an example of the help means."""
        return self.parse_args(shlex.split(example))


def command_parser(name: str, description: str, examples: Sequence[str]) -> OneLineParser:
    """The parser of a command, with the options that every command has.

    Args:
        name: of the command.
        description: what it does.
        examples: arguments of the command, one string for each example.
    """
    parser = OneLineParser(called(name), description=description, examples=examples)
    parser.add_argument(
        "-V", "--version", action="version", version=f"tpbso-casadi {version('tpbso-casadi')}", help="print the version"
    )
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
    """How the user has called a command: ``tpbso NAME``, or ``python -m tpbso_casadi.NAME``."""
    return sys.argv[0] if sys.argv[0].endswith((f" {name}", f".{name}")) else f"tpbso {name}"
