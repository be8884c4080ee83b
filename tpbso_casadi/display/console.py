"""Tables and words on a console."""

from __future__ import annotations

from typing import IO

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from tpbso_casadi.plain import visible


class OutputConsole(Console):
    """A console on which a closed pipe is an error like any other, and text is printed as it is."""

    def __init__(
        self, *, stderr: bool = False, quiet: bool = False, file: IO[str] | None = None, width: int | None = None
    ) -> None:
        super().__init__(stderr=stderr, quiet=quiet, file=file, width=width, highlight=False, emoji=False)

    def on_broken_pipe(self) -> None:
        """Raise what has been raised, instead of exiting with status 1."""
        raise  # noqa: PLE0704 (Rich calls this while it handles the error)

    def say(self, text: str) -> None:
        """Print a text as one line however long, control characters as their escapes."""
        self.print(visible(text), markup=False, soft_wrap=True)

    def print_table(self, title: str, table: Table) -> None:
        """Print a table below its title."""
        self.say(title)
        self.print(table)


MIN_SAID = 10  # characters, however narrow the terminal is


def table_of(*columns: Column) -> Table:
    """An empty table; only :func:`prose` and :func:`said_number` are wrapped where the terminal is too narrow."""
    return Table(*columns, box=SIMPLE, padding=(0, 1, 0, 0), pad_edge=False, show_edge=False)


def word(heading: str) -> Column:
    """A column of short texts."""
    return Column(Text(heading), no_wrap=True)


def number(heading: str) -> Column:
    """A column of numbers."""
    return Column(Text(heading), no_wrap=True, justify="right")


def said_number(heading: str) -> Column:
    """A column of numbers with words about them, between which it may be wrapped."""
    return Column(Text(heading), justify="right", min_width=MIN_SAID)


def prose(heading: str) -> Column:
    """A column of texts that may be wrapped between words."""
    return Column(Text(heading), overflow="fold")
