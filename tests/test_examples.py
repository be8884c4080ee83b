"""Every example is planned, certified, audited; what it is about is checked by plain NumPy."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import PPoly

from tpbso_casadi import parse_scenario
from tpbso_casadi.cli.commands import audit, retime, simulate, solve

EXAMPLES = Path(__file__).parent.parent / "examples"
LONG = {  # seconds to minutes
    *("cart", "circle-in-space", "crowded", "energy", "jerk-limited", "letter", "list-of-goals", "motors"),
    *("panda-cage", "panda-conveyor", "pareto", "payload", "pick-and-place", "pick-and-place-ur5e", "place-the-robot"),
}
SIMULATED = ("simulation-panda", "simulation-plane")
SCENARIOS = [
    pytest.param(path.stem, marks=[pytest.mark.slow] if path.stem in LONG else [])
    for path in sorted(EXAMPLES.glob("*.toml"))
    if path.stem not in ("arm", "moveit-cell") and path.stem not in SIMULATED
]
TIMES = 20_000
Motion = tuple[PPoly, dict[str, Any]]  # joint angles over time, and the content of result.json
Planned = Callable[[str], Path]


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Planned:
    """The run folder of an example, planned once."""

    @cache
    def plan(name: str) -> Path:
        folder = tmp_path_factory.mktemp("examples") / name
        search = [] if name == "retimed-csv" else ["--evaluations", "3000" if name in LONG else "500"]
        options = ["--quiet", "--no-plots", "--out", str(folder)]
        assert solve.main([str(EXAMPLES / f"{name}.toml"), *search, *options]) == 0
        return folder

    return plan


def motion_in(folder: Path) -> Motion:
    result = json.loads((folder / "result.json").read_text())
    pieces = folder / "motion.npz"  # of a sequence
    solution = np.load(pieces) if pieces.exists() else result["solution"]
    return PPoly(np.array(solution["coefficients"]), np.array(solution["breakpoints"])), result


@pytest.mark.parametrize("name", SCENARIOS)
def test_an_example_is_planned_and_audited(name: str, planned: Planned, capsys: pytest.CaptureFixture[str]) -> None:
    theta, result = motion_in(planned(name))
    robot = parse_scenario(result["scenario"]).criteria().robot
    limits = robot.limits
    times = np.linspace(*theta.x[[0, -1]], TIMES)
    for order, bounds in enumerate((limits.speed, limits.acceleration, limits.jerk), start=1):
        if bounds is not None:
            assert (np.abs(theta(times, order)) <= np.array(bounds) * (1.0 + 1e-9)).all()
    if limits.torque is not None:
        torques = np.array(robot.dynamics.torques(*(ca.DM(theta(times, order)) for order in range(3))))
        assert (np.abs(torques) <= np.array(limits.torque) * (1.0 + 1e-9)).all()
    task = result["scenario"]["task"]
    given = np.zeros((2, robot.dof))
    for order, key in enumerate(("start_velocity", "start_acceleration"), start=1):
        given[0] = 0.0 if task.get(key) is None else task[key]
        if order == 1 or given[0].any():
            assert theta(theta.x[[0, -1]], order) == pytest.approx(given, abs=1e-8)
    assert audit.main([str(planned(name))]) == 0
    assert "certified" in capsys.readouterr().out


def test_the_vias_are_passed_in_order(planned: Planned) -> None:
    theta, result = motion_in(planned("via-points"))
    lengths = np.array(result["scenario"]["arm"]["link_lengths"])

    def tip(postures: np.ndarray) -> np.ndarray:
        psi = np.cumsum(postures, axis=-1)
        return np.stack([np.cos(psi) @ lengths, np.sin(psi) @ lengths], axis=-1)

    nodes = theta(theta.x[:-1])
    at_point = np.hypot(*(tip(nodes) - [0.6, 0.5]).T)
    at_posture = np.abs(nodes - [1.4, 0.9, -0.4]).max(axis=1)
    assert at_point.min() < 1e-6
    assert at_posture.min() < 1e-6
    assert np.argmin(at_point) < np.argmin(at_posture)


def test_the_command_line_times_the_same_waypoints(tmp_path: Path, planned: Planned) -> None:
    waypoints = np.loadtxt(EXAMPLES / "waypoints.csv", delimiter=",", skiprows=1)
    arguments = [str(EXAMPLES / "waypoints.csv"), "--robot", str(EXAMPLES / "arm.toml"), "--out", str(tmp_path / "run")]
    assert retime.main([*arguments, "--quiet", "--no-plots"]) == 0
    theta, _ = motion_in(tmp_path / "run")
    scenario, _ = motion_in(planned("retimed-csv"))
    assert theta.x[-1] == pytest.approx(scenario.x[-1], rel=1e-9)
    nodes = theta(theta.x)
    assert all(np.abs(nodes - waypoint).max(axis=1).min() < 1e-9 for waypoint in waypoints)


@pytest.mark.slow
@pytest.mark.parametrize("name", SIMULATED)
def test_the_arm_touches_nothing_while_it_moves_among_what_moves(name: str, tmp_path: Path) -> None:
    options = ["--quiet", "--seconds", "3", "--out", str(tmp_path / "run")]
    assert simulate.main([str(EXAMPLES / f"{name}.toml"), *options]) == 0
    summary = json.loads((tmp_path / "run/result.json").read_text())["summary"]
    assert summary["collisions"] == summary["unproven"] == 0
    assert summary["new"] > 0
