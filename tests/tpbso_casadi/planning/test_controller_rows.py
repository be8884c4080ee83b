"""Rows for a controller: what it makes of them is proven, by the message alone and by splines of SciPy."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.space_scenarios import space_scenario
from scipy.interpolate import BPoly

import tpbso_casadi as tp
from problems import Trajectory
from tpbso_casadi.cli.commands import solve
from tpbso_casadi.planning import ControllerRows, JudgedMotion, PlannedMotion, plan
from tpbso_casadi.programs import exporter_at
from tpbso_casadi.scenario import parse_scenario


def export_plan(folder: Path, plan: PlannedMotion, kind: str, rate: float | None = None) -> Path:
    return exporter_at(kind, rate).program(plan).write(folder)[0]


JERK = 80.0
PANDA: dict[str, Any] = {
    "start": [0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8], "goal": [0.4, -0.5, 0.2, -2.0, 0.1, 1.9, 0.4],
    "obstacles": [tp.Box(center=(0.5, 0.3, 0.9), size=(0.1, 0.1, 0.1))],
}  # fmt: skip
HASTE = {"goal": {"joints": [0.4, 0.9, 0.5]}}


@cache
def panda() -> PlannedMotion:
    """With limits of jerk."""
    return tp.plan("panda", **PANDA).planned


@cache
def jerky() -> PlannedMotion:
    """Accelerations jump: nothing limits the jerk."""
    content = space_scenario(task=HASTE, obstacles=[], solver={"name": "direct", "evaluations": None})
    return plan(parse_scenario(content))


def joined_by_scipy(message: dict[str, Any]) -> tuple[BPoly, float]:
    """The spline through the rows of a message, and when it ends."""
    points = message["points"]
    stamps = [point["time_from_start"] for point in points]
    times = np.array([stamp["sec"] + 1e-9 * stamp["nanosec"] for stamp in stamps])
    kinds = [kind for kind in ("positions", "velocities", "accelerations") if points[0][kind]]
    return BPoly.from_derivatives(times, [[point[kind] for kind in kinds] for point in points]), times[-1]


@pytest.mark.parametrize("plan", [panda, jerky])
def test_the_message_is_a_motion_that_keeps_the_limits_and_is_as_fast(plan: Any, tmp_path: Path) -> None:
    planned, rows = plan(), plan().controller_rows
    assert planned.feasible
    assert rows.joined.feasible
    message = json.loads(export_plan(tmp_path, planned, "ros-json").read_text())
    assert len(message["points"]) == len(rows.times)
    spline, end = joined_by_scipy(message)
    assert planned.trajectory.duration <= end + 1e-9 <= planned.trajectory.duration * 1.0001
    times, limits = np.linspace(0.0, end, 20_001), planned.criteria.robot.limits
    for order, most in enumerate(limits.by_order, start=1):
        assert (np.abs(spline(times, order)) <= most * (1.0 + 1e-6)).all()
    np.testing.assert_allclose(spline(times), rows.joined.trajectory.at(times), atol=1e-9)
    np.testing.assert_allclose(spline(end), planned.trajectory.at(np.array([planned.trajectory.duration]))[0])
    np.testing.assert_allclose(spline(np.array([0.0, end]), 1), 0.0, atol=1e-12)


def test_accelerations_are_stated_where_they_do_not_jump() -> None:
    assert panda().controller_rows.accelerations
    assert panda().controller_rows.described.endswith("% slower than planned")
    assert not jerky().controller_rows.accelerations
    assert jerky().controller_rows.said.startswith("5 rows, joined by cubics, 1.9e-10 rad from the plan at most")
    assert jerky().controller_rows.said.endswith(": certified")


def test_what_is_read_back_is_certified(tmp_path: Path) -> None:
    file = export_plan(tmp_path, panda(), "ros-yaml")
    again = tp.certify(str(file), "panda", obstacles=PANDA["obstacles"])
    assert again.certified
    assert [verdict.status for verdict in again.verdicts].count(tp.CertificateStatus.CERTIFIED) == len(again.verdicts)


def test_rows_at_a_rate_are_judged_too(tmp_path: Path) -> None:
    """They exceed limits that change within a few milliseconds."""
    motion = panda().motion
    even = ControllerRows(
        motion, np.append(np.arange(0.0, motion.trajectory.duration, 0.01), motion.trajectory.duration)
    )
    again = tp.certify(str(export_plan(tmp_path, panda(), "ros-json", 100.0)), "panda", obstacles=PANDA["obstacles"])
    assert not even.joined.feasible
    assert even.joined.status is again.status
    assert even.said == f"{len(even.times)} rows, joined by quintics, 7.7e-06 rad from the plan at most: {again.status}"


def with_a_sliver(motion: JudgedMotion, length: float) -> JudgedMotion:
    """The same motion, with another row so much after one of its own."""
    trajectory = motion.trajectory
    cut = trajectory.breakpoints[len(trajectory.breakpoints) // 2] + length
    return replace(motion, trajectory=trajectory.part(0.0, cut).followed_by(trajectory.part(cut, trajectory.duration)))


@pytest.mark.parametrize("length", [3e-8, 1e-6])
def test_pieces_that_are_too_short_join_their_neighbours(length: float) -> None:
    motion = with_a_sliver(panda().motion, length)
    rows = ControllerRows.of(motion)
    assert len(rows.times) < len(motion.trajectory.breakpoints)
    assert rows.joined.feasible
    assert rows.time_scale < 1.0001
    naive = ControllerRows(motion, motion.trajectory.breakpoints)
    assert not naive.joined.feasible


def test_pieces_of_a_high_degree_are_cut_in_parts() -> None:
    """A move of degree 9, from rest to rest with no jerk at its ends: one quintic would be another motion."""
    robot = tp.robot([0.5, 0.4], max_speed=2.0, max_acceleration=9.0, max_jerk=JERK)
    shape = np.polynomial.Polynomial([0, 0, 0, 0, 0, 126, -420, 540, -315, 70]).coef  # of u, from 0 to 1
    way, seconds = np.array([1.0, -0.5]), 2.0
    powers = (shape / seconds ** np.arange(10))[:, None, None] * way
    motion = tp.certify(Trajectory(np.array([0.0, seconds]), powers[::-1]), robot).motion
    assert motion.feasible
    rows = ControllerRows.of(motion)
    assert rows.joined.feasible
    times = np.linspace(0.0, seconds, 2001)
    ends = ControllerRows(motion, motion.trajectory.breakpoints)
    off, coarse = (np.abs(each.joined.trajectory.at(times) - motion.trajectory.at(times)) for each in (rows, ends))
    assert coarse.max() > 1e-3
    assert off.max() < 1e-6


@pytest.mark.parametrize("most", [None, pytest.param(JERK, marks=pytest.mark.slow)])
def test_an_end_that_moves_is_as_fast_in_slower_rows(most: float | None, tmp_path: Path) -> None:
    """By the message alone; without what is added the slower motion would begin more slowly than the arm moves."""
    robot = tp.robot([0.5, 0.4], max_speed=2.0, max_acceleration=9.0, max_jerk=most)
    start, moving = tp.Joints((0.2, -0.3)), [0.3, -0.2]
    plan = tp.plan(robot, start=start, goal=tp.Joints((0.9, 0.4)), start_velocity=moving, obstacles=[], evaluations=200)
    rows = plan.controller_rows
    assert plan.certified
    assert rows.time_scale > 1.0
    assert rows.joined.feasible, rows.said
    spline, end = joined_by_scipy(json.loads(export_plan(tmp_path, plan.planned, "ros-json").read_text()))
    np.testing.assert_allclose(spline(0.0, 1), moving, atol=1e-12)
    times, limits = np.linspace(0.0, end, 20_001), plan.planned.criteria.robot.limits
    for order, bound in enumerate(limits.by_order, start=1):
        assert (np.abs(spline(times, order)) <= np.array(bound) * (1.0 + 1e-6)).all()


@pytest.mark.parametrize("positions", [[[0.0, 0.0], [1.0, 0.2]], [[0.0, 0.0], [0.1, 0.0]]])
def test_a_motion_that_is_not_proven_stays_as_it_is(positions: list[list[float]]) -> None:
    rest, robot = [[0.0, 0.0]] * 2, tp.robot([0.5, 0.4], max_speed=2.0, max_acceleration=9.0)
    rows = tp.certify(([0.0, 0.2], positions, rest, rest), robot).controller_rows
    assert not rows.joined.feasible
    assert rows.time_scale == 1.0
    assert rows.said.startswith("2 rows, joined by quintics") and rows.said.endswith(": violated")


def test_the_command_line_says_what_the_rows_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "run"
    options = ["time-3", "--evaluations", "300", "--no-plots", "--export", "ros-json", "--out", str(place)]
    assert solve.main(options) == 0
    said = capsys.readouterr().out
    count = len(json.loads((place / "joint_trajectory.json").read_text())["points"])
    assert f"joint_trajectory: {count} rows, joined by " in said
    assert "certified: what the controller's splines make of the rows" in said


@pytest.mark.parametrize("accuracy", [1e-6, 1e-3])
def test_rows_are_as_few_as_an_accuracy_needs(accuracy: float) -> None:
    """The motion cut in 400 pieces; what its rows are off is held against samples."""
    planned = panda().motion
    whole = planned.trajectory
    edges = np.union1d(whole.breakpoints, np.linspace(0.0, whole.duration, 400))
    cut = replace(planned, trajectory=whole.cut(edges))
    rows = ControllerRows.of(cut, accuracy)
    assert rows.joined.feasible
    assert len(rows.times) <= len(whole.breakpoints)
    times = np.linspace(0.0, rows.stamps[-1], 20_001)
    away = np.abs(rows.joined.trajectory.at(times) - rows.source.trajectory.at(times)).max(axis=0)
    assert (away <= rows.off).all() and (rows.off <= 1.001 * away + 1e-9).all()
    assert rows.off.max() <= accuracy * 1.01
