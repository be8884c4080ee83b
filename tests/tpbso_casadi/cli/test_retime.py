"""``tpbso retime``: what it writes and says, payloads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.running import result_of, status

from tpbso_casadi.cli.commands import audit
from tpbso_casadi.cli.commands.retime import main

ARM = "[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = [2.0, 3.0]\nmax_acceleration = [10.0, 8.0]\n"
MOTORS = "link_masses = [2.0, 1.0]\nmax_torque = [18.0, 6.0]\n"
ROWS = np.array([[0.0, 0.5], [0.6, 0.9], [1.0, 0.2], [1.5, 0.4]])
DISC = "[[obstacles]]\ncenter = {}\nsemi_axes = [0.2, 0.2]\nvelocity = {}\n"


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("arm.toml").write_text(ARM)
    write_path(ROWS)


def write_path(rows: np.ndarray) -> None:
    np.savetxt("path.csv", rows, delimiter=",", header="q1,q2", comments="")


def run(*arguments: str) -> int:
    return status(main, *arguments, "--quiet")


@pytest.mark.usefixtures("only_the_path_is_drawn")
def test_a_run_folder_says_nothing_of_a_search_and_holds_figures_a_film_and_exports() -> None:
    options = ["--out", "out", "--animate", "out/film.html", "--export", "csv", "--export", "npz", "--rate", "50"]
    assert run("path.csv", "--robot", "arm.toml", *options) == 0
    names = {path.name for path in Path("out").iterdir()}
    expected = {"result.json", "trajectory.csv", "path.png", "film.html"}
    assert names == expected | {"joint_trajectory.csv", "joint_trajectory.npz"}
    assert audit.main(["out"]) == 0
    content = result_of("out")
    assert [content[key] for key in ("solver", "seed", "cost", "stop_reason")] == [None] * 4
    assert (content["evaluations"], content["iterations"]) == (0, 0)
    assert content["history"] == {"evaluations": [], "cost": []}
    assert content["objective"]["value"] == content["solution"]["breakpoints"][-1]
    assert {"polish", "retiming"}.isdisjoint(content)


def test_a_path_through_an_obstacle_is_written_and_not_certified(capfd: pytest.CaptureFixture[str]) -> None:
    Path("arm.toml").write_text(ARM + "[[obstacles]]\ncenter = [0.55, 0.75]\nsemi_axes = [0.1, 0.1]\n")
    assert run("path.csv", "--robot", "arm.toml", "--out", "out", "--no-plots") == 1
    assert "the path as it is cannot be run: its clearance" in capfd.readouterr().err
    assert result_of("out")["certificate"]["verdict"] == "violated"


def test_how_close_it_comes_to_what_moves_and_how_long_the_goal_is_clear_is_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_path(ROWS[:2])
    said = {}
    for name, velocity in {"comes": "[0.6, -0.3]", "leaves": "[-0.6, -0.2]", "creeps": "[0.0, 1e-6]"}.items():
        Path("robot.toml").write_text(ARM + DISC.format("[-1.0, 1.5]", velocity))
        assert status(main, "path.csv", "--robot", "robot.toml", "--no-plots", "--out", name) == 0
        lines = capsys.readouterr().out.splitlines()
        assert any(line.startswith("closest approach: ") for line in lines)
        [said[name]] = [line for line in lines if line.startswith("at the goal: ")]
    assert said["leaves"] == "at the goal: clear for ever"
    assert said["comes"].startswith("at the goal: clear until t = ")
    assert said["creeps"] == "at the goal: clear for 60 s, and no farther was looked"


SETTINGS = '[robot]\nmodel = "planar"\n[robot.settings]\npayload = { mass = 0.2 }\n' + (ARM + MOTORS).partition("\n")[2]
LOADED = {
    "loaded": ("path.csv", "--robot", "loaded.toml"),
    "setting": ("path.csv", "--robot", "settings.toml", "--payload", "0.4"),
    "run": ("empty", "--payload", "0.4"),
}
EMPTY = {
    "empty": ("path.csv", "--robot", "motors.toml"),
    "unset": ("path.csv", "--robot", "settings.toml", "--payload", "0.00"),
}


def test_torques_are_kept_with_what_the_tool_carries() -> None:
    write_path(ROWS[:3])
    Path("motors.toml").write_text(ARM + MOTORS)
    Path("loaded.toml").write_text(ARM + MOTORS + "payload = { mass = 0.4 }\n")
    Path("settings.toml").write_text(SETTINGS)
    for name, arguments in (EMPTY | LOADED).items():
        assert run(*arguments, "--out", name, "--no-plots") == 0
    empty, loaded = ([result_of(name)["objective"]["value"] for name in names] for names in (EMPTY, LOADED))
    assert empty == [empty[0]] * 2
    assert loaded == [pytest.approx(loaded[0], rel=1e-6)] * 3 and loaded[0] > empty[0]
    [row] = [row for row in result_of("loaded")["constraints"] if row["name"] == "torque"]
    assert row["satisfied"]
    assert 0.995 < abs(row["worst"] / row["bound"]) <= 1.0
    assert audit.main(["loaded"]) == 0
