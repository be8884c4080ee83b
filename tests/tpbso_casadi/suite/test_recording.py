"""Runs and their table."""

from __future__ import annotations

import lzma
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.evaluation import needs_compiler

import tpbso_casadi as tp
from tpbso_casadi.suite import HEADER, InvalidSuite, Recording, SuiteProblem, read_runs, write_runs
from tpbso_casadi.suite.fronts import FEASIBLE, Attainment, BestFront

NAME = "arm-motions-1/spline-2@1"
PROBLEM = tp.suite()["spline-2@1"]


def written(path: Path, *lines: str, header: str = ",".join(HEADER)) -> Path:
    path.write_text("\n".join([header, *lines]) + "\n")
    return path


@needs_compiler
def test_a_recording_keeps_where_the_merit_fell() -> None:
    recording = Recording(PROBLEM, "mine", 7)
    candidates = np.random.default_rng(1).uniform(*PROBLEM.bounds, (50, PROBLEM.dimension))
    merits = recording(candidates[:30])
    assert np.array_equal(merits, PROBLEM.merit(candidates[:30]))
    alone = [recording(x) for x in candidates[30:]]
    assert alone == PROBLEM.merit(candidates[30:]).tolist()
    every = PROBLEM.merit(candidates)
    falls = [0, *(k for k in range(1, 50) if every[k] < every[:k].min())]
    assert recording.evaluations == [k + 1 for k in falls] and recording.merits == every[falls].tolist()
    assert recording.done == 50
    assert recording.rows[0] == ("mine", NAME, 7, 1, every[0])
    assert recording.rows[-1][3] == 50


@needs_compiler
@pytest.mark.parametrize("library", ["scipy", "pymoo", "pygmo"])
def test_a_recording_in_another_library(library: str) -> None:
    pytest.importorskip(library)
    recording = Recording(PROBLEM, "theirs")
    candidates = np.random.default_rng(1).uniform(*PROBLEM.bounds, (9, PROBLEM.dimension))
    adapted = recording.to(library)
    if library == "pymoo":
        adapted.evaluate(candidates)
    else:
        for x in candidates:
            (adapted if library == "scipy" else adapted.fitness)(x)
    assert (recording.done, recording.merits[-1]) == (9, PROBLEM.merit(candidates).min())


@needs_compiler
def test_a_table_gives_the_runs_back(tmp_path: Path) -> None:
    runs = [Recording(PROBLEM, solver, run) for solver in ("a", "b, c") for run in (1, 2)]
    for seed, run in enumerate(runs):
        run(np.random.default_rng(seed).uniform(*PROBLEM.bounds, (40, PROBLEM.dimension)))
    for name in ("runs.csv", "runs.csv.xz"):
        write_runs(tmp_path / name, runs)
        for run, again in zip(runs, read_runs(tmp_path / name), strict=True):
            assert (again.solver, again.run, again.problem.name, again.done) == (run.solver, run.run, NAME, 40)
            assert (again.evaluations, again.merits) == (run.evaluations, run.merits)
    plain, packed = ((tmp_path / name).read_bytes() for name in ("runs.csv", "runs.csv.xz"))
    assert lzma.decompress(packed) == plain


