"""What a log says of one run: the lowest value after so many evaluations."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray


@dataclass(frozen=True, kw_only=True)
class Trace:
    """One run of a solver on a case.

    The history of a plan has an entry for each iteration, none for each evaluation: a value found within an iteration
    stands at the iteration's end, so the evaluations that a target needs are rounded up to whole iterations. That of a
    benchmark function is exact.

    Attributes:
        case: its name.
        solver: its label.
        seed: of the run.
        dimension: number of variables that were searched.
        evaluations: (n,), ascending.
        values: the lowest value after so many, (n,), inf where there is none.
        done: evaluations of the whole run.
        worst: stands at the first evaluation, which readers need, where its value is not known.
        optimum: the lowest value that is known: of a function its minimum, of a scenario the campaign's best.
    """

    case: str
    solver: str
    seed: int
    dimension: int
    evaluations: FloatArray
    values: FloatArray
    done: int
    worst: float
    optimum: float

    @property
    def entries(self) -> list[tuple[int, float]]:
        """Evaluations and the lowest value after them, from the first evaluation to the last; none if there is none."""
        pairs = zip(self.evaluations.tolist(), self.values.tolist(), strict=True)
        known = [(int(evaluations), value) for evaluations, value in pairs if np.isfinite(value)]
        if not known:
            return []
        first = [(1, self.worst)] * (known[0][0] > 1)
        last = [(self.done, known[-1][1])] * (known[-1][0] < self.done)
        return [*first, *known, *last]

    @property
    def improvements(self) -> list[tuple[int, float]]:
        """The entries at which it became lower, and the last one."""
        entries = self.entries
        better = [entry for i, entry in enumerate(entries) if i == 0 or entry[1] < entries[i - 1][1]]
        return [*better, *[entry for entry in entries[-1:] if entry not in better]]


def grouped(traces: Iterable[Trace]) -> dict[str, dict[str, list[Trace]]]:
    """By solver, and then by case, in the order of the runs; runs without any value are left out."""
    groups: dict[str, dict[str, list[Trace]]] = {}
    for trace in traces:
        if trace.entries:
            groups.setdefault(trace.solver, {}).setdefault(trace.case, []).append(trace)
    return groups


def numbered(traces: Iterable[Trace]) -> dict[str, int]:
    """Numbers of the cases, from 1 on, in the order of the runs: the same for all solvers."""
    return {case: number for number, case in enumerate(dict.fromkeys(trace.case for trace in traces), start=1)}


def folder_names(labels: Sequence[str]) -> dict[str, str]:
    """A name for the folder of each label, without brackets and other signs, no two alike."""
    names: dict[str, str] = {}
    for label in labels:
        plain = re.sub(r"[^A-Za-z0-9.=+-]+", "_", label).strip("_.")[:80] or "solver"
        taken = sum(name == plain or name.startswith(f"{plain}~") for name in names.values())
        names[label] = f"{plain}~{taken + 1}" if taken else plain
    return names
