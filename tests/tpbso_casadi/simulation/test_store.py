"""The files and the numbers of a simulation."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.helpers.simulations import EVERY, replan_at, simulated
from tpbso_casadi.plain import parsed_json
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.simulation import SimulationRecord, SimulationResult, SummaryResult, write_simulation
from tpbso_casadi.simulation.result import REPLANS, obstacle_table, replan_rows, row_times, stretches, summary_of
from tpbso_casadi.storage import OutputError, check_seal

CART = {"shape": "box", "center": [3.0, 0.0], "size": [0.4, 0.2], "velocity": [0.0, 0.5]}
STILL = {"shape": "box", "center": [-3.0, 0.5], "size": [0.4, 0.2]}


@pytest.fixture(scope="module")
def record() -> SimulationRecord:
    return simulated(obstacles=[STILL, CART], simulation={"seconds": 1.0})


def summed_up(record: SimulationRecord, *seconds: float) -> SummaryResult:
    replans = tuple(replan_at(tick, seconds=taken) for tick, taken in enumerate(seconds))
    return summary_of(replace(record, replans=replans), stretches(record))


def test_times_of_replans_are_summed_up(record: SimulationRecord) -> None:
    summary = summed_up(record, 0.1, 0.2, EVERY, 0.3)
    assert summary.deadlines_met == 0.75
    assert summary.median_ms == pytest.approx(225.0)
    assert summary.largest_ms == pytest.approx(300.0)
    assert summary.percentile_99_ms == pytest.approx(300.0 - 0.03 * 50.0)


def test_kinds_and_proofs_are_counted(record: SimulationRecord) -> None:
    kinds = ("new", "old", "old", "stop")
    replans = [replan_at(tick, kind=kind, certified=tick > 0, fail_safe=tick > 1) for tick, kind in enumerate(kinds)]
    summary = summary_of(replace(record, replans=tuple(replans)), stretches(record))
    counted = summary.replans, summary.new, summary.old, summary.stop, summary.certified, summary.fail_safe
    assert counted == (4, 1, 2, 1, 3, 2)


def test_a_jump_is_no_good_simulation(record: SimulationRecord) -> None:
    result = SimulationResult.of(record)
    assert result.is_good
    jumps = replan_at(0, jumps=(0.0, 2e-9, 0.0))
    assert not SimulationResult.of(replace(record, replans=(jumps,))).is_good


def test_a_collision_or_a_broken_limit_is_no_good_simulation() -> None:
    hit = {"shape": "box", "center": [1.2, 1.2], "size": [0.2, 0.2]}
    assert not SimulationResult.of(simulated(obstacles=[hit], simulation={"seconds": 1.0})).is_good
    assert not SimulationResult.of(simulated(arm={"max_speed": 1.0}, simulation={"seconds": 1.0})).is_good


def test_the_table_of_obstacles_has_those_that_move_by_their_numbers(record: SimulationRecord) -> None:
    times = np.linspace(0.0, 1.0, 5)
    header, rows = obstacle_table(record, times)
    assert header == ["t", "x2", "y2"]
    assert np.array(rows) == pytest.approx(np.column_stack([times, np.full(5, 3.0), 0.5 * times]))


def test_the_table_of_replans(record: SimulationRecord) -> None:
    replan = replan_at(2, seconds=0.3, fail_safe=False, predicted_distance=np.inf, jumps=(1e-16, 2e-16, 3e-16))
    [row] = replan_rows(replace(record, replans=(replan,)))
    assert dict(zip(REPLANS, row, strict=True)) == {
        "tick": 2, "t": 0.5, "goal": 0, "kind": "new", "certified": "yes", "fail_safe": "no", "ms": 300.0,
        "in_time": "no", "predicted_distance": None, "arrival": 1.0, "jump_q": 1e-16, "jump_qd": 2e-16,
        "jump_qdd": 3e-16,
    }  # fmt: skip


def test_rows_are_a_hundredth_of_a_second_apart_at_the_most(record: SimulationRecord) -> None:
    times = row_times(record)
    assert np.diff(times).max() <= 0.01 + 1e-12
    assert set(record.executed.breakpoints) <= set(times)


def test_a_folder_is_complete_sealed_and_can_be_written_again(record: SimulationRecord, tmp_path: Path) -> None:
    result, folder = SimulationResult.of(record), tmp_path / "out"
    for text in ("one", "two"):
        further = [lambda staged, text=text: (staged / "figure.png").write_text(text)]
        names = write_simulation(folder, record, result, further)
        assert sorted(names) == sorted(path.name for path in folder.iterdir())
        assert (folder / "figure.png").read_text() == text
    content = parsed_json((folder / "result.json").read_text())
    check_seal(content)
    assert parse_scenario(content["scenario"]) == record.scenario
    assert set(content["files"]) == {"trajectory.csv", "replans.csv", "obstacles.csv", "figure.png"}


def test_a_figure_that_fails_leaves_the_rest(record: SimulationRecord, tmp_path: Path) -> None:
    def fail(staged: Path) -> None:
        raise OutputError("no colours")

    with pytest.raises(OutputError, match=r"the run is written, but not all of its files: no colours$"):
        write_simulation(tmp_path / "out", record, SimulationResult.of(record), [fail])
    assert len(json.loads((tmp_path / "out/result.json").read_text())["files"]) == 3


def test_a_disk_that_is_full_leaves_the_old_folder(
    record: SimulationRecord, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result, folder = SimulationResult.of(record), tmp_path / "out"
    write_simulation(folder, record, result)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tpbso_casadi.simulation.result.write_csv", full)
    with pytest.raises(OutputError, match="No space left on device"):
        write_simulation(folder, record, result)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
