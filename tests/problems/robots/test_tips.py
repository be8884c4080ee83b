"""Several arms of one URDF: joints on each other in a tree, planned together, kept apart from each other."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.core_robots import placed
from helpers.running import line_of

import tpbso_casadi as tp
from problems.certify import check_certificate as checker
from problems.robots import SpatialArm

JOINT = (
    '<joint name="{side}_{n}" type="revolute"><parent link="{parent}"/><child link="{side}_link_{n}"/>'
    '<origin xyz="{at}"/><axis xyz="{axis}"/><limit lower="-2.5" upper="2.5" velocity="2" effort="100"/></joint>'
    '<link name="{side}_link_{n}"><collision><origin xyz="0.15 0 0"/><geometry><box size="0.3 0.05 0.05"/></geometry>'
    '</collision><inertial><mass value="1"/><origin xyz="0.15 0 0"/>'
    '<inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)


def torso(sides: dict[str, float]) -> str:
    """A column that turns, with an arm of three joints on each side."""
    mass = '<inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    parts = [f'<robot name="torso"><link name="floor"/><link name="column">{mass}</link>']
    parts.append(
        '<joint name="turn" type="revolute"><parent link="floor"/><child link="column"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" velocity="1" effort="200"/></joint>'
    )
    for side, aside in sides.items():
        for n, axis in enumerate(("0 0 1", "0 0 1", "0 1 0"), start=1):
            parent, at = ("column", f"0 {aside} 0.5") if n == 1 else (f"{side}_link_{n - 1}", "0.3 0 0")
            parts.append(JOINT.format(side=side, n=n, parent=parent, at=at, axis=axis))
    return "".join([*parts, "</robot>"])


TIPS = {"left": "left_link_3", "right": "right_link_3"}
KEYS: dict[str, Any] = {"max_acceleration": 8.0, "max_jerk": 80.0}


@pytest.fixture
def two(in_an_empty_folder: None) -> tp.StatedRobot:
    Path("torso.urdf").write_text(torso({"left": 0.25, "right": -0.25}))
    return tp.robot("torso.urdf", tips=TIPS, **KEYS)


def test_joints_are_those_of_all_branches_in_turn(two: tp.StatedRobot) -> None:
    arm = two.model
    assert isinstance(arm, SpatialArm)
    assert arm.joints.names == ("turn", "left_1", "left_2", "left_3", "right_1", "right_2", "right_3")
    assert arm.chain.parents == (0, 1, 2, 3, 1, 5, 6)
    assert arm.chain.ends == ("left_link_3", "right_link_3")
    assert arm.chain.walk == (0, 1, 5, 6, 7, 6, 5, 1, 2, 3, 4)
    pairs = {frozenset((arm.cover.links[a].name[:5], arm.cover.links[b].name[:5])) for a, b in arm.cover.pairs}
    assert frozenset(("left_", "right")) in pairs
    assert arm.skeleton(np.zeros((1, 7)))[0, -1] == pytest.approx([0.6, 0.25, 0.5])


def test_arms_give_way_to_each_other(two: tp.StatedRobot) -> None:
    arm = two.model
    assert isinstance(arm, SpatialArm)
    start = [0.0, -0.9, 0.3, 0.0, -0.6, -0.3, 0.0]  # the left one points to the right, in front of the other
    goal = [0.0, 0.6, 0.3, 0.0, 0.9, -0.3, 0.0]
    plan = tp.plan(two, start=start, goal=goal)
    assert plan.certified
    theta = plan.trajectory.at(np.linspace(0.0, plan.duration, 200))
    turns, places = placed(arm, theta)
    boxes = []
    for side in ("left", "right"):
        bodies = [n for n, joint in enumerate(arm.chain.joints, start=1) if joint.name.startswith(side)]
        ends = [(places[:, body], places[:, body] + turns[:, body] @ [0.3, 0.0, 0.0]) for body in bodies]
        shares = np.linspace(0.0, 1.0, 25)[:, None, None]
        boxes.append(np.concatenate([start + shares * (end - start) for start, end in ends]))
    apart = np.linalg.norm(boxes[0][:, None] - boxes[1][None], axis=3).min(axis=(0, 1))
    assert apart.min() > 0.05  # middle lines of bars that are 0.05 m thick
    run = tp.read_run(plan.save("run", figures=("png",)))
    assert run.certified
    assert Path("run/path.png").exists()


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({"tips": {"left": "left_link_3", "right": "hand"}}, "tips: no link 'hand' in the URDF; there are"),
        ({"tips": {"left": "left_link_3", "elbow": "left_link_2"}}, "tips: no joint moves 'elbow' alone"),
        ({"tips": TIPS, "tip_link": "left_link_3"}, "tips: beside tip_link; one of both says what is planned"),
    ],
)
def test_what_is_no_set_of_tips(two: tp.StatedRobot, keys: dict[str, Any], line: str) -> None:
    assert line in line_of(lambda: tp.robot("torso.urdf", **keys, **KEYS))
    assert "tips: a robot that is built in has one" in line_of(lambda: tp.robot("panda", tips=TIPS).model)


def changed(content: Any, robot: str, change: Any) -> Any:
    """The content of a certificate in which a part of its robot is another one."""
    found = copy.deepcopy(content)
    part = found["stages"][0]["robot"]
    part[robot] = change(part[robot])
    return found


def test_the_checker_follows_branches(two: tp.StatedRobot, tmp_path: Path) -> None:
    arms = tp.robot("torso.urdf", tips=TIPS, max_torque=40.0, **KEYS)
    start, goal = [0.0, -0.9, 0.3, 0.0, -0.6, -0.3, 0.0], [0.0, 0.6, 0.3, 0.0, 0.9, -0.3, 0.0]
    plan = tp.plan(arms, start=start, goal=goal)
    content = checker.read(plan.certificate(tmp_path / "c.json"))
    assert content["stages"][0]["robot"]["parents"] == [0, 1, 2, 3, 1, 5, 6]
    checker.check(content)
    for part, change, line in (
        ("parents", lambda _: [0, 1, 2, 3, 4, 5, 6], "clearance of|torque of"),
        ("translations", lambda given: [*given[:4], [0.0, 0.05, 0.5], *given[5:]], "self clearance of"),
        ("limits", lambda given: [[*row[:3], 0.05 * row[3]] for row in given], "torque of"),
    ):
        with pytest.raises(checker.RefusedError, match=line):
            checker.check(changed(content, part, change))
    with pytest.raises(ValueError, match="parents: 0, the base, or a joint before"):
        checker.check(changed(content, "parents", lambda _: [0, 1, 2, 3, 6, 5, 6]))


SRDF = """<robot name="torso">
<group name="left"><chain base_link="column" tip_link="left_link_3"/></group>
<group name="right"><chain base_link="column" tip_link="right_link_3"/></group>
<group name="both"><group name="left"/><group name="right"/></group>
<group_state name="ready" group="left">
  <joint name="turn" value="0"/><joint name="left_1" value="0.1"/>
  <joint name="left_2" value="0.2"/><joint name="left_3" value="0.3"/>
