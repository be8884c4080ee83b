"""Records: what is kept is not done again, processes that hang or die are survived, and the table."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from benchmarks.motion_bench_maker.limited import NoResult, within
from benchmarks.motion_bench_maker.problem_file import MotionProblem, read_problems
from benchmarks.motion_bench_maker.records import Record, Records
from benchmarks.motion_bench_maker.runs import Run, run_all
from benchmarks.motion_bench_maker.setting import Setting
from benchmarks.motion_bench_maker.table import HEADER, by_kind, printed, rows


def record(problem: str = "table_small-0001", seed: int = 1, **values: object) -> Record:
    return Record(problem, "planner", seed, "setup", 2.0, **values)  # type: ignore[arg-type]


def test_what_was_recorded_is_there_when_a_file_is_opened_again(tmp_path: Path) -> None:
    records = Records(tmp_path / "records.jsonl")
    one, two = record(), record(seed=2, duration=3.0, excess=[0.0, 0.1], details={"a": [1]})
    records.add(one)
    records.add(two)
    again = Records(tmp_path / "records.jsonl")
    assert again.every == [one, two]
    other = ("other", "planner", 1, "setup")
    assert again.missing([one.key, other, two.key]) == [other]


def test_a_line_that_was_being_written_is_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "records.jsonl"
    Records(path).add(record())
    whole = path.read_text()
    path.write_text(whole + whole[:20])
    records = Records(path)
    assert records.every == [record()]
    records.add(record(seed=2))
    assert len(Records(path).every) == 2


@pytest.mark.process
def test_a_call_is_survived_whatever_it_does() -> None:
    assert within(60.0, divmod, 7, 3) == (2, 1)
    for limit, reason, call, argument in (
        (60.0, "ValueError: invalid literal for int() with base 10: 'a b'", int, "a b"),
        (60.0, "its process died", os._exit, 3),
        (0.1, "ended after 0.1 s", time.sleep, 1000),
    ):
        with pytest.raises(NoResult) as error:
            within(limit, call, argument)
        assert str(error.value) == reason


def answered(planner: str, setting: Setting, problem: MotionProblem, seed: int, seconds: float) -> Record:
    assert planner == "planner"
    if seed == 2:
        raise ValueError("seed 2")
    return Record(problem.name, planner, seed, setting.digest(problem), 1.0, duration=seconds)


@pytest.mark.process
def test_only_what_is_missing_is_done(setting: Setting, folder: Path) -> None:
    pytest.importorskip("ruckig")
    (problem,) = read_problems(folder / "small.jsonl")
    runs = [Run("planner", seed, setting, problem, 1.5, answered) for seed in (1, 2)]
    records, new = Records(folder / "records.jsonl"), []
    records.add(runs[0].call("planner", setting, problem, 1, 1.5))
    run_all(runs, records, 2, new.append)
    assert [one.seed for one in new] == [2]
    assert (records.every[0].duration, records.every[0].error) == (1.5, "")
    assert (records.every[1].duration, records.every[1].error) == (None, "ValueError: seed 2")
    assert records.every[1].bound == pytest.approx(setting.bound(problem))


def test_the_table_counts_and_compares_with_the_bound() -> None:
    every = [
        record("table_x-1", 1, duration=3.0, seconds=1.0, clearance=0.1, excess=[0.0, 0.0005], certified=True),
        record("table_x-1", 2, duration=2.5, seconds=2.0, clearance=-0.01, excess=[0.1], certified=False),
        record("cage_x-1", 1, seconds=3.0, error="none"),
        record("cage_x-1", 2, duration=4.0, seconds=4.0, clearance=0.0, excess=[0.0], certified=True),
    ]
    each, best = (dict(zip(HEADER, row, strict=True)) for row in rows(every))
    assert each["planner"] == "planner, each of 2 seeds"
    assert (each["solved"], each["clear at samples"], each["certified"]) == ("3 of 4", "2", "2 of 3")
    assert each["limits kept within 0.1 %"] == "2"
    assert each["duration, s (median)"] == "3.000"
    assert each["over the bound: median / 98 % / worst"] == "1.500 / 1.980 / 2.000"
    assert each["seconds: median / worst"] == "2.50 / 4.0"
    assert each["deepest, mm"] == "10"
    assert (best["solved"], best["clear at samples"], best["duration, s (median)"]) == ("2 of 2", "2", "3.500")
    assert best["seconds: median / worst"] == "5.00 / 7.0"
    assert [row[0] for row in by_kind(every)][2:] == ["planner: table", "planner: cage"]
    assert printed([["a", "b"]], ["x", "y"]) == "| x | y |\n| --- | --- |\n| a | b |"
