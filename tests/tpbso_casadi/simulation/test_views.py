"""The figure and the player of a simulation."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from helpers.browser import fetched, opened
from helpers.simulation_records import EVERY, KINDS, record_of
from PIL import Image

from tpbso_casadi.animation.player import simulation_page
from tpbso_casadi.cli.commands.simulate import main
from tpbso_casadi.figures import style
from tpbso_casadi.figures.simulation import STYLES, draw_simulation, simulation_figure
from tpbso_casadi.replanning.candidates import Kind
from tpbso_casadi.simulation import MEANINGS, simulated_motion


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
    assert str(closest).startswith(f"closest: {1000.0 * least:.1f} mm at ")
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


def test_every_kind_of_answer_has_a_style_and_a_meaning() -> None:
    assert set(STYLES) == set(MEANINGS) == set(get_args(Kind))


@pytest.mark.parametrize("dim", [2, 3])
def test_the_figure_is_a_file(dim: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(style, "DPI", 40)
    [path] = draw_simulation(tmp_path, record_of(dim))
    with Image.open(path) as image:
        assert np.asarray(image.convert("L")).std() > 10.0
    assert [path.name for path in tmp_path.iterdir()] == ["simulation.png"]


@pytest.mark.parametrize("dim", [2, 3])
def test_the_player_says_what_was_answered_last(dim: int, tmp_path: Path) -> None:
    text = simulation_page("a <b>&</b> b", record_of(dim))
    assert fetched(text) == [] and "<title>a &lt;b&gt;" in text
    data = data_of(text)
    assert data["seconds"] == 2.0 and [time for time, _ in data["notes"]] == [EVERY * tick for tick in range(8)]
    assert (
        data["notes"][0][1] == "replan 0: a new motion (proven clear of the prediction, a stop in time proven), 10 ms"
    )
    assert data["notes"][6][1] == "replan 6: stops (nothing proven), 70 ms"
    jump = "const s = document.querySelector('.time'); s.value = 500; s.dispatchEvent(new Event('input'));"
    path = tmp_path / "page.html"
    path.write_text(f"{text}<script>{jump}</script>", encoding="utf-8")
    document = opened(path, tmp_path / "profile")
    assert "1.000 s</output>" in document
    assert ">replan 4: the motion goes on (a stop in time proven), 50 ms</p>" in document


def test_a_simulation_is_drawn_unless_it_must_not_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    scenario = Path(__file__).parents[3] / "examples" / "simulation-plane.toml"
    quick = [str(scenario), "--seconds", "0.3", "--evaluations", "200", "--quiet"]
    assert main([*quick, "--out", "drawn"]) == 0
    assert main([*quick, "--out", "bare", "--no-plots"]) == 0
    names = {folder: {path.name for path in Path(folder).iterdir()} for folder in ("drawn", "bare")}
    assert names["drawn"] - names["bare"] == {"simulation.png", "simulation.html"}
    assert set(json.loads(Path("drawn/result.json").read_text())["files"]) == names["drawn"] - {"result.json"}


def test_the_scene_keeps_its_place_where_nothing_had_to_stop() -> None:
    record = record_of(2)
    went_on = replace(record, replans=tuple(replan for replan in record.replans if replan.kind == "old"))
    heights = []
    for one in (record, went_on):
        figure = simulation_figure(one)
        figure.draw_without_rendering()
        heights.append([axes.get_position().height for axes in figure.axes])
    assert heights[1] == pytest.approx(heights[0], abs=0.03)
    assert heights[1][0] > 0.4
