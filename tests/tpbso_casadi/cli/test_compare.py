"""``tpbso compare``: its files, its errors, and that no kill loses anything."""

from __future__ import annotations

import csv
import json
import os
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from helpers.running import campaigns_here, status
from helpers.scenes import SWING, TWO_LINKS, toml
from helpers.stores import wait_for_rows
from helpers.waiting import PATIENCE, wait_until

import tpbso_casadi as tp
from solvers import Budget
from tpbso_casadi.cli.commands.compare import campaign, main, parser

STORE = Path("cut/runs.sqlite")
COMMAND = [sys.executable, "-m", "tpbso_casadi", "compare"]
SMALL = ["time-2", "rotation-2", "--solvers", "bso,pso,bso+polish", "--runs", "6", "--no-plots", "--quiet"]
SMALL += ["--evaluations", "2000"]
MINE = {"arm": TWO_LINKS, "task": SWING, "model": {"retime": False}}


pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    campaigns_here(monkeypatch)


def run(*arguments: str) -> int:
    return status(main, *arguments)


def table(folder: str) -> list[dict[str, str]]:
    with Path(folder, "summary.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_what_it_leaves_and_says(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.cli.progress.LINE_SECONDS", 0.01)
    Path("mine.toml").write_text(toml(**MINE))
    solvers, cases = ("bso", "ga(tournament=3)"), ("time-2", "mine")
    arguments = ["time-2", "mine.toml", "--solvers", ",".join(solvers), "--runs", "2", "--evaluations", "100"]
    arguments += ["--no-plots", "--workers", "1"]
    assert run(*arguments, "--export", "exported/runs.csv") == 0
    output, errors = capsys.readouterr()
    assert "time-2 [s]" in output and "ga(tournament=3)" in output and "written to runs/compare" in output
    check_progress(errors.splitlines(), 8, "2 scenarios, 2 solvers, 2 seeds")
    rows = table("runs/compare")
    assert [(row["case"], row["solver"]) for row in rows] == [(case, solver) for case in cases for solver in solvers]
    assert all(row["runs"] == "2" and row["failed"] == "0" for row in rows)
    with Path("exported/runs.csv").open(newline="") as file:
        exported = list(csv.DictReader(file))
    assert len(exported) == 8
    means = [float(row["objective"]) for row in exported if (row["case"], row["solver"]) == ("mine", "bso")]
    assert float(rows[2]["mean"]) == pytest.approx(sum(means) / 2, rel=1e-12)
    assert run(*arguments, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert [repr(row["mean"]) for row in printed] == [row["mean"] for row in rows]
    assert run(*arguments, "--runs", "3", "-v") == 0
    errors = capsys.readouterr().err
    said = "12 runs (2 scenarios, 2 solvers, 3 seeds), 8 of them stored already: "
    assert any(line.startswith(said) for line in errors.splitlines())
    done = re.findall(r"run: ([\w-]+, \S+, seed \d): done in", errors)
    assert sorted(done) == sorted(f"{case}, {solver}, seed 3" for case in cases for solver in solvers)
    assert run(*arguments, "--quiet") == 0
    assert capsys.readouterr().err == ""


def check_progress(lines: list[str], runs: int, grid: str) -> None:
    """The size of a campaign and how long it takes are said first; then how far it is."""
    first = next(number for number, line in enumerate(lines) if line.startswith(f"{runs} runs "))
    assert re.fullmatch(rf"{runs} runs \({grid}\): [\d.]+ (s|min) to [\d.]+ (s|min) on 1 process", lines[first])
    progress = [line for line in lines[first:] if f"of {runs} runs after" in line]
    time = r"[\d.]+ (s|min)"
    assert all(re.fullmatch(rf"\d+ of {runs} runs after {time}(, about {time} left)?", line) for line in progress)
    counts = [int(line.split()[0]) for line in progress]
    assert counts == sorted(counts) and counts[0] <= 1 and counts[-1] >= 2


def test_parquet_has_the_same_rows() -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    arguments = ["function:sphere-2", "--solvers", "bso,pso", "--runs", "2", "--evaluations", "50", "--quiet"]
    arguments += ["--no-plots"]
    assert run(*arguments, "--table", "runs.parquet") == run(*arguments, "--export", "runs.csv") == 0
    with Path("runs.csv").open(newline="") as file:
        expected = list(csv.DictReader(file))
    exported = parquet.read_table("runs.parquet").to_pylist()
    assert [{key: str(value) for key, value in row.items()} for row in exported] == expected


FUNCTIONS = ["function:sphere-3", "function:rastrigin-2@4"]
FEW = ["--runs", "2", "--evaluations", "200", "--quiet", "--workers", "1"]


def test_functions_are_compared_as_scenarios_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*FUNCTIONS, "--solvers", "pso,bso(c1=1.5)", *FEW, "--no-plots", "--format", "coco,ioh") == 0
    rows = table("runs/compare")
    assert [(row["case"], row["solver"]) for row in rows] == [
        *(("sphere-3", "pso"), ("sphere-3", "bso(c1=1.5)")),
        *(("rastrigin-2@4", "pso"), ("rastrigin-2@4", "bso(c1=1.5)")),
    ]
    function = tp.benchmark_function("rastrigin-2@4")
    alone = [tp.minimize(function, function.bounds, tp.BSO(c1=1.5), 200, seed, vectorized=True) for seed in (1, 2)]
    assert float(rows[3]["mean"]) == pytest.approx(np.mean([result.cost for result in alone]), rel=1e-12)
    assert rows[3]["unit"] == "above minimum"
    assert all(row["median_gap"] == row["median"] != "" for row in rows)  # to the minimum, absolutely
    assert run(*FUNCTIONS, "--solvers", "pso,bso(c1=1.5)", *FEW, "--no-plots", "--json") == 0
    assert [row["mean"] for row in json.loads(capsys.readouterr().out)] == [float(row["mean"]) for row in rows]
    assert Path("runs/compare/coco/cases.txt").read_text().startswith("f1: sphere-3\nf2: rastrigin-2@4\n")
    meta = json.loads(Path("runs/compare/ioh/bso_c1=1.5/IOHprofiler_f2_rastrigin-2-4.json").read_text())
    assert [described["evals"] for described in meta["scenarios"][0]["runs"]] == [200, 200]
    lowest = [described["best"]["y"] for described in meta["scenarios"][0]["runs"]]
    assert lowest == pytest.approx([result.cost for result in alone], rel=1e-12)


