"""Commands where obstacles move, or the robot itself when it is asked: judged by distances written out here."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal, result_of
from scipy.interpolate import PPoly

from tpbso_casadi.cli.commands import audit, compare, retime, solve
from tpbso_casadi.storage import read_run, sealed

ARM = """
[arm]
link_lengths = [0.7, 0.7, 0.6]
max_speed = 4.0
max_acceleration = 20.0
"""
MOVE = """
[task]
kind = "point-to-point"
start = [1.6, -0.6]
goal = [0.6, 1.6]
"""
PATH = """
[task]
kind = "path"
points = [[1.4, 0.0], [1.3, 0.4], [1.1, 0.7], [0.8, 1.0]]
accuracy = 0.02
"""
GIVEN = """
[task]
kind = "joint-path"
joints = [[-1.0, 0.5, 0.5], [0.0, 0.6, 0.3], [0.9, 0.8, 0.2]]
"""
DISC = """
[[obstacles]]
center = [1.9, 1.2]
semi_axes = [0.2, 0.2]
velocity = [-0.6, -0.2]
"""
CART = """
[[obstacles]]
shape = "box"
center = [0.0, 0.0]
size = [0.3, 0.2]
motion = "cart.csv"
margin_rate = 0.01
"""
TABLE = "t,x,y,angle\n0,2.0,0.2,0\n1,1.9,0.5,0.8\n3,1.8,0.9,1.6\n"
QUICK = ["--evaluations", "500", "--no-retime", "--no-plots", "--quiet"]
LINKS = np.array([0.7, 0.7, 0.6])


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("cart.csv").write_text(TABLE)


def scene(*parts: str, solver: str = "pso", model: str = "") -> str:
    Path("scene.toml").write_text("\n".join([*parts, model, f'[solver]\nname = "{solver}"\n']))
    return "scene.toml"


def nearest_to_disc(result: dict[str, Any], times: np.ndarray) -> float:
    """The least distance of the three links from the disc, which moves: of points along the links, m."""
    theta = PPoly(np.array(result["solution"]["coefficients"]), np.array(result["solution"]["breakpoints"]))
    angles = np.cumsum(theta(times), axis=1)
    joints = np.zeros((times.size, 4, 2))
    joints[:, 1:] = np.cumsum(LINKS[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=2), axis=1)
    shares = np.linspace(0.0, 1.0, 101)[:, None, None, None]
    points = joints[:, :-1] + shares * (joints[:, 1:] - joints[:, :-1])
    centers = np.array(result["scenario"]["obstacles"][0]["center"]) + times[:, None] * np.array([-0.6, -0.2])
    return float(np.linalg.norm(points - centers[:, None], axis=3).min()) - 0.2


FORMS = {
    "move": (MOVE, ""),
    "paper": (MOVE, '[model]\nmotion = "paper"\n'),
    "reduced": (MOVE, '[model]\nmotion = "paper"\nformulation = "reduced"\n'),
    "traced": (PATH, ""),
    "path, paper": (PATH, '[model]\nmotion = "paper"\n'),
    "path, reduced": (PATH, '[model]\nmotion = "paper"\nformulation = "reduced"\n'),
}


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["pso", "ipopt"])
@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_a_plane_motion_knows_the_time(form: str, solver: str) -> None:
    task, model = FORMS[form]
    limit = ["--iterations", "3"] if solver == "ipopt" else ["--evaluations", "500"]
    assert solve.main([scene(ARM, task, DISC, solver=solver, model=model), *limit, *QUICK[3:], "--out", "run"]) == 0
    result = result_of("run")
    last = result["solution"]["breakpoints"][-1]
    nearest = nearest_to_disc(result, np.linspace(0.0, last, 2001))
    assert nearest > 0.0
    assert result["closest_approach"]["distance"] == pytest.approx(nearest, abs=2e-3)
    assert result["at_goal"]["clear_until"] is None or result["at_goal"]["clear_until"] > last
    assert read_run(Path("run")).motion.feasible  # all is computed again


def test_a_given_path_is_judged_at_the_times_of_its_run(capfd: pytest.CaptureFixture[str]) -> None:
    """The same path with the same disc; nothing waits, so that where they meet it is said."""
    Path("scene.toml").write_text(ARM + GIVEN + DISC.replace("1.9, 1.2", "2.3, 1.4"))
    assert solve.main(["scene.toml", "--no-plots", "--quiet", "--out", "run"]) == 0
    result = result_of("run")
    last = result["solution"]["breakpoints"][-1]
    nearest = nearest_to_disc(result, np.linspace(0.0, last, 2001))
    assert result["closest_approach"]["distance"] == pytest.approx(nearest, abs=1e-3)
    assert audit.main(["run", "--json"]) == 0
    capfd.readouterr()
    # the disc is where the arm ends, at the time of its end
    meeting = DISC.replace("center = [1.9, 1.2]", f"center = [{0.5 + 0.6 * last}, {0.8 + 0.2 * last}]")
    Path("scene.toml").write_text(ARM + GIVEN + meeting)
    assert solve.main(["scene.toml", "--no-plots", "--quiet", "--out", "other"]) == 1
    assert "the path as it is cannot be run: its clearance is" in capfd.readouterr().err
    assert result_of("other")["at_goal"]["touched"]


@pytest.mark.slow
def test_retime_among_the_obstacles_of_a_robot_file() -> None:
    rows = "q1,q2,q3\n-1.0,0.5,0.5\n0.0,0.6,0.3\n0.9,0.8,0.2\n"
    Path("path.csv").write_text(rows)
    Path("robot.toml").write_text(ARM + DISC.replace("1.9, 1.2", "2.3, 1.4") + CART)
    Path("cart.csv").write_text("t,x,y,angle\n0,2.5,0.2,0\n1,2.4,0.5,0.8\n3,2.3,0.9,1.6\n")
    options = ["--robot", "robot.toml", "--no-plots", "--quiet"]
    assert retime.main(["path.csv", *options, "--out", "run"]) == 0
    result = result_of("run")
    assert [len(obstacle.get("motion_rows", [])) for obstacle in result["scenario"]["obstacles"]] == [0, 3]
    assert audit.main(["run"]) == 0
    assert retime.main(["run", "--no-plots", "--quiet", "--out", "again"]) == 0
    assert result_of("again")["scenario"]["obstacles"] == result["scenario"]["obstacles"]
    Path("cart.csv").write_text("t,x\n")
    assert retime.main(["path.csv", *options, "--out", "other"]) == 2


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run among a disc and a cart."""
    place = tmp_path_factory.mktemp("stored")
    (place / "cart.csv").write_text(TABLE)
    (place / "scene.toml").write_text(f'{ARM}{MOVE}stay = 0.3\n{DISC}{CART}[solver]\nname = "pso"\n')
    file, run = str(place / "scene.toml"), place / "run"
    assert solve.main([file, "--evaluations", "1500", *QUICK[3:], "--out", str(run)]) == 0
    return run


