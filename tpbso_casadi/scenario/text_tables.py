"""Tables of text: a line of names and lines of numbers, whatever separates them.

Commas, tabs and blanks separate columns, or the semicolons of spreadsheets; beside semicolons and tabs a number may
have a decimal comma.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass

from problems.base import number_of, shown_value
from tpbso_casadi.scenario.recorded_rows import LARGEST_STATE, BadRow, Row

SEPARATORS = (";", "\t", ",")  # the first of them that is in the line of names; else blanks
WITH_DECIMAL_COMMA = (";", "\t")


@dataclass(frozen=True)
class TextTable:
    """The cells of a table.

    Attributes:
        names: of the columns.
        separator: of the columns; empty for blanks.
        line: of the names, from 1 on.
        lines: the others that hold anything, with their numbers.
    """

    names: tuple[str, ...]
    separator: str
    line: int
    lines: list[tuple[int, str]]

    @classmethod
    def read(cls, text: str, needed: str) -> TextTable:
        """The table in a text; empty lines are skipped.

        Args:
            text: of the file.
            needed: what its first line has to be, for messages.

        Raises:
            BadRow: it is empty.
        """
        lines = [(number, line) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]
        if not lines:
            raise BadRow(f"is empty; {needed}")
        number, header = lines[0]
        separator = next((each for each in SEPARATORS if each in header), "")
        names = (name.strip().strip('"') for name in _cells(header.lstrip("# "), separator))
        return cls(tuple(names), separator, number, lines[1:])

    def rows(self, times: Sequence[int], columns: Sequence[int], most: int) -> tuple[list[Row], int]:
        """The numbers of some columns, and how many lines are left out that have none in them.

        Args:
            times: the column of the time, if there is one, whose numbers come first and may be of any size.
            columns: the others.
            most: rows that are read.

        Raises:
            BadRow: a cell has no number, a line has another number of columns than there are names, or there are more.
        """
        rows: list[Row] = []
        for number, line in self.lines:
            row = self._row(number, line, times, columns)
            rows += [row] if row else []
            if len(rows) > most:
                raise BadRow(f"line {number}: more than {most} rows")
        return rows, len(self.lines) - len(rows)

    def _row(self, number: int, line: str, times: Sequence[int], columns: Sequence[int]) -> Row:
        cells = _cells(line, self.separator)
        if len(cells) != len(self.names):
            raise BadRow(f"line {number}: {len(cells)} numbers where the header has {len(self.names)} names")
        if not any(cells[column].strip() for column in columns):
            return []
        row = [self._number(number, cells[column], column) for column in (*times, *columns)]
        if not (all(map(math.isfinite, row)) and all(abs(value) <= LARGEST_STATE for value in row[len(times) :])):
            raise BadRow(f"line {number}: a number is not finite, or larger than {LARGEST_STATE:g}")
        return row

    def _number(self, line: int, cell: str, column: int) -> float:
        try:
            return number_of(cell.replace(",", ".") if self.separator in WITH_DECIMAL_COMMA else cell)
        except ValueError as error:
            raise BadRow(f"line {line}: a number is needed in column {shown_value(self.names[column])}") from error


def _cells(line: str, separator: str) -> list[str]:
    if not separator:
        return line.split()
    return next(csv.reader([line], delimiter=separator)) if '"' in line else line.split(separator)
