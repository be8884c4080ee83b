"""Vias, ends that move, obstacles that move and other objectives, all with all: certified and so, or not certified."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from helpers.core_robots import margins
from helpers.space import LENGTHS, TOOL
from oracles.space import tool_poses

import tpbso_casadi as tp
from problems import Joints, Position
from problems.robots import SpatialArm
from problems.scene import Ball, ConstantVelocity, MovingObstacle, Obstacle
from tpbso_casadi.facade.robots import StatedRobot

ROUNDING = 1.0 + 1e-9
TIMES = 2_000
LINK = """<link name="{name}"><inertial><mass value="2"/><origin xyz="0 0 0.1"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial></link>
"""
JOINT = """<joint name="joint_{i}" type="revolute"><parent link="link_{i}"/><child link="link_{next}"/>
<origin xyz="0 0 {length}"/><axis xyz="{axis}"/><limit lower="-2.8" upper="2.8" velocity="2" effort="200"/></joint>
"""
TIP = """<link name="hand"/><joint name="tip" type="fixed"><parent link="link_4"/><child link="hand"/>
<origin xyz="0 0 {length}"/></joint>
"""
SPHERES = """spheres = [
{ link = "link_0", center = [0.0, 0.0, 0.05], radius = 0.08 },
{ link = "link_2", center = [0.0, 0.0, 0.2], radius = 0.07 },
{ link = "link_4", center = [0.0, 0.0, 0.05], radius = 0.05 },
]
"""
START, GOAL = np.array([-0.6, 0.5, 0.1, 0.8]), np.array([0.6, 0.7, -0.2, 0.9])
POSTURE = np.array([0.1, 0.2, 0.0, 1.3])
PLACE = tool_poses(POSTURE[None])[0][0]
RUNNING = ConstantVelocity((1.0, 0.0, 0.0))
LEAVING, ARRIVING = (0.2, 0.1, -0.1, 0.0), (0.2, -0.1, 0.0, 0.1)
STILL = Ball(center=(0.42, -0.1, 0.72), radius=0.08)
MOVING = MovingObstacle(STILL, ConstantVelocity((0.0, 0.0, 0.25)))
ACROSS = MovingObstacle(Ball(center=(0.9, 0.5, 0.5), radius=0.08), ConstantVelocity((-0.3, 0.0, 0.1)))

VIAS: dict[str, tuple[Joints | Position, ...]] = {
    "no via": (),
    "posture": (Joints(tuple(POSTURE)),),
    "position": (Position(tuple(PLACE)),),
}
ENDS: dict[str, dict[str, Any]] = {"rests": {}, "moving": {"start_velocity": LEAVING, "goal_velocity": ARRIVING}}
SCENES: dict[str, tuple[Obstacle, ...]] = {"still": (STILL,), "moves": (MOVING,), "both": (STILL, ACROSS)}
OBJECTIVES: dict[str, Any] = {
    "time": "time",
    "energy": "energy",
    "length": "length",
    "sum": {"time": 1.0, "energy": 0.01},
}


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> StatedRobot:
    """The first four joints of the small arm, with masses."""
    folder = tmp_path_factory.mktemp("arm")
    links = [LINK.format(name=f"link_{i}") for i in range(5)]
    joints = [
        JOINT.format(i=i, next=i + 1, length=length, axis=("0 0 1", "0 1 0")[i % 2])
        for i, length in enumerate(LENGTHS[:4])
    ]
    text = "".join(["<robot name='small'>", *links, *joints, TIP.format(length=TOOL), "</robot>"])
    (folder / "arm.urdf").write_text(text)
    (folder / "spheres.toml").write_text(SPHERES)
    return tp.robot(folder / "arm.urdf", spheres=folder / "spheres.toml", max_acceleration=10.0, max_jerk=100.0)


def is_kept(plan: tp.Plan, robot: SpatialArm, task: dict[str, Any]) -> bool:
    """Limits, ends, vias and clearances at 2,000 times, by NumPy and SciPy."""
    trajectory = plan.trajectory
    times = np.linspace(0.0, trajectory.duration, TIMES)
    theta, ends = trajectory.at(times), times[[0, -1]]
    peaks = [np.abs(trajectory.at(times, order)).max() for order in (0, 1, 2, 3)]
    rooms_left = margins(robot, tuple(task["obstacles"]), theta, times)
    velocities = [task.get(key, np.zeros(4)) for key in ("start_velocity", "goal_velocity")]
    step = np.linalg.norm(np.diff(theta, axis=0), axis=1).max()  # the tool moves less, m
    away = [
        np.linalg.norm(theta - POSTURE if isinstance(via, Joints) else tool_poses(theta)[0] - PLACE, axis=1).min()
        for via in task["via"] or ()
    ]
    return (
        bool((np.array(peaks) <= ROUNDING * np.array([2.8, 2.0, 10.0, 100.0])).all())
        and np.allclose(theta[[0, -1]], [START, GOAL], atol=1e-9)
        and np.allclose(trajectory.at(ends, 1), velocities, atol=1e-8)
        and np.min(rooms_left) >= -1e-9
        and max(away, default=0.0) <= step
    )


def each_combination() -> list[Any]:
    """In the default run one obstacle moves; ends rest without a via and move past a posture; objectives take turns."""
    found = []
    for number, (via, ends, scene) in enumerate(product(VIAS, ENDS, SCENES)):
        for turn, objective in enumerate(OBJECTIVES):
            quick = (
                scene == "moves"
                and turn == number % len(OBJECTIVES)
                and via in ("no via", "posture")
                and (via == "no via") == (ends == "rests")
            )
            names = via, ends, scene, objective
            found.append(pytest.param(*names, marks=[] if quick else [pytest.mark.slow], id=", ".join(names)))
    return found


def planned(robot: StatedRobot, objective: str, task: dict[str, Any]) -> tp.Plan:
    return tp.plan(robot, start=START, goal=GOAL, objective=OBJECTIVES[objective], **task)


@pytest.mark.parametrize(("via", "ends", "scene", "objective"), each_combination())
def test_what_is_certified_is_so(robot: StatedRobot, via: str, ends: str, scene: str, objective: str) -> None:
    task = {"via": VIAS[via] or None, "obstacles": SCENES[scene], **ENDS[ends]}
    plan = planned(robot, objective, task)
    broken = [verdict for verdict in plan.verdicts if not verdict.satisfied]
    assert is_kept(plan, robot.model, task) if plan.certified else broken


def test_what_is_broken_is_seen(robot: StatedRobot) -> None:
    plan = planned(robot, "time", {})
    assert plan.certified
    nothing: dict[str, Any] = {"via": None, "obstacles": ()}
    assert is_kept(plan, robot.model, nothing)
    middle = tool_poses(plan.trajectory.at(np.array([plan.duration / 2.0])))[0][0]
    ahead = MovingObstacle(Ball(center=tuple(middle - [plan.duration / 2.0, 0.0, 0.0]), radius=0.05), RUNNING)
    for broken in ({"obstacles": (ahead,)}, {"via": VIAS["posture"]}, {"via": VIAS["position"]}, ENDS["moving"]):
        assert not is_kept(plan, robot.model, nothing | broken)


@pytest.mark.slow
def test_the_last_correction_of_a_via_leads_to_no_duration_far_off(robot: StatedRobot) -> None:
    durations = [
        planned(robot, "time", {"via": VIAS["posture"], "obstacles": SCENES["moves"], **each}).duration
        for each in ENDS.values()
    ]
    assert max(durations) < 1.1 * min(durations)
