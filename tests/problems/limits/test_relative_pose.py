"""Two arms hold one thing: the limit by other kinematics, what it takes from a start, what is refused, a plan."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.core_robots import placed
from helpers.running import line_of
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from problems import InvalidProblem
from problems.base import FloatArray
from problems.limits import RelativePose
from problems.motions import Trajectory
from problems.robots import SpatialArm, built_in, cell_of, complete_arm
from problems.robots.transform import FixedFrame
from problems.tasks import AtTips

TURNED = FixedFrame(((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)), (0.9, 0.0, 0.0))
HOME = np.array([1.2, -1.6, 1.9, -1.87, -1.57, 0.0])
START = np.concatenate([HOME, HOME + 0.1])


@pytest.fixture(scope="module")
def arms() -> SpatialArm:
    described = built_in("ur5e")
    one = complete_arm(described, described.arm())
    other = complete_arm(described, described.arm(base=TURNED))
    return cell_of({"left": one, "right": other})


def seen(arm: SpatialArm, theta: FloatArray) -> tuple[FloatArray, Rotation]:
    """The right tool in the frame of the left one, in postures (n, 12), by NumPy and SciPy."""
    turns, places = placed(arm, theta)
    found = []
    for name in ("left", "right"):
        tip = next(tip for tip in arm.chain.tips if tip.name == name)
        turn = turns[:, tip.body] @ np.array(tip.frame.rotation)
        found.append((places[:, tip.body] + turns[:, tip.body] @ np.array(tip.frame.translation), turn))
    (p, r), (q, s) = found
    return np.einsum("nij,ni->nj", r, q - p), Rotation.from_matrix(np.swapaxes(r, 1, 2) @ s)


def test_the_limit_is_the_distance_and_the_sine_of_the_angle(arms: SpatialArm) -> None:
    held = RelativePose(of="right", to="left").from_posture(arms, START)
    place, turn = seen(arms, START[None])
    np.testing.assert_allclose(held.position, place[0], atol=1e-12)
    assert (Rotation.from_quat(held.quaternion) * turn[0].inv()).magnitude() < 1e-9
    limit = held.for_robot(arms, ())
    theta = START + np.random.default_rng(3).uniform(-0.3, 0.3, (20, 12))
    places, turns = seen(arms, theta)
    angles = (turn[0].inv() * turns).magnitude()
    expected = np.column_stack([np.linalg.norm(places - place, axis=1), np.sin(angles), -np.cos(angles)])
    samples = Trajectory.from_pieces([1.0] * 20, [row[None] for row in theta]).samples(np.arange(20) + 0.5, arms)
    found = np.array(limit.function.at(samples))
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert limit.upper == (1e-3, np.sin(0.01), 0.0) and limit.in_core is not None


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({"of": "left", "to": "left"}, "to: 'left' is the same arm"),
        ({"position": (0.0, 0.0, 0.1)}, "quaternion: missing beside the other part of the pose"),
        ({"quaternion": (0.0, 0.0, 0.0, 1.0)}, "position: missing beside the other part of the pose"),
        ({"position": (0.0, 0.1), "quaternion": (0.0, 0.0, 0.0, 1.0)}, "position: 2 coordinates; arms are in space"),
        ({"position": (0.0, 0.1, 0.0), "quaternion": (0.0, 0.0, 1.0, 1.0)}, "quaternion: .* is not of length 1"),
        ({"accuracy": 0.0}, "accuracy: 0 is not within"),
    ],
)
def test_what_is_no_relative_pose(keys: dict[str, Any], line: str) -> None:
    with pytest.raises(InvalidProblem, match=f"^{line}"):
        RelativePose(**{"of": "right", "to": "left", **keys})


def test_arms_that_are_not_there(arms: SpatialArm) -> None:
    one = built_in("ur5e").arm()
    for robot, to, line in (
        (arms, "middle", "'relative pose': to: no arm is called 'middle'; there are left, right"),
        (one, "left", "'relative pose': of: no arm is called 'right'; there is one arm alone"),
    ):
        with pytest.raises(InvalidProblem, match=line):
            RelativePose(of="right", to=to).from_posture(robot, START)
    with pytest.raises(InvalidProblem, match="say position and quaternion, or joints at the start"):
        RelativePose(of="right", to="left").for_robot(arms, ())


def test_two_arms_carry_a_bar(arms: SpatialArm) -> None:
    base = {"position": [0.9, 0.0, 0.0], "quaternion": [0.0, 0.0, 1.0, 0.0]}
    cell = tp.cell({"left": tp.robot("ur5e"), "right": tp.robot("ur5e", base=base)})

    def held_at(y: float, z: float) -> AtTips:
        down = (1.0, 0.0, 0.0, 0.0)
        return AtTips(("left", "right"), tuple(tp.Pose((x, y, z), down) for x in (0.3, 0.6)))

    start, _ = held_at(0.3, 0.4).near(arms, np.concatenate([HOME, HOME - [2.4, 0.0, 0.0, 0.0, 0.0, 0.0]]))
    goal, _ = held_at(0.35, 0.55).near(arms, start)
    held = RelativePose(of="right", to="left")
    plan = tp.plan(cell, start=start, goal=goal, constraints=[held])
    assert plan.certified
    places, turns = seen(arms, plan.trajectory(np.linspace(0.0, plan.duration, 2_000)))
    assert np.linalg.norm(places - places[0], axis=1).max() < 1e-3
    assert (turns[0].inv() * turns).magnitude().max() < 0.01
    loose = tp.plan(cell, start=start, goal=goal).trajectory
    places, _ = seen(arms, loose(np.linspace(0.0, loose.duration, 200)))
    assert np.linalg.norm(places - places[0], axis=1).max() > 5e-3  # which is why it has to be stated
    goal[6] += 0.05
    line = line_of(lambda: tp.plan(cell, start=start, goal=goal, constraints=[held]))
    assert line == "goal: breaks 'relative pose', which is to hold from start to goal"
