"""Errors of scenario files and command lines in the words of a call: its arguments instead of keys and options."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from problems import InvalidProblem
from tpbso_casadi.campaign.executors import ExecutorError
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import OutputError

KEY = re.compile(r"^(?:task|model|solver|arm|robot)\.(?:settings\.)?(\w+)")
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
        near = difflib.get_close_matches(unknown, known, n=1)
        raise TypeError(f"there is no keyword {unknown!r}" + (f"; did you mean {near[0]!r}?" if near else ""))


@contextmanager
def in_words_of_python() -> Iterator[None]:
    """Turn errors into those of a call.

    Raises:
        ScenarioError: of an argument.
        OutputError: of a file.
        ExecutorError: of workers.
    """
    try:
        yield
    except InvalidProblem as error:
        raise ScenarioError(as_argument(str(error))) from error
    except (ScenarioError, OutputError, ExecutorError) as error:
        raise type(error)(as_argument(str(error))) from error
