"""What all command lines share: one-line errors, exit statuses, types of options."""

from __future__ import annotations

import argparse
import sys
from enum import IntEnum
from typing import NoReturn


class Exit(IntEnum):
    """Exit statuses."""

    FEASIBLE = 0
    INFEASIBLE = 1
    BAD_INPUT = 2
    INTERRUPTED = 130


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors take one line."""

    def error(self, message: str) -> NoReturn:
        """Print the reason alone and exit with status 2."""
        print_error(message)
        raise SystemExit(Exit.BAD_INPUT)


def print_error(message: str) -> None:
    """Print a message as one line on standard error."""
    print(f"error: {' '.join(message.split())}", file=sys.stderr)


def positive_int(text: str) -> int:
    """A whole number above 0, for argparse."""
    number = int(text)
    if number <= 0:
        raise argparse.ArgumentTypeError(f"{number} is not positive")
    return number


def positive_float(text: str) -> float:
    """A finite number above 0, for argparse."""
    number = float(text)
    if not 0.0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a positive number")
    return number


def natural(text: str) -> int:
    """A whole number, 0 or more, for argparse."""
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"{number} is negative")
    return number