@pytest.mark.slow
def test_functions_have_figures_and_a_page() -> None:
    arguments = [*FUNCTIONS, "--solvers", "pso,bso", "--runs", "4", *FEW[2:]]
    assert run(*arguments) == 0
    written = {path.name for path in Path("runs/compare").glob("*.png")}
    assert written == {"comparison.png", "ecdf.png", "effect-sizes.png"}
    page = Path("runs/compare/comparison.html").read_text()
    assert page.count('<svg class="figure"') == 3  # and no motions
    assert "51 gaps to\nthe known minimum of the function, from 100 to 1e-08" in page
    assert "the lowest value of every run" in page and "certified" not in page and "plan" not in visible(page)
    assert "where 0 is the minimum, at x = (" in page
    assert run(*arguments, "--no-plots") == 0
    assert "No figures were drawn" in Path("runs/compare/comparison.html").read_text()


def visible(page: str) -> str:
    """What a reader reads, without style and drawings."""
    return re.sub(r"<style>.*?</style>|<svg.*?</svg>|<[^>]*>", "", page, flags=re.DOTALL)


def test_ipopt_has_a_budget_of_its_own() -> None:
    Path("mine.toml").write_text(toml(**MINE, solver={"evaluations": 30000}))

    def budgets(*arguments: str) -> list[Budget]:
        options = parser().parse_args(["mine.toml", "--solvers", "bso,ipopt", "--runs", "1", "--quiet", *arguments])
        return [run.scenario.solver.budget() for run in campaign(options)]

    assert budgets() == [Budget(30_000), Budget(iterations=5)]
    assert budgets("--starts", "9", "--iterations", "70") == [Budget(30_000, 70), Budget(iterations=9)]
    assert budgets("--evaluations", "400") == [Budget(400), Budget(iterations=5)]
    assert budgets("--time-limit", "2") == [Budget(30_000, seconds=2.0), Budget(seconds=2.0)]