def edited(stored: Path, edit: Callable[[dict[str, Any]], object]) -> str:
    """A copy of the run as somebody would change it who computes its seal anew."""
    shutil.rmtree("edited", ignore_errors=True)
    shutil.copytree(stored, "edited")
    result = result_of("edited")
    edit(result)
    text = json.dumps(sealed({key: value for key, value in result.items() if key != "seal"}))
    Path("edited", "result.json").write_text(text)
    return "edited"


@pytest.mark.slow
def test_a_run_is_complete_without_its_table(stored: Path) -> None:
    shutil.copytree(stored, "moved")
    names = [verdict.name for verdict in read_run(Path("moved")).motion.verdicts]
    assert names[2:4] == ["clearance", "clearance at the goal"]


EDITS: dict[str, Callable[[dict[str, Any]], object]] = {
    "an angle": lambda r: r["scenario"]["obstacles"][1]["motion_rows"][1].__setitem__(3, 0.9),
    "rows that cannot be": lambda r: r["scenario"]["obstacles"][1]["motion_rows"].reverse(),
    "distance": lambda r: r["closest_approach"].update(distance=r["closest_approach"]["distance"] + 1e-4),
    "clear for longer": lambda r: r["at_goal"].update(clear_until=r["at_goal"]["clear_until"] + 0.1),
    "another key": lambda r: r["at_goal"].update(more=1),
}
MORE_EDITS: dict[str, Callable[[dict[str, Any]], object]] = {  # of the same kinds
    "velocity": lambda r: r["scenario"]["obstacles"][0].update(velocity=[-0.6, -0.21]),
    "no velocity": lambda r: r["scenario"]["obstacles"][0].pop("velocity"),
    "margin rate": lambda r: r["scenario"]["obstacles"][1].update(margin_rate=0.02),
    "a row": lambda r: r["scenario"]["obstacles"][1]["motion_rows"][1].__setitem__(1, 1.8),
    "no rows": lambda r: r["scenario"]["obstacles"][1].pop("motion_rows"),
    "stay": lambda r: r["scenario"]["task"].update(stay=0.0),
    "time": lambda r: r["closest_approach"].update(time=r["closest_approach"]["time"] + 0.01),
    "pair": lambda r: r["closest_approach"].update(pair="link 1, obstacle 2"),
    "clear for ever": lambda r: r["at_goal"].update(clear_until=None),
    "never touched": lambda r: r["at_goal"].update(touched=False),
}