def test_when_it_was_feasible_first(tmp_path: Path) -> None:
    bound = PROBLEM.feasible_merit
    path = written(tmp_path / "runs.csv", f"a,{NAME},1,1,{bound + 1}", f"a,{NAME},1,5,{bound}", f"b,{NAME},1,9,1e9")
    a, b = read_runs(path)
    assert (a.feasible_from, b.feasible_from) == (5, np.inf)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (f"a,{NAME},1,1", "line 2: 4 fields where 5 are needed"),
        (f",{NAME},1,1,2.0", "line 2: solver: a name in printable characters is needed"),
        ("a,arm-motions-1/nope@1,1,1,2.0", "line 2: there is no problem 'nope@1'"),
        ("a,nope,1,1,2.0", "line 2: 'nope' is no problem such as"),
        (f"a,{NAME},x,1,2.0", "line 2: run: 'x' is no whole number"),
        (f"a,{NAME},1,0,2.0", "line 2: a finite merit and from 1 to 1000000000000000 evaluations are needed"),
        (f"a,{NAME},1,1{'0' * 400},2.0", "line 2: a finite merit and from 1 to"),
        (f"a,{NAME},1,1,nan", "line 2: a finite merit and from 1 to"),
        (f"a,{NAME},1,1.5,2.0", "line 2: evaluations: '1.5' is no whole number"),
        (f"a,{NAME},1,1_0,2.0", "line 2: evaluations: '1_0' is no whole number"),
        (f"a,{NAME},\u0661,1,2.0", "line 2: run: '\u0661' is no whole number"),
        (f"a,{NAME},1,1,1_0.0", "line 2: merit: '1_0.0' is no number"),
        (f"a,{NAME},1,1,abc", "line 2: merit: 'abc' is no number"),
        (f"a,{NAME},1,1,0.01", f"line 2: merit: 0.01 of {NAME}, of which no motion has less than 0."),
        (f"a,{NAME},1,2,2.0\na,{NAME},1,2,1.0", "line 3: evaluations: 2 after 2 of the same run"),
        (f"a,{NAME},1,2,2.0\na,{NAME},1,3,2.5", "line 3: merit: 2.5 after 2 of the same run"),
    ],
)
def test_a_wrong_line_is_named(line: str, reason: str, tmp_path: Path) -> None:
    path = written(tmp_path / "runs.csv", *line.split("\n"))
    with pytest.raises(InvalidSuite) as caught:
        read_runs(path)
    assert str(caught.value).startswith(f"{path}: {reason}") and "\n" not in str(caught.value)