def test_a_failed_run_is_said_and_tried_again_when_asked(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["function:sphere-2", "--solvers", "bso,helpers.campaign:Raises", "--runs", "8", "--evaluations", "50"]
    arguments += ["--no-plots", "--quiet"]
    assert run(*arguments) == 1
    error = capsys.readouterr().err
    assert "of 16 runs failed, the first: sphere-2, helpers.campaign:Raises, seed" in error
    assert "ArithmeticError: this one fails (--retry-failed tries them again)" in error
    assert run(*arguments, "--retry-failed") == 1


def kill_at(rows: int, delay: float) -> None:
    """Start the campaign in ``cut`` and kill it some time after its store holds so many runs."""
    command = [*COMMAND, *SMALL, "--workers", "2", "--out", "cut"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    wait_for_rows(process, STORE, rows)
    try:
        _, errors = process.communicate(timeout=delay)
        assert process.returncode == 0, errors
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
    with closing(sqlite3.connect("cut/runs.sqlite")) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert connection.execute("SELECT count(*) FROM runs").fetchone()[0] >= rows


@pytest.mark.process
@pytest.mark.slow
def test_killed_fifty_times_it_resumes_where_it_stopped() -> None:
    rng = random.Random(7)
    subprocess.run([*COMMAND, *SMALL, "--workers", "1", "--out", "whole"], check=True)
    for index in range(50):
        kill_at(1 + index * 35 // 50, rng.uniform(0.0, 1.0))
    subprocess.run([*COMMAND, *SMALL, "--workers", "2", "--out", "cut"], check=True)
    assert Path("cut/summary.csv").read_bytes() == Path("whole/summary.csv").read_bytes()
    with closing(sqlite3.connect("cut/runs.sqlite")) as connection:
        assert connection.execute("SELECT count(*), count(DISTINCT key) FROM runs").fetchone() == (36, 36)


@pytest.mark.process
@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
def test_workers_end_with_a_killed_parent() -> None:
    arguments = ["time-2", "--solvers", "bso", "--runs", "200", "--no-plots", "--quiet", "--out", "cut"]
    arguments += ["--workers", "2"]
    process = subprocess.Popen([*COMMAND, *arguments])
    wait_until(lambda: len(children(process.pid)) == 3)  # two workers and their tracker
    workers = children(process.pid)
    process.kill()
    process.wait()
    wait_until(lambda: not any(alive(pid) for pid in workers))


def children(pid: int) -> list[int]:
    pids: list[int] = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        pids += [int(child) for child in task.read_text().split()]
    return pids


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.process
@pytest.mark.parametrize(
    ("send", "number"), [(os.killpg, signal.SIGINT), pytest.param(os.kill, signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_an_interruption_keeps_what_was_done(send: Callable[[int, int], None], number: int) -> None:
    arguments = ["time-2", "--solvers", "bso", "--runs", "400", "--no-plots", "--quiet", "--out", "cut"]
    process = subprocess.Popen([*COMMAND, *arguments], stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for_rows(process, STORE, 1)
    send(process.pid, number)  # Ctrl-C as a terminal does: to the workers too
    _, errors = process.communicate(timeout=PATIENCE)
    expected = "error: interrupted; completed runs are stored, and the same command resumes\n"
    assert (process.returncode, errors) == (130, expected)
    with closing(sqlite3.connect(STORE)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        kept = connection.execute("SELECT error FROM runs").fetchall()
    assert 0 < len(kept) < 400 and set(kept) == {("",)}


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 120 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=120k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no right to mount a file system")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.process
@pytest.mark.slow
def test_a_full_disk_loses_nothing(small_disk: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["time-2", "--solvers", "bso", "--runs", "16", "--no-plots", "--quiet", "--out", str(small_disk)]
    assert run(*arguments) == 2
    expected = f"error: {small_disk / 'runs.sqlite'}: database or disk is full; runs stored before are kept\n"
    assert capsys.readouterr().err == expected
    subprocess.run(["mount", "-o", "remount,size=4m", str(small_disk)], check=True)
    with closing(sqlite3.connect(small_disk / "runs.sqlite")) as connection:
        before = connection.execute("SELECT count(*) FROM runs").fetchone()[0]
    assert 0 < before < 16
    assert run(*arguments) == 0
    [row] = table(str(small_disk))
    assert row["runs"] == "16"
