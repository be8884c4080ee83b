"""Arguments of a call, checked: what is wrong is said by the argument's name."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from problems import InvalidProblem
from problems.base import FloatArray, nearest_word, shown_value, too_much
from solvers import GRADIENT_SOLVERS, IPOPT, SOLVERS, AnySolver, Solver
from tpbso_casadi.plain import settings_of
from tpbso_casadi.scenario import (
    TASK_CATALOGUE,
    ModelSection,
    NamedSolver,
    PointsTask,
    PointToPointTask,
    ScenarioError,
    Section,
    SolverSection,
    TaskSection,
    named_solver,
    path_of,
    plain,
)
from tpbso_casadi.storage import OutputError

KEY = re.compile(r"^(?:task|model|solver|arm|robot)\.(?:settings\.)?(?!(?:toml|json|csv|npz|ya?ml):)(\w+)")
ENTRY = re.compile(r"^(\w+)((?:\.\d+)+)\.?")  # of a list, or of a list in it
NUMBER = re.compile(r"\.(\d+)")
OPTION = re.compile(r"^--")
ARGUMENTS = {
    "points": "path",
    "joints": "path",
    "polish_starts": "polish",
    "name": "solver",
}  # by the keys that they become
ADVICE = {  # of what is missing
    "start": "say where the robot is at t = 0, start=...",
    "goal": "say where it is to be at the end, goal=...; or path=... to trace",
    "accuracy": "say how far the tool may leave the path, accuracy=... in m",
    "max_speed": "say how fast the joints may turn, max_speed=... in rad/s",
    "max_acceleration": "say how much they may accelerate, max_acceleration=... in rad/s^2",
    "tolerance": "say how far a blend may leave the lines, tolerance=... in rad",
}
BRACKETED = r"[\1]"
MISSING = ": missing key"


def as_argument(message: str) -> str:
    """A message that begins with a key of a scenario, or an option, as one that begins with an argument."""
    message = OPTION.sub("", KEY.sub(lambda key: ARGUMENTS.get(key[1], key[1]), message))
    message = ENTRY.sub(lambda entry: f"{entry[1]}{NUMBER.sub(BRACKETED, entry[2])} ", message).replace("] :", "]:")
    name, missing, _ = message.partition(MISSING)
    return f"{name}: missing; {ADVICE[name]}" if missing and name in ADVICE else message


def check_keywords(keys: Iterable[str], known: Iterable[str]) -> None:
    """Every keyword is known.

    Raises:
        TypeError: one is not, with the nearest that is.
    """
    known = sorted(known)
    unknown = next((key for key in keys if key not in known), None)
    if unknown is not None:
        near = nearest_word(unknown, known)
        raise TypeError(f"there is no keyword {unknown!r}" + (f"; did you mean {near!r}?" if near else ""))


@contextmanager
def in_words_of_python() -> Iterator[None]:
    """Turn errors into those of a call.

    Raises:
        ScenarioError: of an argument, or of workers.
        OutputError: of a file.
    """
    try:
        yield
    except InvalidProblem as error:
        raise ScenarioError(as_argument(str(error))) from error
    except RecursionError as error:
        raise ScenarioError(f"an argument: {too_much(error)}") from error
    except (ScenarioError, OutputError) as error:
        raise type(error)(as_argument(str(error))) from error


def file_path(name: str, value: Any) -> Path:
    """The path of a file or folder.

    Raises:
        TypeError: it is none.
    """
    if not isinstance(value, str | Path):
        raise TypeError(f"{name}: a path is needed, text or a pathlib.Path, not {shown_value(value)}")
    return Path(value)


def positive(name: str, value: Any, unit: str) -> float:
    """A finite number above 0.

    Raises:
        ValueError: it is none.
    """
    number = plain(value)
    if isinstance(number, bool) or not isinstance(number, int | float) or not (isfinite(number) and number > 0):
        raise ValueError(f"{name}: a number above 0 is needed, in {unit}, not {shown_value(number)}")
    return float(number)


def whole_or_not(name: str, value: Any) -> int:
    """True, False, or a whole number, as a whole number.

    Raises:
        ScenarioError: it is none.
    """
    number = plain(value)
    if not isinstance(number, int):
        raise ScenarioError(f"{name}: True, False or a whole number is needed, not {shown_value(number)}")
    return int(number)


def whole(name: str, value: Any) -> int:
    """A value as a whole number.

    Raises:
        ScenarioError: it is none.
    """
    number = plain(value)
    if isinstance(number, bool) or not isinstance(number, int):
        raise ScenarioError(f"{name}: a whole number is needed, not {shown_value(number)}")
    return number


def several(name: str, value: Any, what: str) -> list[Any]:
    """A list of whatever can be listed.

    Raises:
        ScenarioError: it cannot be.
    """
    if not isinstance(value, Iterable) or isinstance(value, bytes):
        raise ScenarioError(f"{name}: {what} are needed, not {shown_value(value)}")
    return list(value)


def function(name: str, value: Any) -> None:
    """Refuse a value that cannot be called.

    Raises:
        TypeError: it cannot.
    """
    if not callable(value):
        raise TypeError(f"{name}: a function is needed, not {shown_value(value)}")


def times_array(value: Any) -> FloatArray:
    """A value as times (n,), s.

    Raises:
        ValueError: there are none, or they are no list of numbers.
    """
    needed = "times: numbers (n,) are needed, in s"
    try:
        times = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{needed}, not {shown_value(plain(value))}") from error
    if times.ndim != 1 or not times.size:
        raise ValueError(f"{needed}, not an array of shape {times.shape}")
    return times


AnySolverChoice: TypeAlias = str | AnySolver | type[AnySolver]
TABLES: dict[str, tuple[type[Section], ...]] = {
    "task": (PointToPointTask, PointsTask),
    "model": (ModelSection,),
    "solver": (SolverSection,),
}


def solver_table(solver: AnySolverChoice | NamedSolver | None, before: SolverSection | None = None) -> dict[str, Any]:
    """The keys of [solver] that name a solver and its settings, in place of those before."""
    if solver is None:
        return {}
    if isinstance(solver, str | NamedSolver):
        named = named_solver(solver) if isinstance(solver, str) else solver
        return named.table("", {}) if before is None else named.table(before.name, before.settings)
    kind = solver if isinstance(solver, type) else type(solver)
    if not issubclass(kind, Solver | IPOPT):
        raise ScenarioError(
            f"solver: {shown_value(solver)} is none; say a name, a class, or a solver with its settings"
        )
    registered: dict[str, type[AnySolver]] = {**SOLVERS, **GRADIENT_SOLVERS}
    name = next((name for name, known in registered.items() if known is kind), None)
    settings = {} if isinstance(solver, type) else settings_of(solver)
    kept = {key: value for key, value in settings.items() if value is not None}
    return {"name": name or path_of(kind), "settings": kept}


def sorted_into_tables(keys: Mapping[str, Any], task: TaskSection | None = None) -> dict[str, dict[str, Any]]:
    """Keywords by the table that has such a key.

    Args:
        keys: the keywords.
        task: of the scenario that is given, which may be of another kind; ``kind`` may name one of any other class.

    Raises:
        TypeError: none has, with the nearest that one has.
    """
    known = {name: {key for section in sections for key in section.schema()} for name, sections in TABLES.items()}
    sections = [type(task)] if task is not None else []
    if isinstance(keys.get("kind"), str):
        sections.append(TASK_CATALOGUE.find(keys["kind"]))
    known["task"] |= {"path", *(key for section in sections for key in section.schema())}
    check_keywords(keys, set().union(*known.values(), {"frames", "obstacles", "carried", "may_touch"}))
    found: dict[str, dict[str, Any]] = {name: {} for name in TABLES}
    for key, value in keys.items():
        table = next(name for name in TABLES if key in known[name])
        found[table][key] = plain(value) if table == "solver" else value
    return found