@pytest.mark.parametrize("edits", [EDITS, pytest.param(MORE_EDITS, marks=pytest.mark.slow)], ids=["each kind", "more"])
def test_an_edited_run_is_refused(
    edits: dict[str, Callable[[dict[str, Any]], object]], stored: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for name, edit in edits.items():
        assert audit.main([edited(stored, edit)]) == 2, name
        [line] = capfd.readouterr().err.splitlines()
        assert line.startswith(f"error: {Path('edited', 'result.json')}: "), name


def test_nothing_is_invented_where_nothing_moves(stored: Path, capfd: pytest.CaptureFixture[str]) -> None:
    kept = result_of(str(stored))
    still = ARM + MOVE + DISC.replace("velocity = [-0.6, -0.2]", "")
    Path("scene.toml").write_text(f'{still}[solver]\nname = "pso"\n')
    assert solve.main(["scene.toml", *QUICK, "--out", "still"]) == 0
    assert "at_goal" not in result_of("still")
    assert audit.main([edited(Path("still"), lambda r: r.update(at_goal=kept["at_goal"]))]) == 2
    assert "touched': True} is stored, nothing is computed" in capfd.readouterr().err
    Path("scene.toml").write_text(f'{ARM}{MOVE}[solver]\nname = "pso"\n')
    assert solve.main(["scene.toml", *QUICK, "--out", "empty"]) == 0
    assert "closest_approach" not in result_of("empty")


def test_what_the_terminal_says(capsys: pytest.CaptureFixture[str]) -> None:
    Path("path.csv").write_text("q1,q2,q3\n-1.0,0.5,0.5\n0.9,0.8,0.2\n")
    said = {}
    discs = {"leaves": "[0.6, 0.2]", "comes": "[-0.6, -0.2]", "creeps": "[0.0, 1e-6]"}
    for name, velocity in discs.items():
        Path("robot.toml").write_text(ARM + DISC.replace("[-0.6, -0.2]", velocity).replace("1.9, 1.2", "-1.0, 1.5"))
        assert retime.main(["path.csv", "--robot", "robot.toml", "--no-plots", "--out", name]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert any(line.startswith("closest approach: ") for line in lines)
        [said[name]] = [line for line in lines if line.startswith("at the goal: ")]
    assert said["comes"] == "at the goal: clear for ever"  # it goes to the left
    assert said["leaves"].startswith("at the goal: clear until t = ")
    assert said["creeps"] == "at the goal: clear for 60 s, and no farther was looked"


def test_stay_belongs_to_moves_along_splines(capsys: pytest.CaptureFixture[str]) -> None:
    for lines, model, reason in (
        ("stay = 0.5", '[model]\nmotion = "paper"', "task.stay: needs motion = 'spline' in [model]"),
        ("stay = -0.5", "", "task.stay: "),
        ("stay = 0.5\ngoal_velocity = [0.1, 0.0, 0.0]", "", "task.stay: the robot does not stop at its goal"),
    ):
        file = scene(ARM, MOVE, lines, DISC, model=model)
        assert reason in refusal(capsys, solve.main, file, *QUICK)


@pytest.mark.slow
def test_solvers_are_compared_among_obstacles_that_move() -> None:
    file = scene(ARM, MOVE, DISC)
    options = ["--solvers", "pso,bso", "--seeds", "2", "--evaluations", "800", "--out", "campaign"]
    assert compare.main([file, *options]) == 0


VELOCITY, ACCELERATION = [1.5, 0.0, -0.8], [4.0, -2.0, 3.0]
LEAVING = f"""
[arm]
link_lengths = [0.7, 0.7, 0.6]
max_speed = 4.0
max_acceleration = 20.0
max_jerk = 400.0
[task]
kind = "point-to-point"
start = {{ joints = [-0.8, 0.6, 0.5] }}
goal = {{ joints = [0.8, 0.5, 0.6] }}
start_velocity = {VELOCITY}
start_acceleration = {ACCELERATION}
[[obstacles]]
center = [2.3, 1.2]
semi_axes = [0.15, 0.25]
velocity = [-0.3, 0.0]
[model]
samples = 20
[solver]
name = "pso"
evaluations = 500
"""


@pytest.fixture(scope="module")
def leaving(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("moving")
    (path / "moving.toml").write_text(LEAVING)
    assert solve.main([str(path / "moving.toml"), "--out", str(path / "run"), "--quiet", "--no-plots"]) == 0
    return path


def test_the_motion_leaves_as_the_robot_moves(leaving: Path) -> None:
    result = result_of(leaving / "run")
    solution = result["solution"]
    theta = PPoly(np.array(solution["coefficients"]), np.array(solution["breakpoints"]))
    assert [theta(0.0, order) for order in range(3)] == [
        pytest.approx(values, abs=1e-9) for values in ([-0.8, 0.6, 0.5], VELOCITY, ACCELERATION)
    ]
    assert theta(theta.x[-1]) == pytest.approx([0.8, 0.5, 0.6], abs=1e-9)
    times = np.linspace(0.0, theta.x[-1], 5000)
    for order, most in enumerate((4.0, 20.0, 400.0), start=1):
        assert np.abs(theta(times, order)).max() <= most
    assert result["feasible"]
    assert result.get("retiming") is None
    assert result["scenario"]["model"]["motion"] == "time-spline"
    assert "start acceleration" in [constraint["name"] for constraint in result["constraints"]]


def test_the_run_is_read_back_and_certified(leaving: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main([str(leaving / "run")]) == 0
    said = capsys.readouterr().out
    assert "certified" in said
    assert "fastest of its path" not in said


def test_a_changed_acceleration_is_found_out(leaving: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = leaving / "other"
    path.mkdir()
    result = result_of(leaving / "run")
    result["scenario"]["task"]["start_acceleration"] = [4.0, -2.0, 2.9]
    (path / "result.json").write_text(json.dumps(result))
    assert audit.main([str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_scenario_is_audited_too(leaving: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main([str(leaving / "moving.toml")]) == 0
    assert "no nonlinear program" in capsys.readouterr().out


def test_what_does_not_go_with_leaving_in_motion(leaving: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for options, expected in (
        (["--retime"], "model.retime: motion = 'time-spline' keeps the timing that is searched"),
        (["--within", "1"], "solver.within: this task has no nonlinear program to descend"),
        (["--solver", "ipopt"], "solver.name: this task has no nonlinear program to descend"),
        (["--motion", "spline"], "task.start_acceleration: needs motion = 'time-spline' in [model]"),
    ):
        assert expected in refusal(capsys, solve.main, str(leaving / "moving.toml"), "--no-plots", *options)
    assert retime.main([str(leaving / "run"), "--out", str(leaving / "timed")]) == 2
    assert "leaves with an acceleration" in capsys.readouterr().err
