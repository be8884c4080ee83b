"""Options that commands share, and types of their values."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias, Union, get_args, get_origin

from problems.base import InvalidTable, Table, number_of, reader, shown_value
from problems.evaluation import BACKENDS
from tpbso_casadi.figures.palette import DEFAULT, FORMATS
from tpbso_casadi.scenario import LARGEST, LARGEST_SEED, LONGEST_WORD, SMALLEST, RowFileTask, SolverSection

MOST = 1_000_000_000  # of anything that is counted


def whole_number(least: int, most: int) -> Callable[[str], int]:
    """A type of options for argparse: a whole number in a range."""

    def parse(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"a whole number is needed, not {shown_value(text)}") from None
        if number > most:
            raise argparse.ArgumentTypeError(f"{shown_value(number)} is more than {most}")
        if number < least:
            below = {0: "negative", 1: "not positive"}.get(least, f"less than {least}")
            raise argparse.ArgumentTypeError(f"{shown_value(number)} is {below}")
        return number

    return parse


positive_int = whole_number(1, MOST)
natural = whole_number(0, LARGEST_SEED)


def positive_number(most: float, or_zero: bool = False) -> Callable[[str], float]:
    """A type of options for argparse: a number above 0, or 0 where that will do, of a size to be computed with."""
    what = "0 or a positive number" if or_zero else "a positive number"

    def parse(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"a number is needed, not {shown_value(text)}") from None
        if not (SMALLEST <= number <= most or (or_zero and number == 0.0)):
            raise argparse.ArgumentTypeError(f"{text} is not {what} from {SMALLEST:g} to {most:g}")
        return number

    return parse


def finite(text: str) -> float:
    """A number of a size to be computed with, for argparse."""
    try:
        number = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a number is needed, not {shown_value(text)}") from None
    if not abs(number) <= LARGEST:
        raise argparse.ArgumentTypeError(f"{text} is not a number from {-LARGEST:g} to {LARGEST:g}")
    return number


positive_float = positive_number(LARGEST)
not_negative = positive_number(LARGEST, or_zero=True)


def printable_name(text: str) -> str:
    """A name, for argparse."""
    if len(text) > LONGEST_WORD or not text.isprintable():
        raise argparse.ArgumentTypeError(f"a name of at most {LONGEST_WORD} printable characters is needed")
    return text


def path(text: str) -> Path:
    """The path of a file or folder, for argparse."""
    if not text or "\0" in text:
        raise argparse.ArgumentTypeError(f"a path is needed, not {shown_value(text)}")
    return Path(text)


Group: TypeAlias = argparse._ActionsContainer

SCENARIO = "SCENARIO"  # metavar of a TOML file or a built-in name
ROBOT_AND_SURROUNDINGS = "a robot that is built in, a URDF, or a TOML file with a robot and its [[obstacles]]"
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


class Wanted(NamedTuple):
    """The demand of an option on its value, by the type of its key.

    Attributes:
        kind: makes the value of a text; None where the option has no value.
        choices: the words that there are; None where any will do.
    """

    kind: Callable[[str], Any] | None
    choices: Sequence[str] | None = None


def wanted(hint: Any) -> Wanted:
    """The demand of an option of a key of a type."""
    parts = [part for part in get_args(hint) if part is not NoneType]
    if get_origin(hint) is Literal:
        return Wanted(str, [*map(str, parts)])
    if get_origin(hint) in (Union, UnionType):
        return wanted(parts[0])
    kind = parts[0] if get_origin(hint) is Annotated else hint
    if kind is bool:
        return Wanted(None)

    def read(text: str) -> Any:
        try:
            return reader(hint)(text if kind is str else kind(text))
        except InvalidTable as error:
            raise argparse.ArgumentTypeError(error.reason) from None
        except ValueError:
            words = "a whole number" if kind is int else "a number"
            raise argparse.ArgumentTypeError(f"{words} is needed, not {shown_value(text)}") from None

    return Wanted(read)


def add_key(
    group: Group,
    section: type[Table],
    key: str,
    text: str,
    *,
    flags: Sequence[str] = (),
    default: object = SCENARIOS,
    value: Any = None,
    choices: Iterable[str] | None = None,
    metavar: str = "N",
) -> None:
    """The option of a key of a scenario's table, with the type and the bounds that the table gives it.

    Args:
        group: to add it to.
        section: the table.
        key: of it; the option has its name.
        text: its help.
        flags: short names of the option.
        default: as the help says it.
        value: in the options where the user states none.
        choices: the words that there are, where the type does not say it.
        metavar: for the value, in the help.
    """
    asked = wanted(section.schema()[key].hint)
    named, described = (*flags, f"--{key.replace('_', '-')}"), defaulting(text, default)
    if asked.kind is None:
        group.add_argument(*named, action=argparse.BooleanOptionalAction, default=value, help=described)
        return
    known = asked.choices if choices is None else [*choices]
    group.add_argument(*named, type=asked.kind, choices=known, metavar=metavar, default=value, help=described)


SEARCH_KEYS: dict[str, dict[str, Any]] = {
    "population": {"text": "members of the swarm", "default": f"{SCENARIOS}, else the solver's own", "metavar": "M"},
    "iterations": {"text": "stop each search after N iterations"},
    "evaluations": {"text": "stop each search after N evaluations"},
    "time_limit": {"text": "stop each search after S seconds; results then depend on the machine", "metavar": "S"},
    "within": {"text": "the best plan in S seconds; results then depend on the machine", "metavar": "S"},
    "first": {"text": "the first certified plan, in space, in least time"},
    "seed": {
        "text": "random seed, of the first run where there are many; same seed, same result",
        "flags": ("-s",),
    },
    "polish_starts": {"text": "refine N good candidates that lie apart, keep the best"},
}


def add_search_keys(group: Group, *keys: str, **defaults: object) -> None:
    """The options of keys of [solver].

    Args:
        group: to add them to.
        keys: of the table.
        defaults: of some of them, as the help says them.
    """
    for key in keys:
        stated = SEARCH_KEYS[key] | ({"default": defaults[key]} if key in defaults else {})
        value = defaults[key] if isinstance(defaults.get(key), int) else None
        add_key(group, SolverSection, key, **stated, value=value)


def add_certificate(group: Group) -> None:
    """The option of every command that has a motion to prove."""
    group.add_argument(
        "--certificate",
        type=path,
        metavar="FILE",
        help=defaulting("a certificate that others can check, JSON, or zipped as .gz", "none"),
    )


def add_outside_files(group: Group) -> None:
    """The option of every command that reads scenario files."""
    group.add_argument(
        "--allow-outside-files", action="store_true", help="a scenario may name files outside its own folder"
    )


def add_robot(group: Group, default: object) -> None:
    """The robot of a motion or a path that is given, and what is around it."""
    group.add_argument(
        "--robot",
        type=path,
        metavar="FILE",
        help=defaulting(
            "TOML file with an [arm] or a [robot] table, whose [[obstacles]], [[constraints]] and margin in [model] "
            "are judged too; or a robot that is built in, or a URDF that says all",
            default,
        ),
    )


def add_payload(group: Group) -> None:
    """Add the option for the mass that the tool of the robot carries."""
    group.add_argument(
        "--payload",
        type=not_negative,
        metavar="KG",
        help=defaulting("what the tool carries, a mass at its own origin; 0 for none", "the robot's"),
    )


def add_row_interpolation(group: Group, kinds: Iterable[str], default: object) -> None:
    """How rows of joints are joined."""
    known = [*kinds]
    group.add_argument(
        "--interpolation",
        choices=known,
        metavar="KIND",
        help=defaulting("how rows are joined", f"of {listed(known)}: {default}"),
    )


def add_row_file(group: Group, *, clock: bool = True, messages: bool = True, start: bool = True) -> None:
    """How a file of rows of joints is read.

    Args:
        group: to add the options to.
        clock: whether its times are used.
        messages: whether it may be a bag of ROS with several trajectories.
        start: whether its rows begin somewhere.
    """
    group.add_argument(
        "--columns",
        metavar="MAP",
        help=defaulting(
            "what columns of a table hold, as timestamp=t,actual_q_*=q* (qd, qdd; m of measured joints)",
            "as they name themselves; recordings of a UR and exports of PlotJuggler are known",
        ),
    )
    add_key(
        group,
        RowFileTask,
        "prefix",
        "read the joints whose names begin with P, without it",
        default="none",
        metavar="P",
    )
    add_key(
        group,
        RowFileTask,
        "unit",
        "of rows of joints that turn: rad or deg",
        default="rad, or the robot file's where a path is timed",
        metavar="U",
    )
    if clock:
        add_key(group, RowFileTask, "time_unit", "of the times: s, ms, us or ns", default="s", metavar="U")
    if start:
        group.add_argument(
            "--start",
            type=numbers,
            metavar="Q1,Q2,...",
            help=defaulting(
                "where the joints stand before the first row, in the unit of the rows; --start=-1,... with a minus",
                "in the first row",
            ),
        )
    group.add_argument("--topic", metavar="NAME", help=defaulting("of a bag: the one that is read", "the only one"))
    if messages:
        group.add_argument(
            "--message",
            type=positive_int,
            metavar="N",
            help=defaulting("which trajectory of a bag, from 1 on", "the only one"),
        )


def numbers(text: str) -> list[float]:
    """Numbers with commas between them, for argparse."""
    try:
        return [number_of(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"numbers with commas between them are needed, not {shown_value(text)}"
        ) from None


ROW_KEYS = ("columns", "prefix", "unit", "time_unit", "start", "topic", "message")


def row_keys(options: argparse.Namespace) -> dict[str, Any]:
    """The keys of [task] that options of a file of rows state; None of those that are left out."""
    return {key: getattr(options, key, None) for key in ROW_KEYS}


def add_solvers(group: Group, default: str) -> None:
    """Add the option for several solvers."""
    group.add_argument(
        "--solvers",
        default=default,
        metavar="A,B,...",
        help="NAME or NAME(setting=value,...), on scenarios either with +polish or +polishN",
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


def add_workers(group: argparse._ActionsContainer) -> None:
    """The option for the number of processes."""
    group.add_argument("--workers", type=positive_int, metavar="N", help=defaulting("processes", "one a processor"))


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
        help=defaulting(
            "folder to write to: a run or a map there is replaced as a whole, a campaign is resumed", shown
        ),
    )


def add_tip(group: Group) -> None:
    """The arm that is asked about, where a robot has several."""
    group.add_argument(
        "--tip", type=printable_name, metavar="NAME", help=defaulting("whose tool, of several arms", "the robot's own")
    )


def add_descents(group: Group, default: int) -> None:
    """Starts of inverse kinematics."""
    group.add_argument(
        "--descents",
        type=positive_int,
        default=default,
        metavar="N",
        help=defaulting("to each pose, from as many starts; more find more postures of it", default),
    )


def add_json(group: Group) -> None:
    """The result for machines."""
    group.add_argument("-j", "--json", action="store_true", help="print the result as JSON instead of tables")


def add_no_plots(group: Group) -> None:
    """Add the option for no figures."""
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
        raise argparse.ArgumentTypeError(
            f"{shown_value(unknown[0])} is not a format of figures: say {', '.join(FORMATS)}"
        )
    return names


def figure_formats(options: argparse.Namespace) -> tuple[str, ...]:
    """The formats of the options; none with ``--no-plots``."""
    return () if options.no_plots else options.figures
