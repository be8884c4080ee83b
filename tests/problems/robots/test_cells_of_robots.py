"""Robots of a cell as one arm: names, places, masses, pairs, standing robots, and places by arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from problems import InvalidProblem, Joints
from problems.base import as_array
from problems.robots import FixedFrame, Payload, SpatialArm, built_in, cell_of, complete_arm, own_name
from problems.tasks import AtTips, Pose

TURNED = FixedFrame(((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)), (0.9, 0.0, 0.0))
PAYLOAD = Payload(mass=2.0, center=(0.0, 0.01, 0.05))


def one(name: str = "ur5e", **changes: Any) -> SpatialArm:
    described = built_in(name)
    return complete_arm(described, replace(described.arm(), **changes))


@pytest.fixture(scope="module")
def left() -> SpatialArm:
    return one(payload=PAYLOAD)


@pytest.fixture(scope="module")
def right() -> SpatialArm:
    return one(base_frame=TURNED)


@pytest.fixture(scope="module")
def both(left: SpatialArm, right: SpatialArm) -> SpatialArm:
    return cell_of({"left": left, "right": right})


POSTURE = np.array([0.3, -1.2, 1.4, -1.5, -1.3, 0.2])


def test_robots_move_as_each_alone(left: SpatialArm, right: SpatialArm, both: SpatialArm) -> None:
    theta = np.concatenate([POSTURE, POSTURE - 0.4])[None]
    assert both.arms == {"left": tuple(range(6)), "right": tuple(range(6, 12))}
    assert both.joints.names[6] == "right/shoulder_pan_joint"
    assert own_name(both.joints.names[6], "right") == right.joints.names[0]
    for name, arm, own in (("left", left, theta[:, :6]), ("right", right, theta[:, 6:])):
        for mine, alone in zip(both.at_tips[name].tool.at(theta), arm.tool.at(own), strict=True):
            np.testing.assert_allclose(mine, alone, atol=1e-12)
    points = both.skeleton(theta)[0]
    ends = [points[stroke][[0, -1]] for stroke in both.strokes]
    np.testing.assert_allclose(ends[0], [right.base, right.tool.at(theta[:, 6:])[0][0]], atol=1e-12)
    np.testing.assert_allclose(ends[1], [left.base, left.tool.at(theta[:, :6])[0][0]], atol=1e-12)


def test_torques_are_those_of_each_alone(left: SpatialArm, right: SpatialArm, both: SpatialArm) -> None:
    states = [np.concatenate([POSTURE + 0.1 * order, POSTURE - 0.2 * order])[None] for order in range(3)]
    together = as_array(both.dynamics.torques(*map(ca.DM, states)))
    for arm, own in ((left, slice(6)), (right, slice(6, 12))):
        alone = as_array(arm.dynamics.torques(*(ca.DM(state[:, own]) for state in states)))
        np.testing.assert_allclose(together[:, own], alone, atol=1e-9)


def test_every_link_of_one_robot_keeps_apart_from_every_link_of_the_other(left: SpatialArm, both: SpatialArm) -> None:
    assert both.cover is not None and left.cover is not None
    links = both.cover.links
    between = {
        frozenset((links[a].name, links[b].name)) for a, b in both.cover.pairs if links[a].name[:4] != links[b].name[:4]
    }
    count = len(left.cover.links)
    still = sum(link.body == 0 for link in left.cover.links)
    assert len(between) == count**2 - still**2
    assert len(both.cover.pairs) == 2 * len(left.cover.pairs) + len(between)
    excused = cell_of({"left": left, "right": replace(left, base_frame=TURNED)}, {}, [(links[-1].name, links[0].name)])
    assert len(excused.cover.pairs) == len(both.cover.pairs) - 1


def test_a_robot_that_stands_still_is_part_of_the_floor(left: SpatialArm, right: SpatialArm, both: SpatialArm) -> None:
    alone = cell_of({"left": left, "right": right}, {"right": POSTURE.tolist()})
    assert alone.dof == 6 and alone.arms == {"left": tuple(range(6))}
    assert dict(alone.locked)["right/elbow_joint"] == POSTURE[2]
    theta = np.concatenate([POSTURE, POSTURE])
    whole, own = both.positions(ca.DM(theta).T), alone.positions(ca.DM(POSTURE).T)
    for before, after in zip(both.bodies.each, alone.bodies.each, strict=True):
        assert before.name == after.name
        np.testing.assert_allclose(as_array(whole[before.start]), as_array(own[after.start]), atol=1e-9)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"gravity": (0.0, 0.0, -1.6)}, "right.gravity: another one than that of the other robots"),
        ({"max_jerk": (100.0,) * 6}, "left.max_jerk: missing: another robot has one"),
        ({"cover": None}, "right.spheres: balls stand for the links of this robot, covers for those of left"),
        ({"self_margin": 0.01}, "right.self_margin: another one"),
    ],
)
def test_robots_that_do_not_fit(left: SpatialArm, right: SpatialArm, change: dict[str, Any], line: str) -> None:
    with pytest.raises(InvalidProblem) as error:
        cell_of({"left": left, "right": replace(right, **change)})
    assert f"{error.value.field}: {error.value.reason}".startswith(line)


@pytest.mark.parametrize(
    ("made", "line"),
    [
        (lambda arms: cell_of(arms, {"right": [0.0]}), "right.stays_at: 1 values for 6 joints"),
        (lambda arms: cell_of(arms, dict.fromkeys(arms, [0.0] * 6)), "left.stays_at: no robot moves"),
        (
            lambda arms: cell_of(arms, {}, [("left/hand", "right/hand")]),
            "may_touch: no link 'left/hand'; there are left/",
        ),
    ],
)
def test_what_is_no_cell(
    left: SpatialArm, right: SpatialArm, made: Callable[[dict[str, SpatialArm]], SpatialArm], line: str
) -> None:
    with pytest.raises(InvalidProblem) as error:
        made({"left": left, "right": right})
    assert f"{error.value.field}: {error.value.reason}".startswith(line)


def test_torques_of_one_robot_alone_are_not_judged(left: SpatialArm, right: SpatialArm) -> None:
    cell = cell_of({"left": left, "right": replace(right, max_torque=None)})
    assert cell.max_torque is None
    assert "torques of left: those of another robot are not limited" in cell.unjudged


HALF_TURN = (1.0, 0.0, 0.0, 0.0)
POSES = AtTips(("left", "right"), (Pose((0.35, 0.3, 0.3), HALF_TURN), Pose((0.55, -0.3, 0.3), HALF_TURN)))


def test_a_pose_of_each_tip_has_postures_of_all_arms(both: SpatialArm) -> None:
    POSES.check(both, (), "goal")
    branches = POSES.branches(both, (), np.zeros(12), "goal")
    assert len(branches) > 3
    chosen = np.random.default_rng(0).uniform(-0.2, 0.2, (20, 12))
    theta, reached = branches[0].postures(both, chosen)
    assert reached.sum() > 10
    for name, place in zip(POSES.tips, POSES.places, strict=True):
        positions, rotations = both.at_tips[name].tool.at(theta[reached])
        np.testing.assert_allclose(positions, np.tile(place.point, (reached.sum(), 1)), atol=1e-8)
        np.testing.assert_allclose(rotations, np.tile(place.rotation, (reached.sum(), 1, 1)), atol=1e-7)
    symbolic, missed = branches[0].posture(both, ca.DM(chosen[0]), 1.0, None)
    assert float(missed) <= 1.0
    np.testing.assert_allclose(as_array(branches[0].miss(both, symbolic)), 0.0, atol=1e-8)


def test_joints_of_one_arm_beside_a_pose_of_the_other(both: SpatialArm) -> None:
    place = AtTips(("left", "right"), (Joints(tuple(POSTURE)), POSES.places[1]))
    place.check(both, (), "goal")
    theta = place.branches(both, (), None, "goal")[0].projected(both, np.concatenate([POSTURE, POSTURE]))
    np.testing.assert_allclose(theta[:6], POSTURE)
    assert place.is_at(both, theta)
    assert place.table() == {"left": {"joints": POSTURE.tolist()}, "right": POSES.places[1].table()}


@pytest.mark.parametrize(
    ("place", "line"),
    [
        (AtTips(("left",), (POSES.places[0],)), "places of left for a robot with the tips left, right"),
        (AtTips(POSES.tips, (Joints((0.0,)), POSES.places[1])), "left: 1 joints for an arm of 6"),
        (AtTips(POSES.tips, (Joints((9.0,) * 6), POSES.places[1])), "left: left/shoulder_pan_joint: 9 is not within"),
        (AtTips(POSES.tips, (Pose((9.0, 0.0, 0.0)), POSES.places[1])), "left: (9.0, 0.0, 0.0) is 9 m from the base"),
    ],
)
def test_places_that_are_none(both: SpatialArm, place: AtTips, line: str) -> None:
    with pytest.raises(InvalidProblem) as error:
        place.check(both, (), "goal")
    assert error.value.reason.startswith(line)
    with pytest.raises(InvalidProblem, match="places of several arms are not for SpatialArm with one"):
        POSES.check(one(), (), "goal")
