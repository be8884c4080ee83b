"""Logs for COCO [1]: a folder a solver, which ``python -m cocopp FOLDER FOLDER ...`` reads.

[1] N. Hansen et al., "COCO: a platform for comparing continuous optimizers in a black-box setting",
    Optimization Methods and Software 36, 2021; the files are those of its logger "bbob", format "bbob-new2".

COCO reads suites that it knows, so the logs name one of boxes, ``sbox-cost``, for which it compares with no solver of
its own. The names of functions that it prints beside their numbers are those of that suite: ``cases.txt`` says which
case has which number.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tpbso_casadi.campaign.logs.trace import Trace, folder_names, grouped, numbered
from tpbso_casadi.storage.files import OutputError, write_text

SUITE = "sbox-cost"
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
            _write_case(folder / names[solver], solver, numbers[case], runs)
    listed = [f"f{number}: {case}" for case, number in numbers.items()]
    listed += [f"{name}: {solver}" for solver, name in names.items()]
    write_text(folder / "cases.txt", lambda file: file.write("\n".join(listed) + "\n"))


def _write_case(folder: Path, solver: str, number: int, runs: Sequence[Trace]) -> None:
    dimension = runs[0].dimension
    stem = f"data_f{number}/bbobexp_f{number}_DIM{dimension}"
    (folder / stem).parent.mkdir(parents=True, exist_ok=True)
    by_value = "".join(_block(run, run.improvements) for run in runs)
    by_evaluations = "".join(_block(run, run.entries) for run in runs)
    write_text(folder / f"{stem}.dat", lambda file: file.write(by_value))
    write_text(folder / f"{stem}.tdat", lambda file: file.write(by_evaluations))
    ends = [f"{run.seed}:{run.entries[-1][0]}|{run.entries[-1][1] - run.optimum:.1e}" for run in runs]
    head = f"suite = '{SUITE}', funcId = {number}, DIM = {dimension}, Precision = {PRECISION:.3e}, "
    head += f"algId = '{solver.replace(chr(39), chr(96))}', logger = 'bbob', data_format = 'bbob-new2'"
    content = f"{head}\n% {runs[0].case}\n{stem}.dat, {', '.join(ends)}\n"
    write_text(folder / f"bbobexp_f{number}.info", lambda file: file.write(content))


def _block(run: Trace, entries: Sequence[tuple[int, float]]) -> str:
    """One run: a header, then evaluations, constraint evaluations, gap, value, lowest value."""
    lines = [f"% {COLUMNS.format(run.optimum)}{REST}"]
    lines += [f"{n} 0 {value - run.optimum:+.9e} {value:+.9e} {value:+.9e}" for n, value in entries]
    return "\n".join(lines) + "\n"
