"""``tpbso suite``: list, check, run, report."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest
from helpers.evaluation import needs_compiler
from helpers.running import campaigns_here, refusal, status

import tpbso_casadi as tp
from tpbso_casadi.cli.campaign import INTERRUPTED
from tpbso_casadi.cli.commands import suite as command
from tpbso_casadi.cli.commands.suite import main, numbers
from tpbso_casadi.suite import read_runs

pytestmark = [pytest.mark.usefixtures("in_an_empty_folder"), needs_compiler]
FEW = ["--functions", "spline-2,star-time", "--instances", "1-2", "--solvers", "pso,ga,lshade", "--budget", "30"]


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    campaigns_here(monkeypatch)


def run(*arguments: str) -> int:
    return status(main, *arguments)


def test_list_and_check(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert run("list", "--functions", "spline") == 0
    printed = capsys.readouterr().out
    assert "105 problems" in printed and "rotation-5" in printed and "narrow-3" not in printed
    assert run() == 0
    assert f"{len(tp.suite())} problems" in capsys.readouterr().out
    chosen = ("check", "--functions", "spline-2", "--instances", "1,3")
    assert run(*chosen) == 0
    assert capsys.readouterr().out == "2 of 2 problems give the bits of arm-motions-1\n"
    monkeypatch.setattr(tp.SuiteProblem, "is_intact", lambda problem: problem.instance == 1)
    assert run(*chosen) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "arm-motions-1/spline-2@3: other values than those of the suite"


def test_another_version(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    second = ("--suite", "arm-motions-2", "--functions", "spline-2,energy-3", "--instances", "1")
    assert run("check", *second) == 0
    assert capsys.readouterr().out == "2 of 2 problems give the bits of arm-motions-2\n"
    assert run("list", *second) == 0
    assert "arm-motions-2: 2 problems" in capsys.readouterr().out
    assert run("run", *second, "--solvers", "pso,ga", "--budget", "5", "--workers", "1", "--out", "two", "--quiet") == 0
    names = {each.problem.name for each in read_runs("two/runs.csv")}
    assert names == {"arm-motions-1/spline-2@1", "arm-motions-2/energy-3@1"}
    capsys.readouterr()
    assert run("report", "two", "--no-plots") == 0  # what both have counts in the first, the other's energy does not
    assert "2 runs on 1 problems" in capsys.readouterr().out
    assert run("report", "two", "--suite", "arm-motions-2", "--no-plots") == 0
    assert "4 runs on 2 problems" in capsys.readouterr().out


def test_run_judge_and_add_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("run", *FEW, "--workers", "1", "--out", "judged") == 0
    printed = capsys.readouterr().out
    assert "12 runs on 4 problems" in printed and "written to judged" in printed
    runs = read_runs("judged/runs.csv")
    assert [each.done for each in runs] == [30 * each.problem.dimension for each in runs]
    first, bounds = runs[0], np.array(runs[0].problem.bounds).T
    alone = tp.minimize(first.problem.merit, bounds, tp.PSO(), first.done, 1, vectorized=True)
    assert first.merits[-1] == alone.cost
    before = Path("judged/runs.csv").read_text()
    assert run("run", *FEW, "--workers", "1", "--out", "judged", "--quiet", "--no-plots") == 0
    assert Path("judged/runs.csv").read_text() == before
    header, *rows = before.splitlines()
    mine = [f"mine,{row.partition(',')[2]}" for row in rows if row.startswith("ga,")]
    Path("mine.csv").write_text("\n".join([header, *mine]) + "\n")
    capsys.readouterr()
    assert run("report", "judged", "--runs", "mine.csv", "--no-plots") == 0
    printed = capsys.readouterr().out
    assert "16 runs on 4 problems" in printed and "mine" in printed
    page = Path("judged/suite.html").read_text()
    assert "mine" in page and "hypervolume" not in page
    some = ("--functions", "spline-2", "--instances", "2")
    assert run("report", "judged", *some, "--format", "coco,ioh", "--no-plots") == 0
    assert "3 runs on 1 problems" in capsys.readouterr().out
    [info] = Path("judged/coco/lshade").glob("*.info")
    assert "funcId = 1, DIM = 16" in info.read_text() and f" 2:{30 * 16}|" in info.read_text()
    assert [path.name for path in Path("judged/ioh/pso").glob("*.json")] == ["IOHprofiler_f1_spline-2.json"]
    Path("few.csv").write_text("\n".join([header, *(row for row in mine if "star-time@1" in row)]) + "\n")
    assert run("report", "judged", "--runs", "few.csv", "--no-plots") == 0
    printed = capsys.readouterr().out
    assert "3 problems are left out" in printed and "4 runs on 1 problems" in printed
    Path("other.csv").write_text(f"{header}\nmine,arm-motions-1/spline-3@1,1,9,1.0\n")
    arguments = ("report", "judged", "--runs", "other.csv", "--no-plots")
    assert "no problem that all of the solvers have searched" in refusal(capsys, main, *arguments)
    twice = refusal(capsys, main, "report", "judged", "--runs", "judged/runs.csv", "--no-plots")
    assert "is in 2 tables" in twice
    assert "no runs of these" in refusal(capsys, main, "report", "judged", "--functions", "panda-boxes", "--no-plots")


def test_numbers() -> None:
    assert numbers("1-3,2,9") == (1, 2, 3, 9)
    for text in ("", "1-", "x", "1-2000", "-3", "5-4"):
        with pytest.raises(argparse.ArgumentTypeError, match="is not a number or a range"):
            numbers(text)


def test_fronts_are_judged_beside_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pymoo")
    stated = ["--functions", "time-length-4,spline-2", "--instances", "1", "--budget", "40", "--workers", "1"]
    assert run("run", *stated, "--solvers", "lshade,pymoo(algorithm=nsga2)", "--no-plots", "--out", "judged") == 0
    assert "4 runs on 2 problems" in capsys.readouterr().out
    runs = read_runs("judged/runs.csv")
    assert [each.done for each in runs] == [40 * each.problem.dimension for each in runs]
    assert [len(each.problem.objectives) for each in runs] == [1, 1, 2, 2]
    assert "best known" in Path("judged/summary.csv").read_text()
    assert "hypervolume that is missing" in Path("judged/suite.html").read_text()


@pytest.mark.parametrize("verbose", [[], ["-v"]])
def test_what_an_interruption_leaves_is_said_of_the_command_that_stores_runs(
    verbose: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object, **__: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "dispatch", stopped)
    for words, told in ((["run"], INTERRUPTED), (["list"], "interrupted"), (["export", "run"], "interrupted")):
        assert main([*verbose, *words]) == 130
        assert f"error: {told}\n" in capsys.readouterr().err
