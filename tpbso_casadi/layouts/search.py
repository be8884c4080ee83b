"""The search of a layout: any solver, restarts, worker processes, and a record of every evaluation to go on from."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from problems.base import FloatArray
from solvers import Budget, Result, Status, StopReason, minimize, solver_of
from tpbso_casadi.judging.executors import processes
from tpbso_casadi.layouts.evaluation import Evaluation, LayoutEvaluator
from tpbso_casadi.layouts.template import LayoutTemplate
from tpbso_casadi.scenario import LayoutSection, ScenarioError

CHUNKS = 4  # of a population for each worker, as layouts that cannot be take less time
MOST_APART = 400  # layouts that are kept, more than are ever planned
NICHE = 0.1  # share of each range in which two layouts are alike


@dataclass(frozen=True, eq=False)
class Record:
    """The numbers of a layout with their evaluation.

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
        """The mounting and the values, by which an evaluation is found again."""
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
        records: those of an earlier search, and others in the order in which they were evaluated.
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
        self.records += records

    def costs(self, x: FloatArray, mounting: int) -> FloatArray:
        """The costs of searched points (m, d), (m,)."""
        return np.array([each.cost for each in self.evaluations(x, mounting)])

    def seconds(self, x: FloatArray, mounting: int) -> FloatArray:
        """The least cycles of searched points (m, d), (m,), s; infinite where there is none."""
        return np.array([each.seconds for each in self.evaluations(x, mounting)])

    def evaluations(self, x: FloatArray, mounting: int) -> list[Evaluation]:
        """The evaluations of searched points (m, d)."""
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
        return [self._known[key] for key in keys]

    def _evaluated(self, points: Sequence[FloatArray], mounting: int) -> list[Evaluation]:
        if self._executor is None or len(points) < 2:
            return [self.evaluator(point, mounting) for point in points]
        size = max(1, len(points) // (CHUNKS * self.workers))
        numbers = [mounting] * len(points)
        return list(self._executor.map(self.evaluator, points, numbers, chunksize=size))


@dataclass(frozen=True, eq=False)
class LayoutSearch:
    """The results of all searches of a cell, and the best layouts that lie apart.

    Attributes:
        template: of the cell.
        results: of each solver's run, with the number of its mounting.
        archive: of all layouts that can be, those that lie apart, the best first.
        seconds: that all of it took.
    """

    template: LayoutTemplate
    results: list[tuple[int, Result]]
    archive: list[Record]
    seconds: float


def searched(layouts: EvaluatedLayouts, callback: Callable[[Status], object] | None = None) -> LayoutSearch:
    """Search the layouts of a cell as its [layout] says.

    Args:
        layouts: evaluates them.
        callback: gets the status of each of the searches.

    Raises:
        ScenarioError: an unknown solver.
        KeyboardInterrupt: Ctrl-C; what was evaluated is written down.
    """
    template = layouts.evaluator.template
    section, began = template.section, time.perf_counter()
    try:
        solver = solver_of(section.solver)
    except (ValueError, TypeError) as error:
        raise ScenarioError(f"layout.{error}") from error
    runs = [(mounting, turn) for turn in range(section.restarts) for mounting in range(len(template.mountings))]
    results: list[tuple[int, Result]] = []
    budget = Budget(section.evaluations, seconds=section.time_limit)
    for mounting, turn in runs:
        cost = partial(layouts.costs, mounting=mounting)
        result = minimize(cost, template.box, solver, budget, section.seed + turn, callback)
        if result.stop_reason is StopReason.INTERRUPTED:
            raise KeyboardInterrupt
        results.append((mounting, result))
    return LayoutSearch(template, results, _apart(layouts.records, template), time.perf_counter() - began)


def _apart(records: Sequence[Record], template: LayoutTemplate) -> list[Record]:
    """The layouts that can be and lie apart: of two alike the better, the best first, as many as may be planned."""
    kept: list[Record] = []
    spans = NICHE * np.array([variable.high - variable.low for variable in template.variables])
    feasible = [record for record in records if np.isfinite(record.evaluation.seconds)]
    for record in sorted(feasible, key=lambda each: (each.evaluation.seconds, each.key)):
        same = [np.subtract(record.values, one.values) for one in kept if one.mounting == record.mounting]
        if all((np.abs(away) >= spans).any() for away in same):
            kept.append(record)
        if len(kept) >= MOST_APART:
            break
    return kept


def read_records(path: Path, template: LayoutTemplate) -> list[Record]:
    """The evaluations of a cell that an earlier search has written.

    Args:
        path: of the file; none are in one that is not there.
        template: of the cell.

    Raises:
        ScenarioError: a line is none, or they are of another cell.
    """
    if not path.exists():
        return []
    found, (first, *lines) = [], path.read_text(encoding="utf-8").splitlines() or [""]
    if first != header_of(template):
        raise ScenarioError(f"{path}: of another cell, or of another spare distance: name another folder")
    for number, line in enumerate(lines, start=2):
        try:
            found.append(Record.of(line, len(template.variables)))
        except ValueError as error:
            if number == len(lines) + 1:  # the search was cut off while it was written
                break
            raise ScenarioError(f"{path}: line {number}: {error}") from error
    return found


def header_of(template: LayoutTemplate) -> str:
    """The first line of a file of evaluations: of which cell they are, in whatever way it is searched."""
    section = template.section
    kept = LayoutSection(free=section.free, apart=section.apart, spare=section.spare)
    stated = template.stated.replaced(layout=kept)
    text = json.dumps(stated.table(), sort_keys=True, default=list)
    return json.dumps({"cell": sha256(text.encode()).hexdigest(), "free": [each.name for each in template.variables]})
