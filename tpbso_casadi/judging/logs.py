"""Logs for other tools: COCO and IOHprofiler.

COCO reads suites that it knows, so the logs name one of boxes, ``sbox-cost``, for which it compares with no solver of
its own. The names of functions that it prints beside their numbers are those of that suite: ``cases.txt`` says which
case has which number.

[1] N. Hansen et al., "COCO: a platform for comparing continuous optimizers in a black-box setting",
    Optimization Methods and Software 36, 2021; the files are those of its logger "bbob", format "bbob-new2".
[2] J. de Nobel et al., "IOHexperimenter: Benchmarking Platform for Iterative Optimization Heuristics", Evolutionary
    Computation 32, 2024; the files are those of its logger "Analyzer", 0.3.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tpbso_casadi.judging.results import searches
from tpbso_casadi.judging.run import AnyRun
from tpbso_casadi.judging.store import RunStore
from tpbso_casadi.judging.targets import Convergence
from tpbso_casadi.storage import OutputError, check_writable, write_text, writing


def entries_of(run: Convergence) -> list[tuple[int, float]]:
    """Evaluations and the lowest value after them, from the first evaluation to the last; none if there is none.

    The history of a plan has an entry for each iteration, none for each evaluation: a value found within an iteration
    stands at the iteration's end, so the evaluations that a target needs are rounded up to whole iterations. That of a
    benchmark function is exact.
    """
    pairs = zip(run.evaluations.tolist(), run.values.tolist(), strict=True)
    known = [(int(evaluations), value) for evaluations, value in pairs if np.isfinite(value)]
    if not known:
        return []
    first = [(1, run.worst)] * (known[0][0] > 1)
    last = [(run.done, known[-1][1])] * (known[-1][0] < run.done)
    return [*first, *known, *last]


def falls_of(run: Convergence) -> list[tuple[int, float]]:
    """The entries at which the value became lower, and the last one."""
    entries = entries_of(run)
    better = [entry for i, entry in enumerate(entries) if i == 0 or entry[1] < entries[i - 1][1]]
    return [*better, *[entry for entry in entries[-1:] if entry not in better]]


def grouped(runs: Iterable[Convergence]) -> dict[str, dict[str, list[Convergence]]]:
    """Runs by solver, and then by case, in their order; those without any value are left out."""
    groups: dict[str, dict[str, list[Convergence]]] = {}
    for run in runs:
        if entries_of(run):
            groups.setdefault(run.solver, {}).setdefault(run.case, []).append(run)
    return groups


def numbered(runs: Iterable[Convergence]) -> dict[str, int]:
    """Numbers of the cases, from 1 on, in the order of the runs: the same for all solvers."""
    return {case: number for number, case in enumerate(dict.fromkeys(run.case for run in runs), start=1)}


def folder_names(labels: Sequence[str]) -> dict[str, str]:
    """A name for the folder of each label, without brackets and other signs, no two alike."""
    names: dict[str, str] = {}
    for label in labels:
        plain = re.sub(r"[^A-Za-z0-9.=+-]+", "_", label).strip("_.")[:80] or "solver"
        taken = sum(name == plain or name.startswith(f"{plain}~") for name in names.values())
        names[label] = f"{plain}~{taken + 1}" if taken else plain
    return names


def each_case(folder: Path, runs: Sequence[Convergence]) -> Iterator[tuple[Path, str, int, Sequence[Convergence]]]:
    """The cases of each solver: its folder, its label, the number of the case, its runs."""
    numbers, solvers = numbered(runs), grouped(runs)
    names = folder_names(list(solvers))
    for solver, cases in solvers.items():
        for case, of_case in cases.items():
            yield folder / names[solver], solver, numbers[case], of_case


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


def write_coco(folder: Path, runs: Sequence[Convergence]) -> None:
    """Write a folder for each solver [1], and ``cases.txt``, which says what function is which case.

    Raises:
        OutputError: there are more than COCO can show.
        OSError: a file cannot be written.
    """
    numbers, names = numbered(runs), folder_names(list(grouped(runs)))
    check_coco(len(numbers))
    folder.mkdir(parents=True, exist_ok=True)
    for place, solver, number, of_case in each_case(folder, runs):
        _write_coco_case(place, solver, number, of_case)
    listed = [f"f{number}: {case}" for case, number in numbers.items()]
    listed += [f"{name}: {solver}" for solver, name in names.items()]
    write_text(folder / "cases.txt", lambda file: file.write("\n".join(listed) + "\n"))


def _write_coco_case(folder: Path, solver: str, number: int, runs: Sequence[Convergence]) -> None:
    dimension = runs[0].dimension
    stem = f"data_f{number}/bbobexp_f{number}_DIM{dimension}"
    (folder / stem).parent.mkdir(parents=True, exist_ok=True)
    by_value = "".join(_coco_block(run, falls_of(run)) for run in runs)
    by_evaluations = "".join(_coco_block(run, entries_of(run)) for run in runs)
    write_text(folder / f"{stem}.dat", lambda file: file.write(by_value))
    write_text(folder / f"{stem}.tdat", lambda file: file.write(by_evaluations))
    last = [(run, *entries_of(run)[-1]) for run in runs]
    ends = [f"{run.seed}:{done}|{value - run.optimum:.1e}" for run, done, value in last]
    head = f"suite = '{COCO_SUITE}', funcId = {number}, DIM = {dimension}, Precision = {PRECISION:.3e}, "
    head += f"algId = '{solver.replace(chr(39), chr(96))}', logger = 'bbob', data_format = 'bbob-new2'"
    content = f"{head}\n% {runs[0].case}\n{stem}.dat, {', '.join(ends)}\n"
    write_text(folder / f"bbobexp_f{number}.info", lambda file: file.write(content))


def _coco_block(run: Convergence, entries: Sequence[tuple[int, float]]) -> str:
    """One run: a header, then evaluations, constraint evaluations, gap, value, lowest value."""
    lines = [f"% {COLUMNS.format(run.optimum)}{REST}"]
    lines += [f"{n} 0 {value - run.optimum:+.9e} {value:+.9e} {value:+.9e}" for n, value in entries]
    return "\n".join(lines) + "\n"


VERSION = "0.3.18"  # of IOHexperimenter, whose format it is
IOH_SUITE = "tpbso-casadi"
ATTRIBUTES = ("evaluations", "raw_y")


def write_ioh(folder: Path, runs: Sequence[Convergence]) -> None:
    """Write a folder for each solver [2].

    Raises:
        OSError: a file cannot be written.
    """
    for place, solver, number, of_case in each_case(folder, runs):
        _write_ioh_case(place, solver, number, of_case)


def _write_ioh_case(folder: Path, solver: str, number: int, runs: Sequence[Convergence]) -> None:
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


def _ioh_block(run: Convergence) -> str:
    """One run: a header, then evaluations and the lowest value, in full precision."""
    lines = [" ".join(ATTRIBUTES), *(f"{evaluations} {value!r}" for evaluations, value in falls_of(run))]
    return "\n".join(lines) + "\n"


def _described(run: Convergence) -> dict[str, Any]:
    entries = entries_of(run)
    best, (evaluations, _) = min(entries, key=lambda entry: entry[1]), entries[-1]
    return {"instance": run.seed, "evals": evaluations, "best": {"evals": best[0], "y": best[1], "x": []}}


WRITERS: dict[str, Callable[[Path, Sequence[Convergence]], None]] = {"coco": write_coco, "ioh": write_ioh}
CHECKS: dict[str, Callable[[int], None]] = {"coco": check_coco, "ioh": lambda cases: None}


def write_logs(formats: Sequence[str], folder: Path, runs: Sequence[Convergence]) -> None:
    """Write ``folder/coco`` or ``folder/ioh``, or both.

    Raises:
        OutputError: a file cannot be written, or there are more cases than the format has room for.
    """
    with writing(folder):
        for name in formats:
            WRITERS[name](folder / name, runs)


def check_logs(formats: Sequence[str], folder: Path, cases: int) -> None:
    """Make sure before the runs that logs of so many cases can be written.

    Raises:
        OutputError: they cannot.
    """
    for name in formats:
        CHECKS[name](cases)
        check_writable(folder / name)


def logged(runs: Sequence[AnyRun], store: RunStore) -> list[Convergence]:
    """Searches that did not fail, without those that descend a program, whose values are no costs of candidates.

    The value is the cost that the search minimises, penalties included. Where the lowest is not known it is that of all
    these runs; the worst is the highest in any of their histories.
    """
    found = searches([run for run in runs if not run.section.kind().solves_program], store)
    costs: dict[str, list[float]] = {}
    for run, stored in found:
        costs.setdefault(run.case, []).extend(
            [] if stored is None else stored.costs[np.isfinite(stored.costs)].tolist()
        )
    return [
        Convergence(
            case=run.case,
            solver=run.solver,
            seed=run.seed,
            evaluations=np.array(stored.course.evaluations, dtype=np.float64),
            values=stored.costs,
            done=stored.evaluations,
            dimension=run.box.dimension,
            worst=max(costs[run.case], default=np.inf),
            optimum=min(costs[run.case], default=np.inf) if run.measure.known is None else run.measure.known,
        )
        for run, stored in found
        if stored is not None
    ]
