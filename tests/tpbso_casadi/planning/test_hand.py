"""Plans with constraints of a hand: in space, in the plane, by command; what is kept is measured again."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from benchmarks.hand_constraints import tilts

# postures of a Panda with the hand downward, on either side of a box; the straight way between them tips it over
START, GOAL = [-0.9, 0.3, 0.1, -2.0, 0.0, 2.3, 0.0], [1.0, 0.55, -0.2, -1.6, 0.1, 2.15, 1.5]
BOX = {"shape": "box", "center": [0.55, 0.0, 0.14], "size": [0.25, 0.08, 0.28]}
CELL: dict[str, Any] = {"start": {"joints": START}, "goal": {"joints": GOAL}, "obstacles": [BOX]}
TOLERANCE = 0.15


@cache
def free() -> tp.Plan:
    return tp.plan("panda", **CELL)


def verdict(plan: tp.Plan, name: str) -> tp.Verdict:
    return next(each for each in plan.verdicts if each.name == name)


def tool_speeds(plan: tp.Plan) -> np.ndarray:
    times = np.linspace(0.0, plan.duration, 20_001)
    robot = plan.motion.criteria.robot
    steps = np.diff(robot.tool.at(plan.trajectory(times))[0], axis=0)
    return np.linalg.norm(steps, axis=1) / np.diff(times)


def test_an_upright_move_in_space_needs_no_search() -> None:
    plan = tp.plan("panda", **CELL, constraints=[tp.Upright(tolerance=TOLERANCE)])
    assert tilts(free().trajectory).max() > TOLERANCE
    assert plan.certified and plan.search is not None and plan.search.evaluations == 0
    found = tilts(plan.trajectory).max()
    assert found <= TOLERANCE
    assert verdict(plan, "upright").worst == pytest.approx(found, abs=1e-5)
    assert plan.duration >= free().duration * (1.0 - 2e-3)


@pytest.mark.slow
def test_a_limit_of_the_tools_speed_holds_and_slows_the_motion_down() -> None:
    most = 0.5 * tool_speeds(free()).max()
    plan = tp.plan("panda", **CELL, constraints=[tp.ToolSpeed(max=most), tp.Upright(tolerance=TOLERANCE)])
    assert plan.certified and plan.search is not None and plan.search.evaluations == 0
    assert 0.97 * most < tool_speeds(plan).max() <= most * (1.0 + 1e-6)
    assert free().duration < plan.duration < 3.0 * free().duration


def test_the_orientation_and_the_place_of_a_tool_are_kept_to_a_degree() -> None:
    robot = tp.robot("panda").model
    [place], [rotation] = robot.tool.at(np.array([START]))
    above = tp.ToolRegion(point=(0.0, 0.0, float(place[2]) - 0.35), normal=(0.0, 0.0, 1.0))
    quaternion = tuple(Rotation.from_matrix(rotation.reshape(3, 3)).as_quat().tolist())
    goal = {"position": [float(place[0]), -float(place[1]), float(place[2])], "quaternion": list(quaternion)}
    kept = tp.ToolOrientation(quaternion=quaternion, tolerance=np.radians(1.0))
    plan = tp.plan("panda", start={"joints": START}, goal=goal, obstacles=[BOX], constraints=[kept, above])
    assert plan.certified and plan.search is not None and plan.search.evaluations == 0
    positions, rotations = robot.tool.at(plan.trajectory(np.linspace(0.0, plan.duration, 2000)))
    cosines = (np.einsum("nij,ij->n", rotations.reshape(-1, 3, 3), rotation.reshape(3, 3)) - 1.0) / 2.0
    assert cosines.min() >= np.cos(np.radians(1.0)) and positions[:, 2].min() >= place[2] - 0.35


def test_in_the_plane_the_last_link_points_where_it_should() -> None:
    arm = tp.robot([0.8, 0.7, 0.6], max_speed=2.0, max_acceleration=6.0)
    kept = tp.Upright(axis=(1.0, 0.0), toward=(0.0, 1.0), tolerance=0.4)
    ends = {"start": [0.9, 0.9], "goal": [-0.6, 1.2]}
    plan = tp.plan(arm, **ends, constraints=[kept], evaluations=600, seed=1)
    angles = plan.trajectory(np.linspace(0.0, plan.duration, 20_000)).sum(axis=1)
    away = np.abs((angles - np.pi / 2.0 + np.pi) % (2.0 * np.pi) - np.pi).max()
    assert plan.certified and away <= 0.4
    assert verdict(plan, "upright").worst == pytest.approx(away, abs=1e-5)
