"""What commands have in common: exit statuses, one-line errors, words that are checked."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from enum import IntEnum
from pathlib import Path

from tpbso_casadi.plain import visible
from tpbso_casadi.scenario import LARGEST, LARGEST_SEED, LONGEST_WORD, SMALLEST, shown

LONGEST_ERROR = 300  # characters of a line
LONGEST_PART = 100  # characters without a space, of a path for example
MOST = 1_000_000_000  # of anything that is counted


class Exit(IntEnum):
    """Exit statuses."""

    FEASIBLE = 0
    INFEASIBLE = 1
    BAD_INPUT = 2
    INTERRUPTED = 130


def print_error(message: str) -> None:
    """Print a message as one line on standard error; where that is closed or full, it is lost and nothing happens."""
    if sys.stderr is None:
        return
    encoding = getattr(sys.stderr, "encoding", None) or "ascii"
    line = one_line(f"error: {message}").encode(encoding, "backslashreplace").decode(encoding)
    try:
        print(line, file=sys.stderr, flush=True)
    except (OSError, ValueError):
        _discard_standard_error()


def one_line(message: str) -> str:
    """A message in one line of at most ``LONGEST_ERROR`` characters.

    White space becomes a space, another control character its escape; what is long is shortened, a path or a value in
    its middle.
    """
    parts = (_shortened(visible(part)) for part in message.split())
    line = " ".join(parts)
    return line if len(line) <= LONGEST_ERROR else line[: LONGEST_ERROR - 3] + "..."


def _shortened(part: str) -> str:
    half = LONGEST_PART // 2
    return part if len(part) <= LONGEST_PART else f"{part[: half - 3]}...{part[-half:]}"


def _discard_standard_error() -> None:
    """Let what is still in its buffer go nowhere, so that the exit status does not tell of it."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stderr.fileno())
        os.close(nowhere)


def whole_number(least: int, most: int) -> Callable[[str], int]:
    """A type of options for argparse: a whole number in a range."""

    def parse(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"a whole number is needed, not {shown(text)}") from None
        if not least <= number <= most:
            raise argparse.ArgumentTypeError(f"{shown(number)} is {_outside(number, least, most)}")
        return number

    return parse


def _outside(number: int, least: int, most: int) -> str:
    if number > most:
        return f"more than {most}"
    named = {0: "negative", 1: "not positive"}
    return named.get(least, f"less than {least}")


positive_int = whole_number(1, MOST)
natural = whole_number(0, LARGEST_SEED)


def positive_number(most: float, or_zero: bool = False) -> Callable[[str], float]:
    """A type of options for argparse: a number above 0, or 0 where that will do, of a size to be computed with."""
    what = "0 or a positive number" if or_zero else "a positive number"

    def parse(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"a number is needed, not {shown(text)}") from None
        if not (SMALLEST <= number <= most or (or_zero and number == 0.0)):
            raise argparse.ArgumentTypeError(f"{text} is not {what} from {SMALLEST:g} to {most:g}")
        return number

    return parse


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
        raise argparse.ArgumentTypeError(f"a path is needed, not {shown(text)}")
    return Path(text)
