"""A steady speed of the tool: timing of a path, where it is kept, what stands against it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from benchmarks.lines import tool
from problems import PlanarArm
from problems.motions import JointPath
from problems.timing import least_below, retime, retime_below

HOME = [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8]
ELBOW_OUT = [0.2, -1.4, 1.6, -1.6, -1.6, 0.3]


@pytest.mark.parametrize("jerk", [None, (300.0, 300.0)])
def test_a_turn_of_one_joint_is_as_if_that_joint_were_slower(jerk: Any) -> None:
    arm = PlanarArm((0.5, 0.5), (4.0, 4.0), (20.0, 20.0), max_jerk=jerk)
    path = JointPath.through(np.array([[0.0, 0.3], [1.0, 0.3]]))  # of a tool 0.98 m from the first joint
    reach = float(np.hypot(0.5 + 0.5 * np.cos(0.3), 0.5 * np.sin(0.3)))
    slower = PlanarArm((0.5, 0.5), (0.8 / reach, 4.0), (20.0, 20.0), max_jerk=jerk)
    duration = retime_below(path, arm, 0.8).duration
    assert duration == pytest.approx(retime(path, slower.limits).duration, rel=1e-5)
    assert 0.9 * duration < least_below(path, arm, 0.8) <= duration


def speeds_of(plan: tp.Plan, arm: str, since: float, until: float) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) and mean speeds between them, (n - 1,), from differences of kinematics in NumPy."""
    times = np.linspace(since, until, 2_001)
    places, _ = tool(tp.robot(arm).model, plan.trajectory.at(times))
    return places, np.linalg.norm(np.diff(places, axis=0), axis=1) / np.diff(times)


@pytest.mark.parametrize(
    ("arm", "start", "stage"),
    [
        ("panda", HOME, tp.Line(by=[0.0, 0.25, 0.1], tool_speed=0.1)),
        ("ur5e", ELBOW_OUT, tp.Line(by=[0.0, 0.25, 0.1], tool_speed={"speed": 0.1, "tolerance": 0.02})),
        ("panda", HOME, tp.Line([0.5, 0.1, 0.56], through=[0.5, 0.0, 0.56], tool_speed=0.15)),
    ],
)
def test_the_speed_is_kept_beyond_the_ends(arm: str, start: list[float], stage: tp.Line) -> None:
    plan = tp.sequence(tp.robot(arm), start=start, stages=[stage])
    assert plan.certified
    kept = plan.scenario.task.stages[0].tool_speed
    places, speeds = speeds_of(plan, arm, 0.0, plan.duration)
    away = np.minimum(*(np.linalg.norm(places - places[end], axis=1) for end in (0, -1)))
    beyond = np.minimum(away[1:], away[:-1]) > kept.at_ends
    assert kept.at_ends < 0.01
    assert beyond.mean() > 0.8
    assert (np.abs(speeds[beyond] / kept.speed - 1.0) <= kept.tolerance).all()
    assert speeds.max() <= kept.speed * (1.0 + kept.tolerance)
    (note,) = plan.motion.criteria.task.notes
    assert note.startswith(f"stage 1 (line): the tool keeps {kept.speed:g} m/s within")


def test_corners_may_be_slower_and_the_file_says_where(tmp_path: Any) -> None:
    corners = [[0.5, 0.0, 0.56], [0.5, 0.1, 0.56], [0.41, 0.1, 0.56]]
    plan = tp.sequence(tp.robot("panda"), start=HOME, stages=[tp.Along(corners, accuracy=0.005, tool_speed=0.3)])
    kept = plan.scenario.task.stages[0].tool_speed
    places, speeds = speeds_of(plan, "panda", 0.0, plan.duration)
    away = np.linalg.norm(places[:, None] - np.array([places[0], *corners]), axis=2)
    beyond = (away > [kept.at_ends, kept.at_corners, kept.at_corners, kept.at_ends]).all(axis=1)
    assert 0.002 < kept.at_corners < 0.03
    assert (speeds < kept.steady.least).any()
    assert (speeds[beyond[1:] & beyond[:-1]] >= kept.steady.least).all()
    again = tp.read_run(plan.save(tmp_path / "run", figures=()))
    assert again.certified
    assert again.scenario.task.stages[0].tool_speed == kept


LINE = {"kind": "line", "by": [0.0, 0.25, 0.1]}


@pytest.mark.parametrize(
    ("stated", "line"),
    [
        ({"tool_speed": 2.0}, "the way is too short or a limit too low: the tool comes to 1.0"),
        ({"tool_speed": {"speed": 0.1, "at_ends": 0.001}}, "at_ends = 0.001 m, and the limits need 0.0013"),
        (
            {"tool_speed": 0.9},
            "at_ends = 0.026. m, a tenth of the way where it is not stated, and the limits need 0.05",
        ),
        ({"tool_speed": 0.1, "max_speed": 0.12}, "the way is too short or a limit too low: the tool comes to 0.07"),
    ],
)
def test_what_the_limits_do_not_allow(stated: dict[str, Any], line: str) -> None:
    with pytest.raises(tp.ScenarioError, match=line):
        tp.sequence(tp.robot("panda"), start=[-0.45, *HOME[1:]], stages=[LINE | stated])


def test_where_a_joint_is_too_slow_for_it() -> None:
    stage = tp.Line(by=[0.0, 0.45, 0.0], max_speed=0.25, tool_speed=0.1)
    line = r"comes down to 0.0850[89] m/s, 0.1\d+ m along the way, where shoulder_pan_joint is at its limit of speed"
    with pytest.raises(tp.ScenarioError, match=line):
        tp.sequence(tp.robot("ur5e"), start=[-0.6, -1.9, 2.2, -1.9, -1.57, 0.3], stages=[stage])


@pytest.mark.parametrize(
    ("stated", "line"),
    [
        ({"tool_speed": 0.1, "max_tool_speed": 0.2}, "max_tool_speed: tool_speed says how fast the tool is"),
        ({"tool_speed": -0.1}, "tool_speed"),
        ({"tool_speed": {"speed": 0.1, "tolerance": 0.9}}, "tool_speed.tolerance"),
        ({"tool_speed": {"tolerance": 0.1}}, "tool_speed.speed"),
    ],
)
def test_wrong_tables(stated: dict[str, Any], line: str) -> None:
    with pytest.raises(tp.ScenarioError, match=line):
        tp.sequence(tp.robot("panda"), start=HOME, stages=[LINE | stated])
