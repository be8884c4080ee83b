"""The search of a layout: any solver, restarts, worker processes, and a record of every evaluation to go on from."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from problems.base import FloatArray
from solvers import Archive, Budget, Result, SearchBox, Status, minimize
from solvers.standalone import solver_of
from tpbso_casadi.judging.executors import processes
from tpbso_casadi.layouts.evaluation import Evaluation, LayoutEvaluator
from tpbso_casadi.layouts.template import LayoutTemplate
from tpbso_casadi.scenario import ScenarioError

CHUNKS = 4  # of a population for each worker, as layouts that cannot be take less time
NICHE = 0.1  # share of each range in which two layouts are alike


@dataclass(frozen=True, eq=False)
class Record:
    """An evaluated layout.

    Attributes:
        mounting: its number among the template's.
        values: of the free numbers, (d,), m and rad.
        evaluation: what was found.
    """

    mounting: int
    values: tuple[float, ...]
    evaluation: Evaluation

    @property
    def key(self) -> tuple[int, tuple[float, ...]]:
        """What it is known by."""
        return self.mounting, self.values

    def line(self) -> str:
        """One line of JSON."""
        found = self.evaluation
        seconds = found.seconds if np.isfinite(found.seconds) else None
        content = {"mounting": self.mounting, "values": self.values, "seconds": seconds, "lack": found.lack}
        return json.dumps(content | ({"why": found.why} if found.why else {}))

    @classmethod
    def of(cls, line: str, variables: int) -> Record:
        """The record of a line of JSON.

        Args:
            line: the line.
            variables: how many free numbers there are.

        Raises:
            ValueError: it is none, or of another cell.
        """
        content: Any = json.loads(line)
        try:
            seconds, lack, why = content["seconds"], float(content["lack"]), str(content.get("why", ""))
            values = tuple(float(value) for value in content["values"])
            found = Evaluation(np.inf if seconds is None else float(seconds), lack, why)
            record = cls(int(content["mounting"]), values, found)
        except (KeyError, TypeError) as error:
            raise ValueError(f"no evaluation of a layout: {line[:60]!r}") from error
        if len(values) != variables:
            raise ValueError(f"{len(values)} free numbers, not {variables}: of another cell")
        return record


@dataclass(eq=False)
class EvaluatedLayouts:
    """Layouts that are evaluated once each, by worker processes, and written down.

    Args:
        evaluator: of the cell.
        workers: processes.
        log: where each evaluation is written, one line each; None for nowhere.

    Attributes:
        records: in the order in which they were evaluated.
    """

    evaluator: LayoutEvaluator
    workers: int = 1
    log: TextIO | None = None
    records: list[Record] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._known: dict[tuple[int, tuple[float, ...]], Evaluation] = {}
        self._stack = ExitStack()
        self._executor: Executor | None = None

    def __enter__(self) -> EvaluatedLayouts:
        if self.workers > 1:
            self._executor = self._stack.enter_context(processes(self.workers).start())
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def remember(self, records: Sequence[Record]) -> None:
        """Take evaluations of an earlier search, which are not made again."""
        self._known |= {record.key: record.evaluation for record in records}

    def costs(self, x: FloatArray, mounting: int) -> FloatArray:
        """The costs of searched points (m, d), (m,)."""
        template = self.evaluator.template
        keys = [(mounting, tuple(template.values(point).tolist())) for point in x]
        new = {key: point for key, point in zip(keys, x, strict=True) if key not in self._known}
        for key, found in zip(new, self._evaluated(list(new.values()), mounting), strict=True):
            self._known[key] = found
            record = Record(*key, found)
            self.records.append(record)
            if self.log is not None:
                self.log.write(record.line() + "\n")
                self.log.flush()
        return np.array([self._known[key].cost for key in keys])

    def _evaluated(self, points: Sequence[FloatArray], mounting: int) -> list[Evaluation]:
        if self._executor is None or len(points) < 2:
            return [self.evaluator(point, mounting) for point in points]
        size = max(1, len(points) // (CHUNKS * self.workers))
        numbers = [mounting] * len(points)
        return list(self._executor.map(self.evaluator, points, numbers, chunksize=size))


@dataclass(frozen=True, eq=False)
class LayoutSearch:
    """What a search has found.

    Attributes:
        template: of the cell.
        results: of each solver's run, with the number of its mounting.
        archive: layouts that lie apart, the best first: cost, number of the mounting, searched point.
        seconds: that all of it took.
    """

    template: LayoutTemplate
    results: list[tuple[int, Result]]
    archive: list[tuple[float, int, FloatArray]]
    seconds: float


def searched(
    layouts: EvaluatedLayouts, deadline: float = np.inf, callback: Callable[[Status], object] | None = None
) -> LayoutSearch:
    """Search the layouts of a cell as its [layout] says.

    Args:
        layouts: evaluates them.
        deadline: until when, on the clock of :func:`time.perf_counter`, s.
        callback: gets the status of each of the searches.

    Raises:
        ScenarioError: an unknown solver.
    """
    template = layouts.evaluator.template
    section, box, began = template.section, template.box, time.perf_counter()
    try:
        solver = solver_of(section.solver)
    except (ValueError, TypeError) as error:
        raise ScenarioError(f"layout.{error}") from error
    runs = [(mounting, turn) for turn in range(section.restarts) for mounting in range(len(template.mountings))]
    ends = [section.evaluations * number // len(runs) for number in range(len(runs) + 1)]
    results, archive = list[tuple[int, Result]](), list[tuple[float, int, FloatArray]]()
    for (mounting, turn), evaluations in zip(runs, np.diff(ends).tolist(), strict=True):
        left = deadline - time.perf_counter()
        if not evaluations or left <= 0.0:
            continue
        kept = Archive(box)
        budget = Budget(evaluations, seconds=left if np.isfinite(left) else None)
        cost = partial(layouts.costs, mounting=mounting)
        result = minimize(cost, box, solver, budget, section.seed + turn, callback, kept)
        results.append((mounting, result))
        archive += [(float(cost), mounting, x) for cost, x in zip(kept.cost, kept.x, strict=True)]
    return LayoutSearch(template, results, _apart(archive, box), time.perf_counter() - began)


def _apart(archive: list[tuple[float, int, FloatArray]], box: SearchBox) -> list[tuple[float, int, FloatArray]]:
    """The best of layouts that lie apart: of two alike the better, the best first."""
    kept: list[tuple[float, int, FloatArray]] = []
    for cost, mounting, x in sorted(archive, key=lambda entry: entry[0]):
        same = (one for _, other, one in kept if other == mounting)
        if all((np.abs(x - one) >= NICHE * box.span).any() for one in same):
            kept.append((cost, mounting, x))
    return kept


def read_records(path: Path, variables: int) -> list[Record]:
    """The evaluations that an earlier search has written.

    Args:
        path: of the file; none are in one that is not there.
        variables: how many free numbers there are.

    Raises:
        ScenarioError: a line is none.
    """
    if not path.exists():
        return []
    found = []
    lines = path.read_text().splitlines()
    for number, line in enumerate(lines, start=1):
        try:
            found.append(Record.of(line, variables))
        except ValueError as error:
            if number == len(lines):  # the search was cut off while it was written
                break
            raise ScenarioError(f"{path}: line {number}: {error}") from error
    return found
