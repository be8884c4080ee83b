"""``tpbso completion``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Protocol

import shtab

from problems import OBJECTIVES
from problems.robots import BUILT_IN
from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, run_command
from tpbso_casadi.cli.options import SCENARIO, listed
from tpbso_casadi.cli.tpbso import COMMANDS
from tpbso_casadi.scenario import SOLVER_CATALOGUE, TITLES

FUNCTIONS = {
    "bash": '{name}() {{\n  compgen -W "{words}" -- "$1"\n{files}}}',
    "zsh": "{name}() {{\n  _alternative '{label}s:{label}:({words})'{files}\n}}",
}
OR_FILES = {"bash": '  compgen -f -- "$1"\n', "zsh": " 'files:file:_files'"}


class Completion(Protocol):
    """The way in which a value is completed."""

    @property
    def patterns(self) -> Mapping[str, str]:
        """How each shell is told."""


@dataclass(frozen=True)
class Entries:
    """Completion by files or folders.

    Attributes:
        patterns: how each shell is told.
    """

    patterns: Mapping[str, str]


FILES = Entries({shell: str(pattern) for shell, pattern in shtab.FILE.items()})
FOLDERS = Entries({shell: str(pattern) for shell, pattern in shtab.DIRECTORY.items()})


@dataclass(frozen=True)
class Words:
    """Completion by a list of names.

    Attributes:
        label: what they are names of.
        words: the names.
        or_files: whether a file will do as well.
    """

    label: str
    words: tuple[str, ...]
    or_files: bool = False

    @property
    def patterns(self) -> Mapping[str, str]:
        """How each shell is told; a shell that has functions by the name of one."""
        listed = f"`echo {' '.join(self.words)} *`" if self.or_files else f"({' '.join(self.words)})"
        return {**dict.fromkeys(FUNCTIONS, self._name), "tcsh": listed}

    def function(self, shell: str) -> str:
        """The function by that name; empty for a shell that has none."""
        files = OR_FILES.get(shell, "") * self.or_files
        form = FUNCTIONS.get(shell, "")
        return form.format(name=self._name, label=self.label, words=" ".join(self.words), files=files)

    @property
    def _name(self) -> str:
        return f"_tpbso_{self.label}" + "_or_file" * self.or_files


PROGRAM = "tpbso"
SHELLS = ("bash", "zsh", "tcsh")
SCENARIO_WORDS = Words("scenario", tuple(TITLES), or_files=True)
SOLVER_WORDS = Words("solver", tuple(SOLVER_CATALOGUE.registry))
ROBOT_WORDS = Words("robot", tuple(BUILT_IN), or_files=True)
OBJECTIVE_WORDS = Words("objective", tuple(OBJECTIVES))
WORDS = (SCENARIO_WORDS, SOLVER_WORDS, ROBOT_WORDS, OBJECTIVE_WORDS)
BY_METAVAR: dict[str, Completion] = {
    "FILE": FILES,
    "DIR": FOLDERS,
    "PATH.csv|RUN_FOLDER": FILES,
    "NAME|FILE.urdf": ROBOT_WORDS,
    f"RUN_FOLDER|{SCENARIO}": SCENARIO_WORDS,
    SCENARIO: SCENARIO_WORDS,
}
BY_OPTION: dict[str, Completion] = {
    "solver": SOLVER_WORDS,
    "solvers": SOLVER_WORDS,
    "objective": OBJECTIVE_WORDS,
    "objectives": OBJECTIVE_WORDS,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(parser(), completion, arguments)


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "completion",
        "Print a script with which a shell completes tpbso: commands, options, scenarios, solvers and files. "
        "To have it in every bash, append its output to ~/.bashrc, or write it to "
        "~/.local/share/bash-completion/completions/tpbso; in zsh, to a file _tpbso in a folder of $fpath; in tcsh, "
        "append it to ~/.tcshrc.",
        examples=SHELLS,
    )
    command_line.add_argument("shell", choices=SHELLS, metavar="SHELL", help=listed(SHELLS))
    return command_line


def completion(options: argparse.Namespace) -> int:
    """Print the script for the shell of the options; returns the exit status."""
    functions = "\n".join(filter(None, (words.function(options.shell) for words in WORDS)))
    script = shtab.complete(whole_parser(), options.shell, preamble=functions)
    sys.stdout.write(script)
    return Exit.FEASIBLE


def whole_parser() -> argparse.ArgumentParser:
    """All commands below one name, each value with what completes it."""
    root = OneLineParser(PROGRAM, description="Plan the motions of robot arms.")
    root.add_argument("-V", "--version", action="store_true", help="print the version")
    commands = root.add_subparsers(dest="command", metavar="COMMAND", parser_class=OneLineParser)
    for name, purpose in COMMANDS.items():
        own = import_module(f"tpbso_casadi.cli.commands.{name}").parser()
        commands.add_parser(name, help=purpose, description=purpose, parents=[own], add_help=False)
        for action in actions_of(own):
            completed = BY_OPTION.get(action.dest) or BY_METAVAR.get(str(action.metavar))
            if completed is not None:
                action.complete = completed.patterns  # type: ignore[attr-defined]
    return root


def actions_of(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The options and arguments of a parser and of the commands below it."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from actions_of(inner)