def test_other_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidSuite, match=r"none\.csv: No such file"):
        read_runs(tmp_path / "none.csv")
    with pytest.raises(InvalidSuite, match=r"line 1: is not solver,problem,run,evaluations,merit"):
        read_runs(written(tmp_path / "a.csv", header="x,y"))
    with pytest.raises(InvalidSuite, match="there are no runs in it"):
        read_runs(written(tmp_path / "b.csv"))
    (tmp_path / "c.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidSuite, match="is no text in UTF-8"):
        read_runs(tmp_path / "c.csv")
    for content in (b"solver,problem", lzma.compress(b"solver,problem")[:-4]):
        (tmp_path / "d.csv.xz").write_bytes(content)
        with pytest.raises(InvalidSuite, match="is no whole file of xz"):
            read_runs(tmp_path / "d.csv.xz")


class Fronted(SuiteProblem):
    """A problem of which a front between two values is known."""

    best_front = BestFront(
        ideal=np.array([0.5, 1.0]),
        nadir=np.array([2.5, 5.0]),
        hypervolume=1.0,
        x=np.empty((0, 32)),
        values=np.empty((0, 2)),
        ways={},
    )


@needs_compiler
def test_of_two_objectives_the_merit_is_what_the_front_misses(tmp_path: Path) -> None:
    stated = tp.suite()["time-length-4@1"]
    problem = Fronted(stated.suite, stated.function, stated.instance)
    recording, attainment = Recording(problem, "mine"), Attainment(Fronted.best_front, problem.feasible_merit)
    middle, half = np.mean(problem.bounds, axis=0), np.ptp(problem.bounds, axis=0) / 2.0
    spread = np.linspace(1.0, 0.05, 400)[:, None]  # the later, the nearer to the straight motion
    candidates = middle + np.random.default_rng(2).uniform(-spread, spread, (400, problem.dimension)) * half
    merits = recording(candidates[:300])
    assert np.array_equal(merits, problem.merit(candidates[:300])) and merits.shape == (300, 2)
    assert np.array_equal([recording(x) for x in candidates[300:]], problem.merit(candidates[300:]))
    course = [attainment.add(pair) for pair in problem.merit(candidates).tolist()]
    falls = [k for k, value in enumerate(course) if k == 0 or value < course[k - 1]]
    assert recording.evaluations == [k + 1 for k in falls] and recording.merits == [course[k] for k in falls]
    first = np.flatnonzero(merits[:, 0] <= problem.feasible_merit)[0] + 1
    assert recording.feasible_merit == FEASIBLE and recording.feasible_from == first > 1
    write_runs(tmp_path / "runs.csv", [recording])
    [again] = read_runs(tmp_path / "runs.csv")
    assert (again.merits, again.feasible_from, again.done) == (recording.merits, first, 400)


@needs_compiler
def test_without_a_front_two_objectives_are_not_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    stated = tp.suite()["time-length-4@1"]
    monkeypatch.setattr(Fronted, "best_front", None)
    problem = Fronted(stated.suite, stated.function, stated.instance)
    with pytest.raises(ValueError, match="has two objectives, and no front is known to judge runs by"):
        Recording(problem, "mine")(np.zeros(problem.dimension))


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda folder: write_runs(None, []), "path: that of a file is needed"),  # type: ignore[arg-type]
        (lambda folder: write_runs(folder / "runs.csv", [1]), "runs: recordings are needed"),  # type: ignore[list-item]
        (lambda folder: read_runs(7), "path: that of a file is needed"),  # type: ignore[arg-type]
        (lambda folder: Recording("spline-2@1", "mine"), "problem: a problem of a suite is needed"),  # type: ignore[arg-type]
        (lambda folder: Recording(PROBLEM, 1), "solver: a label is needed"),  # type: ignore[arg-type]
        (lambda folder: Recording(PROBLEM, "mine", "one"), "run: a whole number is needed"),  # type: ignore[arg-type]
        (lambda folder: Recording(PROBLEM, "mine", True), "run: a whole number is needed"),
        (lambda folder: tp.suite(functions="spline"), "functions: a list of names is needed"),
        (lambda folder: tp.suite(instances=[True]), "instances: a list of whole numbers is needed"),
        (lambda folder: tp.suite(1), "name: that of a suite is needed"),  # type: ignore[arg-type]
    ],
)
def test_other_arguments_are_refused(call: Callable[[Path], object], reason: str, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match=reason):
        call(tmp_path)


@pytest.mark.parametrize("label", ["", "a\nb", "\ud800"])
def test_labels_that_no_table_holds_are_refused_before_the_run(label: str) -> None:
    with pytest.raises(ValueError, match="solver: a name in printable characters is needed"):
        Recording(PROBLEM, label)


def test_a_table_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidSuite, match=r"nowhere/runs\.csv: No such file or directory"):
        write_runs(tmp_path / "nowhere/runs.csv", [])


def test_a_run_outside_the_box_is_refused(tmp_path: Path) -> None:
    run = Recording(PROBLEM, "lost")
    assert np.isinf(run(np.full((3, PROBLEM.dimension), np.nan))).all() and run.done == 3
    with pytest.raises(InvalidSuite, match=r"spline-2@1: run 1 of lost has no candidate in the box, of 3"):
        write_runs(tmp_path / "runs.csv", [run])
    assert not (tmp_path / "runs.csv").exists()


def test_a_byte_order_mark_is_read_over(tmp_path: Path) -> None:
    path = written(tmp_path / "runs.csv", f"a,{NAME},1,1,2.0")
    path.write_text(path.read_text(), encoding="utf-8-sig")
    assert len(read_runs(path)) == 1


def test_what_is_recorded_in_another_library_has_the_same_threads() -> None:
    [shared] = tp.suite(functions=["spline-2"], instances=[1], threads=2)
    assert tp.Recording(shared, "scipy").to("scipy").problem.threads == 2
