"""The numbers, the files, the figure and the player of a simulation."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from helpers.browser import after, fetched
from helpers.simulation_records import KINDS, record_of
from helpers.simulations import EVERY, replan_at, simulated
from PIL import Image

from tpbso_casadi.animation.player import simulation_page
from tpbso_casadi.figures.simulation import STYLES, draw_simulation, simulation_figure
from tpbso_casadi.plain import parsed_json
from tpbso_casadi.replanning.candidates import Kind
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.simulation import MEANINGS, SimulationRecord, SimulationResult, simulated_motion, write_simulation
from tpbso_casadi.simulation.result import REPLANS, obstacle_table, replan_rows, row_times, stretches, summary_of
from tpbso_casadi.storage import check_seal

CART = {"shape": "box", "center": [3.0, 0.0], "size": [0.4, 0.2], "velocity": [0.0, 0.5]}
STILL = {"shape": "box", "center": [-3.0, 0.5], "size": [0.4, 0.2]}


@pytest.fixture(scope="module")
def record() -> SimulationRecord:
    return simulated(obstacles=[STILL, CART], simulation={"seconds": 1.0})


def test_times_kinds_and_proofs_of_replans_are_summed_up(record: SimulationRecord) -> None:
    answers = zip((0.1, 0.2, EVERY, 0.3), ("new", "old", "old", "stop"), strict=True)
    replans = [
        replan_at(tick, seconds=taken, kind=kind, certified=tick > 0, fail_safe=tick > 1)
        for tick, (taken, kind) in enumerate(answers)
    ]
    summary = summary_of(replace(record, replans=tuple(replans)), stretches(record))
    assert summary.deadlines_met == 0.75
    assert summary.median_ms == pytest.approx(225.0)
    assert summary.largest_ms == pytest.approx(300.0)
    assert summary.percentile_99_ms == pytest.approx(300.0 - 0.03 * 50.0)
    counted = summary.replans, summary.new, summary.old, summary.stop, summary.certified, summary.fail_safe
    assert counted == (4, 1, 2, 1, 3, 2)


def test_a_jump_a_collision_or_a_broken_limit_is_no_good_simulation(record: SimulationRecord) -> None:
    assert SimulationResult.of(record).is_good
    hit = {"shape": "box", "center": [1.2, 1.2], "size": [0.2, 0.2]}
    for bad in (
        replace(record, replans=(replan_at(0, jumps=(0.0, 2e-9, 0.0)),)),
        simulated(obstacles=[hit], simulation={"seconds": 1.0}),
        simulated(arm={"max_speed": 1.0}, simulation={"seconds": 1.0}),
    ):
        assert not SimulationResult.of(bad).is_good


def test_the_table_of_obstacles_has_those_that_move_by_their_numbers(record: SimulationRecord) -> None:
    times = np.linspace(0.0, 1.0, 5)
    header, rows = obstacle_table(record, times)
    assert header == ["t", "x2", "y2"]
    assert np.array(rows) == pytest.approx(np.column_stack([times, np.full(5, 3.0), 0.5 * times]))


def test_the_table_of_replans_and_the_times_of_rows(record: SimulationRecord) -> None:
    replan = replan_at(2, seconds=0.3, fail_safe=False, predicted_distance=np.inf, jumps=(1e-16, 2e-16, 3e-16))
    [row] = replan_rows(replace(record, replans=(replan,)))
    assert dict(zip(REPLANS, row, strict=True)) == {
        "tick": 2, "t": 0.5, "goal": 0, "kind": "new", "certified": "yes", "fail_safe": "no", "ms": 300.0,
        "in_time": "no", "predicted_distance": None, "arrival": 1.0, "jump_q": 1e-16, "jump_qd": 2e-16,
        "jump_qdd": 3e-16,
    }  # fmt: skip
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


def data_of(text: str) -> dict[str, Any]:
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    return json.loads(content)


@pytest.mark.parametrize(("dim", "views"), [(2, [[0, 1]]), (3, [[0, 1], [0, 2]])])
def test_replans_are_marked_where_they_were_executed_from(dim: int, views: list[list[int]]) -> None:
    record = record_of(dim)
    figure = simulation_figure(record)
    motion = simulated_motion(record)
    for axes, columns in zip(figure.axes, views, strict=False):
        for kind, (colour, marker, _) in STYLES.items():
            [marks] = [line for line in axes.lines if line.get_marker() == marker and line.get_color() == colour]
            times = [min(EVERY * (tick + 1), 2.0) for tick, own in enumerate(KINDS) if own == kind]
            expected = motion.joint_positions(np.array(times))[:, -1, columns]
            np.testing.assert_allclose(marks.get_xydata(), expected)
        [way] = [line for line in axes.lines if line.get_label() == "its way"]
        velocity = np.array(record.obstacles[1].motion.velocity)[columns]
        np.testing.assert_allclose(way.get_xydata()[-1] - way.get_xydata()[0], 2.0 * velocity)
        texts = [text.get_text() for text in axes.texts if text.get_text()]
        assert texts == ["0 s", "2 s"]
    assert figure.get_suptitle() == "simulation of the planner, 2 s: 8 replans (2 new, 3 old, 3 stop)"


def test_distances_are_true_and_standstills_are_shaded() -> None:
    record = record_of(2)
    *_, distances, answers = simulation_figure(record).axes
    lines = {line.get_label(): line for line in distances.lines}
    [closest] = [label for label in lines if str(label).startswith("closest")]
    values = lines["obstacle 2, moving"].get_ydata()
    standing = lines["nearest standing obstacle"].get_ydata()
    least = min(np.min(values), np.min(standing))
    assert str(closest).startswith(f"closest: {1000.0 * least:.1f} mm found at ")
    # at t = 0 by hand: the tip of the arm, and an ellipse without a turn
    tip = np.array([1.0 + 0.8 * np.cos(0.3), 0.8 * np.sin(0.3)])
    phase = np.linspace(0.0, 2.0 * np.pi, 10_000)
    ellipse = np.column_stack([2.4 + 0.2 * np.cos(phase), 1.2 + 0.1 * np.sin(phase)])
    assert values[0] == pytest.approx(np.linalg.norm(ellipse - tip, axis=1).min() - 0.05, rel=5e-3)
    shaded = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in distances.patches]
    np.testing.assert_allclose(shaded, [[0.0, 0.5], [1.5, 2.0]], atol=1e-9)
    goals = [line.get_xdata()[0] for line in distances.lines if line.get_linestyle() == ":"]
    assert goals == [1.5]
    bars = sorted((bar.get_x(), bar.get_height()) for bar in answers.patches)
    np.testing.assert_allclose(bars, [(EVERY * tick, 10.0 * (tick + 1)) for tick in range(8)])


def test_the_figure_is_a_file(tmp_path: Path) -> None:
    assert set(STYLES) == set(MEANINGS) == set(get_args(Kind))
    [path] = draw_simulation(tmp_path, record_of(3))
    with Image.open(path) as image:
        assert np.asarray(image.convert("L")).std() > 10.0
    assert [path.name for path in tmp_path.iterdir()] == ["simulation.png"]


@pytest.mark.parametrize("dim", [2, 3])
def test_the_player_says_what_was_answered(dim: int) -> None:
    text = simulation_page("a <b>&</b> b", record_of(dim))
    assert fetched(text) == [] and "<title>a &lt;b&gt;" in text
    data = data_of(text)
    assert data["seconds"] == 2.0 and [time for time, _ in data["notes"]] == [EVERY * tick for tick in range(8)]
    answers = [answer for _, answer in data["notes"]]
    assert answers[0] == "replan 0: a new motion (proven clear of the prediction, a stop in time proven), 10 ms"
    assert answers[6] == "replan 6: stops (nothing proven), 70 ms"


@pytest.mark.process
@pytest.mark.parametrize("dim", [2, 3])
def test_the_player_shows_what_was_answered_last(dim: int, tmp_path: Path) -> None:
    jump = "const s = document.querySelector('.time'); s.value = 500; s.dispatchEvent(new Event('input'));"
    document = after(jump, simulation_page("page", record_of(dim)), tmp_path)
    assert "1.000 s</output>" in document
    assert ">replan 4: the motion goes on (a stop in time proven), 50 ms</p>" in document
