"""Options that commands share, their parser and their words for completion."""

from __future__ import annotations

import argparse
import shlex
import shutil
import sys
from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

from problems.evaluation import BACKENDS
from tpbso_casadi.cli.common import Exit, natural, path, positive_float, print_error, whole_number
from tpbso_casadi.figures.palette import DEFAULT, FORMATS
from tpbso_casadi.scenario import MOST_EVALUATIONS, shown

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


Group: TypeAlias = argparse._ActionsContainer

SCENARIO = "SCENARIO"  # metavar of a TOML file or a built-in name
SCENARIOS = "the scenario's"  # default of what overrides a scenario
MOST_THREADS = 256


def problem_group(parser: argparse.ArgumentParser) -> Group:
    """The group of options that say what is planned."""
    return parser.add_argument_group("problem", "What is planned.")


def search_group(parser: argparse.ArgumentParser) -> Group:
    """The group of options that say how it is searched."""
    return parser.add_argument_group("search", "How it is searched.")


def machine_group(parser: argparse.ArgumentParser) -> Group:
    """The group of options that change how long a command takes, not what comes out."""
    return parser.add_argument_group("machine", "These change how long it takes, not the result.")


def output_group(parser: argparse.ArgumentParser) -> Group:
    """The group of options that say what is written and printed."""
    return parser.add_argument_group("output")


def defaulting(text: str, default: object) -> str:
    """The help of an option, with its default."""
    return f"{text} [default: {default}]"


def listed(names: Iterable[str]) -> str:
    """Names in a help text."""
    return ", ".join(names)


def is_silent(options: argparse.Namespace) -> bool:
    """Whether no progress is shown: it would stand between the lines of ``-v``."""
    return bool(options.quiet or options.verbose)


def add_outside_files(group: Group) -> None:
    """The option of every command that reads scenario files."""
    group.add_argument(
        "--allow-outside-files", action="store_true", help="a scenario may name files outside its own folder"
    )


def add_seed(group: Group, default: int | None = None) -> None:
    """The seed; the scenario's unless there is a default."""
    group.add_argument(
        "-s",
        "--seed",
        type=natural,
        metavar="N",
        default=default,
        help=defaulting(
            "random seed, of the first run where there are many; same seed, same result",
            SCENARIOS if default is None else default,
        ),
    )


def add_evaluations(group: Group, default: object = SCENARIOS) -> None:
    """The budget of evaluations."""
    group.add_argument(
        "--evaluations",
        type=whole_number(1, MOST_EVALUATIONS),
        metavar="N",
        help=defaulting("stop each search after N evaluations", default),
    )


def add_population(group: Group, kind: Callable[[str], int]) -> None:
    """The size of the swarm."""
    group.add_argument(
        "--population",
        type=kind,
        metavar="M",
        help=defaulting("members of the swarm", f"{SCENARIOS}, else the solver's own"),
    )


def add_iterations(group: Group, kind: Callable[[str], int]) -> None:
    """The budget of iterations."""
    group.add_argument(
        "--iterations", type=kind, metavar="N", help=defaulting("stop each search after N iterations", SCENARIOS)
    )


def add_time_limit(group: Group) -> None:
    """The budget of time."""
    group.add_argument(
        "--time-limit",
        type=positive_float,
        metavar="S",
        help=defaulting("stop each search after S seconds; results then depend on the machine", SCENARIOS),
    )


def add_within(group: Group, default: object) -> None:
    """The time for the best plan."""
    group.add_argument(
        "--within",
        type=positive_float,
        metavar="S",
        help=defaulting("the best plan in S seconds; results then depend on the machine", default),
    )


def add_backend(group: Group) -> None:
    """How populations are evaluated."""
    group.add_argument(
        "--backend",
        choices=BACKENDS,
        metavar="KIND",
        help=defaulting(f"evaluates populations: {listed(BACKENDS)}", "TPBSO_CASADI_BACKEND, else auto"),
    )


def add_threads(group: Group) -> None:
    """Threads of the backend."""
    group.add_argument(
        "--threads",
        type=whole_number(1, MOST_THREADS),
        default=1,
        metavar="N",
        help="threads that evaluate populations of thousands",
    )


def add_out(group: Group, shown: object, default: Path | None = None) -> None:
    """The folder of the output.

    Args:
        group: to add it to.
        shown: the default as the help says it.
        default: in the options where the user names none.
    """
    group.add_argument(
        "-o",
        "--out",
        type=path,
        default=default,
        metavar="DIR",
        help=defaulting("folder to write to: a run there is replaced as a whole, a campaign is resumed", shown),
    )


def add_json(group: Group) -> None:
    """The result for machines."""
    group.add_argument("-j", "--json", action="store_true", help="print the result as JSON instead of tables")


def add_no_plots(group: Group) -> None:
    """Whether to draw."""
    group.add_argument(
        "--no-plots",
        action="store_true",
        help="draw no figures, whatever --figures says, and write no player of a simulation",
    )


def add_quiet(group: Group) -> None:
    """Whether to say anything but errors."""
    group.add_argument("-q", "--quiet", action="store_true", help="no progress, no table")


def add_figures_option(group: argparse._ActionsContainer) -> None:
    """``--figures png,pdf,svg``; without it PNG."""
    group.add_argument(
        "--figures",
        type=formats,
        default=DEFAULT,
        metavar="FORMATS",
        help=defaulting(f"of figures: {listed(FORMATS)}, or several with commas between them", ",".join(DEFAULT)),
    )


def formats(text: str) -> tuple[str, ...]:
    """Formats with commas between them, for argparse; each once."""
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    unknown = [name for name in names if name not in FORMATS]
    if unknown:
        raise argparse.ArgumentTypeError(f"{shown(unknown[0])} is not a format of figures: say {', '.join(FORMATS)}")
    return names


def figure_formats(options: argparse.Namespace) -> tuple[str, ...]:
    """The formats of the options; none with ``--no-plots``."""
    return () if options.no_plots else options.figures
