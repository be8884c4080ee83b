"""Runs of solvers on problems of a suite, and the table that anybody's runs are read from.

A row a line, ``solver,problem,run,evaluations,merit``: one for each evaluation at which the lowest merit of a run so
far fell, and one for its last evaluation. Of two objectives the merit of a run is what its front misses of the best
known one: :class:`tpbso_casadi.suite.fronts.Attainment`. A file whose name ends in ``.xz`` is compressed.
"""

from __future__ import annotations

import csv
import lzma
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite
from pathlib import Path
from typing import IO, Any, TypeVar

import numpy as np

from tpbso_casadi.suite.evaluation import Values
from tpbso_casadi.suite.fronts import FEASIBLE, Attainment
from tpbso_casadi.suite.frozen import InvalidSuite
from tpbso_casadi.suite.kernels import FloatArray
from tpbso_casadi.suite.problem import SuiteProblem
from tpbso_casadi.suite.suites import problem_named

MOST_EVALUATIONS = 10**15  # of a run in a table: what numbers of 64 bits are exact for
LEAST_SHARE = 0.99  # of a lower bound that a merit can have: between samples a candidate may be faster than its limits
HEADER = ("solver", "problem", "run", "evaluations", "merit")


@dataclass(eq=False)
class Recording:
    """A run: call it as the solver would call the problem's merit, and it keeps what the merits were.

    Attributes:
        problem: that is searched.
        solver: label of the solver.
        run: number of the run, usually its seed.
        evaluations: numbers of those at which the lowest merit fell, the first is 1.
        merits: the lowest from then on, descending.
        done: all evaluations.

    Raises:
        TypeError: no problem of a suite, no text, or no whole number.
        ValueError: the label is empty, or has characters that cannot be printed: no table could be read again.
    """

    problem: SuiteProblem
    solver: str
    run: int = 1
    evaluations: list[int] = field(default_factory=list)
    merits: list[float] = field(default_factory=list)
    done: int = 0

    def __post_init__(self) -> None:
        for name, kind, what in (("problem", SuiteProblem, "a problem of a suite"), ("solver", str, "a label")):
            if not isinstance(getattr(self, name), kind):
                raise TypeError(f"{name}: {what} is needed")
        if not isinstance(self.run, int) or isinstance(self.run, bool):
            raise TypeError("run: a whole number is needed")
        if not self.solver or not self.solver.isprintable():
            raise ValueError("solver: a name in printable characters is needed")

    def __call__(self, x: FloatArray) -> Any:
        """Merits (m,) of candidates (m, d), or the merit of one vector (d,); of two objectives (m, 2) and (2,).

        Raises:
            ValueError: of another shape, or of two objectives no front is known.
        """
        points = np.asarray(x, dtype=np.float64)
        if points.ndim > 1:
            return self.of_population(points)
        [merit] = self.of_population(points[None])
        return merit if merit.ndim else float(merit)

    def of_population(self, candidates: FloatArray) -> FloatArray:
        """Merits (m,) of candidates (m, d); of two objectives (m, 2).

        Raises:
            ValueError: of another shape, or of two objectives no front is known.
        """
        merits = self.problem.merit(candidates)
        self.add(merits)
        return merits

    def add(self, merits: FloatArray) -> None:
        """Merits (m,) of the next m evaluations; of two objectives (m, 2)."""
        keep_falls(self._judged(merits), self.done, self.evaluations, self.merits)
        self.done += len(merits)

    def to(self, library: str) -> Any:
        """The problem as another library has it (:meth:`SuiteProblem.to`), whose every evaluation is recorded here.

        Raises:
            InvalidSuite: there is no such adapter, the library is missing, or it has no problems of this form.
        """
        of = self.problem
        return Recorded(of.suite, of.function, of.instance, of.threads, recording=self).to(library)

    def _judged(self, merits: FloatArray) -> list[float]:
        """One number for each evaluation."""
        return merits.tolist() if merits.ndim == 1 else [self._attainment.add(pair) for pair in merits.tolist()]

    @cached_property
    def _attainment(self) -> Attainment:
        known = self.problem.best_front
        if known is None:
            raise ValueError(f"{self.problem.name}: has two objectives, and no front is known to judge runs by")
        return Attainment(known, self.problem.feasible_merit)

    @property
    def rows(self) -> list[tuple[str, str, int, int, float]]:
        """The rows of the table of runs."""
        head = self.solver, self.problem.name, self.run
        rows = [(*head, n, merit) for n, merit in zip(self.evaluations, self.merits, strict=True)]
        last = [(*head, self.done, self.merits[-1])] if rows and self.evaluations[-1] < self.done else []
        return rows + last

    @property
    def feasible_merit(self) -> float:
        """The merit up to which the run had a candidate that keeps all constraints."""
        return self.problem.feasible_merit if len(self.problem.objectives) == 1 else FEASIBLE

    @property
    def feasible_from(self) -> float:
        """After how many evaluations there was a candidate that keeps all constraints; inf where there was none."""
        feasible = (n for n, m in zip(self.evaluations, self.merits, strict=True) if m <= self.feasible_merit)
        return next(feasible, inf)


def keep_falls(values: Iterable[float], done: int, evaluations: list[int], lowest: list[float]) -> None:
    """Add to both lists each of the next evaluations whose value is below all before it: its number, and the value.

    Args:
        values: of the next evaluations.
        done: evaluations before them.
        evaluations: numbers of those at which the lowest value fell, the first is 1.
        lowest: values there.
    """
    for number, value in enumerate(values, start=done + 1):
        if value < (lowest[-1] if lowest else inf):
            evaluations.append(number)
            lowest.append(value)