</group_state>
<group_state name="ready" group="right">
  <joint name="right_1" value="-0.1"/><joint name="right_2" value="-0.2"/><joint name="right_3" value="0.3"/>
</group_state>
</robot>"""


def test_a_group_of_two_arms_and_its_posture(two: tp.StatedRobot) -> None:
    Path("torso.srdf").write_text(SRDF)
    both = tp.robot("torso.urdf", srdf="torso.srdf", group="both", **KEYS)
    assert both.model.chain.parents == two.model.chain.parents
    plan = tp.plan(both, start="ready", goal=[0.0, 0.6, 0.3, 0.0, 0.5, -0.3, 0.0])
    np.testing.assert_allclose(plan.trajectory(0.0), [0.0, 0.1, 0.2, 0.3, -0.1, -0.2, 0.3])
    one = tp.robot("torso.urdf", srdf="torso.srdf", group="right", **KEYS)
    assert one.model.joints.names == ("right_1", "right_2", "right_3")


BALL = tp.Sphere(center=(0.6, 0.85, 0.5), radius=0.04, name="ball")


def test_stages_by_arm(two: tp.StatedRobot, tmp_path: Path) -> None:
    """The column is locked, so that each joint moves one hand alone."""
    arms = tp.robot("torso.urdf", tips=TIPS, locked={"turn": 0.0}, max_torque=40.0, **KEYS)
    assert arms.model.arms == {"left": (0, 1, 2), "right": (3, 4, 5)}
    plan = tp.sequence(
        arms,
        start=[0.0] * 6,
        stages=[
            tp.MoveTo(tp.Joints((0.4, 0.3, 0.0)), arm="left"),
            tp.Attach(
                "ball", arm="right", body={"shape": "sphere", "center": [0.34, 0.0, 0.0], "radius": 0.02}, mass=0.5
            ),
            tp.MoveTo(tp.Joints((-0.4, 0.2, 0.0)), arm="right"),
            tp.Detach("ball"),
            tp.MoveTo({"left": {"joints": [0.0, 0.1, 0.0]}}),
        ],
    )
    assert plan.certified
    ends = [stage.trajectory.value_at_end() for stage in plan.stages if stage.trajectory is not None]
    np.testing.assert_allclose(ends[0], [0.4, 0.3, 0.0, 0.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(ends[1], [0.4, 0.3, 0.0, -0.4, 0.2, 0.0], atol=1e-9)
    np.testing.assert_allclose(ends[2][3:], [-0.4, 0.2, 0.0], atol=1e-9)
    held = plan.motion.stages[2].criteria
    assert held is not None
    robot = held.robot
    assert isinstance(robot, SpatialArm)
    (ball,) = (sphere for sphere in robot.spheres if sphere.name == "ball")
    assert ball.link == 6 and robot.chain.joints[5].inertia.mass == pytest.approx(1.5)  # type: ignore[union-attr]
    theta = np.array([[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]])
    assert robot.payload is None
    np.testing.assert_allclose(robot.tool.at(theta)[0], arms.model.at_tips["right"].tool.at(theta)[0])  # type: ignore[attr-defined]
    run = tp.read_run(plan.save(tmp_path / "run", figures=()))
    assert run.certified
    checker.check(checker.read(plan.certificate(tmp_path / "c.json")))


@pytest.mark.parametrize(
    ("stage", "line"),
    [
        (
            tp.MoveTo(tp.Joints((0.1, 0.2, 0.3)), arm="middle"),
            "stages[0] arm: no arm is called 'middle'; there are left, right",
        ),
        (tp.MoveTo([0.1, 0.2], arm="left"), "stages[0].goal: 2 numbers; 3 joint values are needed"),
        (tp.MoveTo({"joints": [0.1, 0.2]}, arm="left"), "stages[0] goal: 2 joints for an arm of 3"),
        (tp.MoveTo("up", arm="left"), "stages[0] goal: no posture 'up'"),
        (tp.Attach("ball", arm="middle"), "stages[0] arm: no arm is called 'middle'"),
    ],
)
def test_stages_of_no_arm(two: tp.StatedRobot, stage: Any, line: str) -> None:
    arms = tp.robot("torso.urdf", tips=TIPS, locked={"turn": 0.0}, **KEYS)
    last = tp.MoveTo([0.1] * 6)
    found = line_of(lambda: tp.sequence(arms, start=[0.0] * 6, stages=[stage, last], obstacles=[BALL]))
    assert found.startswith(line)
