"""Logs for other tools: COCO and IOHprofiler.

[1] N. Hansen et al., "COCO: a platform for comparing continuous optimizers in a black-box setting",
    Optimization Methods and Software 36, 2021; the files are those of its logger "bbob", format "bbob-new2".

COCO reads suites that it knows, so the logs name one of boxes, ``sbox-cost``, for which it compares with no solver of
its own. The names of functions that it prints beside their numbers are those of that suite: ``cases.txt`` says which
case has which number.

[1] J. de Nobel et al., "IOHexperimenter: Benchmarking Platform for Iterative Optimization Heuristics", Evolutionary
    Computation 32, 2024; the files are those of its logger "Analyzer", 0.3.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.judging.results import StoredSearch
from tpbso_casadi.judging.run import AnyRun
from tpbso_casadi.judging.store import Store
from tpbso_casadi.storage import OutputError, check_writable, write_text, writing


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


COCO_SUITE = "sbox-cost"
MOST_CASES = 24  # functions that COCO's suite has
PRECISION = 1e-8  # COCO's own final target, which it takes absolutely
COLUMNS = "f evaluations | g evaluations | best noise-free fitness - Fopt ({:.12e}) + sum g_i+"
REST = " | measured fitness | best measured fitness or single-digit g-values"


def check_coco(cases: int) -> None:
    """Make sure before the runs that COCO can show them.

    Raises:
        OutputError: it cannot.
    """
    if cases > MOST_CASES:
        raise OutputError(f"--format coco: {cases} cases where COCO's suite has {MOST_CASES} functions; compare fewer")


def write_coco(folder: Path, traces: Sequence[Trace]) -> None:
    """Write a folder for each solver, and ``cases.txt``, which says what function is which case.

    Raises:
        OutputError: there are more than COCO can show.
        OSError: a file cannot be written.
    """
    numbers, solvers = numbered(traces), grouped(traces)
    check_coco(len(numbers))
    folder.mkdir(parents=True, exist_ok=True)
    names = folder_names(list(solvers))
    for solver, cases in solvers.items():
        for case, runs in cases.items():
            _write_coco_case(folder / names[solver], solver, numbers[case], runs)
    listed = [f"f{number}: {case}" for case, number in numbers.items()]
    listed += [f"{name}: {solver}" for solver, name in names.items()]
    write_text(folder / "cases.txt", lambda file: file.write("\n".join(listed) + "\n"))


def _write_coco_case(folder: Path, solver: str, number: int, runs: Sequence[Trace]) -> None:
    dimension = runs[0].dimension
    stem = f"data_f{number}/bbobexp_f{number}_DIM{dimension}"
    (folder / stem).parent.mkdir(parents=True, exist_ok=True)
    by_value = "".join(_coco_block(run, run.improvements) for run in runs)
    by_evaluations = "".join(_coco_block(run, run.entries) for run in runs)
    write_text(folder / f"{stem}.dat", lambda file: file.write(by_value))
    write_text(folder / f"{stem}.tdat", lambda file: file.write(by_evaluations))
    ends = [f"{run.seed}:{run.entries[-1][0]}|{run.entries[-1][1] - run.optimum:.1e}" for run in runs]
    head = f"suite = '{COCO_SUITE}', funcId = {number}, DIM = {dimension}, Precision = {PRECISION:.3e}, "
    head += f"algId = '{solver.replace(chr(39), chr(96))}', logger = 'bbob', data_format = 'bbob-new2'"
    content = f"{head}\n% {runs[0].case}\n{stem}.dat, {', '.join(ends)}\n"
    write_text(folder / f"bbobexp_f{number}.info", lambda file: file.write(content))


def _coco_block(run: Trace, entries: Sequence[tuple[int, float]]) -> str:
    """One run: a header, then evaluations, constraint evaluations, gap, value, lowest value."""
    lines = [f"% {COLUMNS.format(run.optimum)}{REST}"]
    lines += [f"{n} 0 {value - run.optimum:+.9e} {value:+.9e} {value:+.9e}" for n, value in entries]
    return "\n".join(lines) + "\n"


VERSION = "0.3.18"  # of IOHexperimenter, whose format it is
IOH_SUITE = "tpbso-casadi"
ATTRIBUTES = ("evaluations", "raw_y")


def write_ioh(folder: Path, traces: Sequence[Trace]) -> None:
    """Write a folder for each solver.

    Raises:
        OSError: a file cannot be written.
    """
    numbers, solvers = numbered(traces), grouped(traces)
    names = folder_names(list(solvers))
    for solver, cases in solvers.items():
        for case, runs in cases.items():
            _write_ioh_case(folder / names[solver], solver, numbers[case], runs)


def _write_ioh_case(folder: Path, solver: str, number: int, runs: Sequence[Trace]) -> None:
    case, dimension = re.sub(r"[^A-Za-z0-9-]+", "-", runs[0].case), runs[0].dimension
    data = f"data_f{number}_{case}/IOHprofiler_f{number}_DIM{dimension}.dat"
    (folder / data).parent.mkdir(parents=True, exist_ok=True)
    blocks = [_ioh_block(run) for run in runs]
    write_text(folder / data, lambda file: file.write("".join(blocks)))
    described: dict[str, Any] = {
        "version": VERSION,
        "suite": IOH_SUITE,
        "function_id": number,
        "function_name": case,
        "maximization": False,
        "algorithm": {"name": solver, "info": "tpbso-casadi"},
        "attributes": list(ATTRIBUTES),
        "scenarios": [{"dimension": dimension, "path": data, "runs": [_described(run) for run in runs]}],
    }
    content = json.dumps(described, indent="\t") + "\n"
    write_text(folder / f"IOHprofiler_f{number}_{case}.json", lambda file: file.write(content))


def _ioh_block(run: Trace) -> str:
    """One run: a header, then evaluations and the lowest value, in full precision."""
    lines = [" ".join(ATTRIBUTES), *(f"{evaluations} {value!r}" for evaluations, value in run.improvements)]
    return "\n".join(lines) + "\n"


def _described(run: Trace) -> dict[str, Any]:
    best = min(run.entries, key=lambda entry: entry[1])
    evaluations = run.entries[-1][0]
    return {"instance": run.seed, "evals": evaluations, "best": {"evals": best[0], "y": best[1], "x": []}}


WRITERS: dict[str, Callable[[Path, Sequence[Trace]], None]] = {"coco": write_coco, "ioh": write_ioh}
CHECKS: dict[str, Callable[[int], None]] = {"coco": check_coco, "ioh": lambda cases: None}


def write_logs(formats: Sequence[str], folder: Path, traces: Sequence[Trace]) -> None:
    """Write ``folder/coco`` or ``folder/ioh``, or both.

    Raises:
        OutputError: a file cannot be written, or there are more cases than the format has room for.
    """
    with writing(folder):
        for name in formats:
            WRITERS[name](folder / name, traces)


def check_logs(formats: Sequence[str], folder: Path, cases: int) -> None:
    """Make sure before the runs that logs of so many cases can be written.

    Raises:
        OutputError: they cannot.
    """
    for name in formats:
        CHECKS[name](cases)
        check_writable(folder / name)


def traces_of(runs: Sequence[AnyRun], store: Store) -> list[Trace]:
    """The searches that did not fail, without those that descend a program, whose values are no costs of candidates.

    The value is the cost that the search minimises, penalties included. Where the lowest is not known it is that of all
    these runs; the worst is the highest in any of their histories.
    """
    searches = [run for run in runs if not run.section.kind().solves_program]
    stored = [(run, StoredSearch.from_text(text)) for run, text in store.texts(searches) if text is not None]
    costs: dict[str, list[float]] = {}
    for run, search in stored:
        costs.setdefault(run.case, []).extend(cost for cost in search.course.cost if cost is not None)
    dimensions = {run.case: run.box.dimension for run in searches}
    return [_trace(run, search, dimensions[run.case], costs[run.case]) for run, search in stored]


def _trace(run: AnyRun, search: StoredSearch, dimension: int, costs: Sequence[float]) -> Trace:
    return Trace(
        case=run.case,
        solver=run.solver,
        seed=run.seed,
        dimension=dimension,
        evaluations=np.array(search.course.evaluations, dtype=np.float64),
        values=np.array([np.inf if cost is None else cost for cost in search.course.cost]),
        done=search.evaluations,
        worst=max(costs, default=np.inf),
        optimum=min(costs, default=np.inf) if run.measure.known is None else run.measure.known,
    )
