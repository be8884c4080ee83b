"""``tp.simulate``: the simulation of the command line, as an object."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.scenes import CART, COURSES, SHORT_ARM, TURN, toml

import tpbso_casadi as tp
from tpbso_casadi.cli.commands import simulate as command

SCENE = {"arm": SHORT_ARM, "task": TURN, "obstacles": [CART], "simulation": {"evaluations": 200} | COURSES}


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(toml(**SCENE))
    return path


@pytest.fixture(scope="module")
def simulated(scene: Path) -> tp.SimulationRun:
    return tp.simulate(scene, seconds=0.5, seed=3)


def test_it_is_what_the_command_simulates(scene: Path, simulated: tp.SimulationRun, tmp_path: Path) -> None:
    options = ["--seconds", "0.5", "--seed", "3", "--quiet", "--no-plots"]
    assert command.main([str(scene), *options, "--out", str(tmp_path / "command")]) == 0
    folder = simulated.save(tmp_path / "python", plots=False)
    for name in ("trajectory.csv", "obstacles.csv"):
        assert (folder / name).read_bytes() == (tmp_path / "command" / name).read_bytes()
    assert simulated.good
    assert simulated.faults == []
    assert simulated.duration == simulated.trajectory.duration == pytest.approx(0.5)
    assert repr(simulated) == "<simulation: 0.5 s, 5 replans, good>"
    assert simulated.scenario.solver.seed == 3


def test_figure_and_player_are_written_beside_it(simulated: tp.SimulationRun, tmp_path: Path) -> None:
    assert simulated.plot().axes
    folder = simulated.save(tmp_path / "drawn", figures=("svg",))
    assert {"simulation.svg", "simulation.html", "result.json", "replans.csv"} <= {p.name for p in folder.iterdir()}
    with pytest.raises(ValueError, match=r"^figures: there is no kind 'bmp'; there are "):
        simulated.save(tmp_path / "drawn", figures=("bmp",))


def test_who_listens_is_told_every_answer(scene: Path) -> None:
    scenarios: list[tp.Scenario] = []
    times: list[float] = []
    tp.simulate(scene, seconds=0.3, ready=scenarios.append, told=lambda replan: times.append(replan.time))
    assert [scenario.simulation is not None for scenario in scenarios] == [True]
    assert times == pytest.approx([0.0, 0.1, 0.2])


def test_what_is_wrong_is_named(scene: Path) -> None:
    with pytest.raises(tp.ScenarioError, match=r"^what: a scenario, its file \(.toml\), its name or a plan is needed"):
        tp.simulate(3)  # type: ignore[arg-type]
    with pytest.raises(tp.ScenarioError, match=r"^simulation.seconds: "):
        tp.simulate(scene, seconds=-1.0)
    with pytest.raises(TypeError, match=r"^told: a function is needed"):
        tp.simulate(scene, told=3)  # type: ignore[arg-type]