@dataclass(frozen=True, eq=False, repr=False)
class Recorded(SuiteProblem):
    """A problem that keeps the merits of what it evaluates.

    Attributes:
        recording: that they are added to.
    """

    recording: Recording = field(kw_only=True)

    def __deepcopy__(self, memo: object) -> Recorded:
        """The problem itself: libraries copy their problems, and there is one recording."""
        return self

    def values(self, candidates: FloatArray) -> Values:
        """Everything of candidates (m, d)."""
        found = super().values(candidates)
        self.recording.add(found.merit)
        return found


def write_runs(path: str | Path, runs: Iterable[Recording]) -> None:
    """Write the table of some runs.

    Args:
        path: of the file; one that is there is replaced.
        runs: of any solvers and problems.

    Raises:
        InvalidSuite: it cannot be written, or a run has no candidate in the box.
        TypeError: no path, or no runs.
    """
    listed = list(runs) if isinstance(runs, Iterable) else [runs]
    if not all(isinstance(run, Recording) for run in listed):
        raise TypeError("runs: recordings are needed")
    empty = next((run for run in listed if not run.evaluations), None)
    if empty is not None:
        raise InvalidSuite(
            f"{empty.problem.name}: run {empty.run} of {empty.solver} has no candidate in the box, of {empty.done}"
        )
    try:
        with opened(checked_path(path), "wt") as file:
            writer = csv.writer(file)
            writer.writerow(HEADER)
            for run in listed:
                writer.writerows((*row[:-1], repr(row[-1])) for row in run.rows)
    except OSError as error:
        raise InvalidSuite(f"{path}: {error.strerror}") from error


def checked_path(path: str | Path) -> Path:
    """The path of a file.

    Raises:
        TypeError: it is none.
    """
    if not isinstance(path, str | os.PathLike) or "\0" in str(path):
        raise TypeError("path: that of a file is needed")
    return Path(path)


def opened(path: Path, mode: str) -> IO[str]:
    """A text file, compressed where its name says so."""
    opener: Any = lzma.open if path.suffix == ".xz" else open
    file: IO[str] = opener(path, mode, newline="", encoding="utf-8-sig" if "r" in mode else "utf-8")
    return file


def read_runs(path: str | Path) -> list[Recording]:
    """The runs of a table, in order.

    Raises:
        InvalidSuite: the file cannot be read, or a line of it is wrong; the message names file, line and reason.
        TypeError: no path.
    """
    runs: dict[tuple[str, str, int], Recording] = {}
    file_path, line = checked_path(path), 0
    try:
        with opened(file_path, "rt") as file:
            for line, row in enumerate(csv.reader(file), start=1):
                if line == 1 and tuple(row) != HEADER:
                    raise ValueError(f"is not {','.join(HEADER)}, as the first line has to be")
                if line > 1 and row:
                    _add(runs, row)
    except OSError as error:
        raise InvalidSuite(f"{path}: {error.strerror}") from error
    except (lzma.LZMAError, EOFError) as error:
        raise InvalidSuite(f"{path}: is no whole file of xz") from error
    except UnicodeDecodeError as error:
        raise InvalidSuite(f"{path}: is no text in UTF-8, and compressed where its name ends in .xz alone") from error
    except (ValueError, csv.Error) as error:
        raise InvalidSuite(f"{path}: line {line}: {error}") from error
    if not runs:
        raise InvalidSuite(f"{path}: there are no runs in it")
    return list(runs.values())


Number = TypeVar("Number", int, float)


def _parsed(kind: Callable[[str], Number], field: str, text: str) -> Number:
    """The number of a field.

    Raises:
        ValueError: it is none.
    """
    try:
        if "_" in text or not text.isascii():
            raise ValueError  # Python takes 1_0 for ten
        return kind(text)
    except ValueError:
        raise ValueError(f"{field}: {text!r:.40} is no {'whole ' if kind is int else ''}number") from None


def _add(runs: dict[tuple[str, str, int], Recording], row: list[str]) -> None:
    """Add a line to the run that it belongs to."""
    if len(row) != len(HEADER):
        raise ValueError(f"{len(row)} fields where {len(HEADER)} are needed")
    solver, name = row[:2]
    run, evaluations, merit = (
        _parsed(kind, field, text) for kind, field, text in zip((int, int, float), HEADER[2:], row[2:], strict=True)
    )
    problem = problem_named(name)
    if not isfinite(merit) or not 1 <= evaluations <= MOST_EVALUATIONS:
        raise ValueError(f"a finite merit and from 1 to {MOST_EVALUATIONS} evaluations are needed")
    if problem.lower_bound is not None and merit < LEAST_SHARE * problem.lower_bound:
        raise ValueError(f"merit: {merit:g} of {name}, of which no motion has less than {problem.lower_bound:g}")
    into = runs.setdefault((solver, name, run), Recording(problem, solver, run))
    if evaluations <= into.done:
        raise ValueError(f"evaluations: {evaluations} after {into.done} of the same run")
    into.done = evaluations
    if not into.merits or merit < into.merits[-1]:
        into.evaluations.append(evaluations)
        into.merits.append(merit)
    elif merit > into.merits[-1]:
        raise ValueError(
            f"merit: {merit:g} after {into.merits[-1]:g} of the same run, where the lowest so far is needed"
        )
