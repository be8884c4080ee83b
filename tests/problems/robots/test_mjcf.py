"""MJCF: poses by hand and by MuJoCo, limits, masses, geometry, ties, keyframes, and one line for what is not read."""

from __future__ import annotations

import numpy as np
import pytest

from problems import InvalidProblem
from problems.base import FloatArray
from problems.robots import (
    BoxShape,
    CapsuleShape,
    CylinderShape,
    HullShape,
    MeshShape,
    SphereShape,
    Transform,
    document,
    read_urdf,
)
from problems.robots.mjcf import read_mjcf
from problems.robots.urdf_tree import RobotFile, Tree

ARM = """
<mujoco model="arm">
  <compiler autolimits="true"/>
  <default>
    <geom contype="0" conaffinity="0"/>
    <default class="arm">
      <joint axis="0 1 0" range="-90 90" damping="0.5"/>
      <motor ctrlrange="-10 12"/>
      <default class="solid"><geom contype="1" type="capsule" size="0.05"/></default>
    </default>
  </default>
  <asset>
    <material name="red" rgba="1 0 0 1"/>
    <mesh name="cap" file="cap.stl" scale="0.001 0.001 0.001" refpos="1 0 0"/>
  </asset>
  <worldbody>
    <body name="base" pos="0 0 0.5" childclass="arm">
      <geom type="box" size="0.1 0.2 0.3" material="red"/>
      <body name="upper" pos="0.1 0 0">
        <inertial pos="0 0 0.1" mass="2" diaginertia="0.1 0.1 0.01"/>
        <joint name="shoulder" axis="0 0 1" ref="90" pos="0.2 0 0"/>
        <geom class="solid" fromto="0 0 0 0 0 0.4"/>
        <body name="lower" pos="0 0 0.4" euler="0 0 90">
          <joint name="slide" type="slide" axis="2 0 0" range="0 0.3"/>
          <joint name="elbow" limited="false" actuatorfrcrange="-7 7"/>
          <geom class="solid" type="mesh" mesh="cap" pos="0 0 0.1"/>
          <site name="tcp" pos="0 0 0.2" axisangle="0 0 1 90"/>
          <body name="finger">
            <joint name="left_finger" type="slide" range="0 0.04"/><geom class="solid" type="sphere"/>
          </body>
          <body name="thumb"><joint name="right_finger" type="slide" range="0 0.04"/></body>
        </body>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="right_finger" joint2="left_finger" polycoef="0.01 -1 0 0 0"/></equality>
  <contact><exclude body1="base" body2="lower"/></contact>
  <actuator>
    <motor class="arm" joint="shoulder" gear="3"/>
    <position joint="slide" forcerange="-50 40"/>
  </actuator>
  <keyframe><key name="home" qpos="1 0.1 0.5 0.02 0.02"/></keyframe>
</mujoco>
"""


def file_of(text: str) -> RobotFile:
    return read_mjcf(document(text))


def poses(tree: Tree, values: dict[str, float]) -> dict[str, FloatArray]:
    """The poses (4, 4) of all links when joints have values, 0 where none is stated."""
    found = {"world": np.eye(4)}
    for joint in tree.below("world"):
        fixed = joint if joint.kind == "fixed" else joint.at(values.get(joint.name, 0.0))
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.array(fixed.origin.rotation), np.array(fixed.origin.translation)
        found[joint.child] = found[joint.parent] @ pose
    return found


def test_joints_move_bodies_as_computed_by_hand() -> None:
    """Where the shoulder is at its reference of 90 degrees the file's poses hold; at 180 it has turned by 90 more."""
    tree = file_of(ARM).tree
    still = poses(tree, {"shoulder": np.pi / 2})
    np.testing.assert_allclose(still["upper"][:3, 3], [0.1, 0.0, 0.5], atol=1e-15)
    np.testing.assert_allclose(still["tcp"][:3, 3], [0.1, 0.0, 1.1], atol=1e-15)
    moved = poses(tree, {"shoulder": np.pi, "slide": 0.2, "elbow": np.pi / 2})
    np.testing.assert_allclose(moved["upper"][:3, 3], [0.3, -0.2, 0.5], atol=1e-15)  # about (0.3, 0)
    np.testing.assert_allclose(moved["lower"][:3, 3], [0.1, -0.2, 0.9], atol=1e-15)  # slid by 0.2 along -x
    np.testing.assert_allclose(moved["tcp"][:3, 3], [-0.1, -0.2, 0.9], atol=1e-15)  # its z axis along -x


def test_limits_forces_and_friction_are_those_of_classes_and_actuators() -> None:
    joints = file_of(ARM).tree.joints
    assert joints["shoulder"].position == pytest.approx((-np.pi / 2, np.pi / 2))
    assert (joints["elbow"].kind, joints["elbow"].position) == ("continuous", None)
    assert (joints["slide"].kind, joints["slide"].position, joints["slide"].axis) == (
        "prismatic",
        (0.0, 0.3),
        (1, 0, 0),
    )
    assert [joints[name].effort for name in ("shoulder", "slide", "elbow", "left_finger")] == [30.0, 40.0, 7.0, None]
    assert joints["shoulder"].damping == 0.5 and joints["shoulder"].speed is None


def test_geometry_that_collides_is_told_from_what_is_shown() -> None:
    links = file_of(ARM).tree.links
    (shown,) = links["base"].visuals
    assert isinstance(shown.shape, BoxShape) and (shown.shape.sizes, shown.colour) == ((0.2, 0.4, 0.6), "#ff0000")
    assert not links["base"].shapes
    (capsule,) = links["upper"].shapes
    assert isinstance(capsule, CapsuleShape) and (capsule.radius, capsule.length) == (0.05, 0.4)
    assert capsule.pose.translation == (0.0, 0.0, 0.2)
    (mesh,) = links["lower"].shapes
    assert isinstance(mesh, MeshShape) and (mesh.file, mesh.scale) == ("cap.stl", (0.001, 0.001, 0.001))
    assert mesh.pose.translation == pytest.approx((-1.0, 0.0, 0.1))
    assert isinstance(links["finger"].shapes[0], SphereShape)


def test_the_arm_has_masses_postures_and_pairs_that_may_touch() -> None:
    arm = read_urdf(ARM, base_link="base")
    assert [joint.name for joint in arm.chain.joints] == ["shoulder", "slide", "elbow"]
    assert arm.chain.tip_link == "tcp" and arm.chain.name == "arm"
    assert arm.chain.joints[0].inertia is not None and arm.chain.joints[0].inertia.mass == 2.0
    assert dict(arm.postures) == {"home": (1.0, 0.1, 0.5)} and ("base", "lower") in arm.disabled
    assert dict(read_urdf(ARM, base_link="base", locked="home").locked)["left_finger"] == 0.02
    held = read_urdf(ARM, base_link="base", locked={"left_finger": 0.03})
    places = {frame.name: frame.pose.translation[1] for frame in held.links}
    assert places["finger"] == pytest.approx(0.03) and places["thumb"] == pytest.approx(0.01 - 0.03)


EVERYTHING = """
<mujoco>
  <compiler angle="{angle}" eulerseq="{order}"/>
  <worldbody>
    <frame pos="0.1 0.2 0.3" euler="{a} {b} {c}">
      <body name="one" pos="0 0.1 0" xyaxes="1 0.2 0 0 1 0.3">
        <inertial pos="0.1 0 0" mass="1" fullinertia="0.3 0.2 0.25 0.01 0.02 0.03" {turned}/>
        <joint name="a" axis="1 2 3" pos="0.1 0.2 0.3" ref="{a}"/>
        <joint name="b" axis="0 1 1" pos="-0.1 0 0"/>
        <geom type="box" size="0.1 0.2 0.3" fromto="0 0 0 0.2 0.1 0.4"/>
        <body name="two" pos="0.3 0 0" zaxis="1 1 0.5">
          <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
          <joint name="c" type="slide" axis="0 1 1" ref="0.1"/>
          <geom type="cylinder" size="0.1 0.2" axisangle="1 1 0 {b}"/>
          <geom type="ellipsoid" size="0.1 0.2 0.3"/>
          <site name="tip" pos="0 0 0.1" quat="2 1 0 0"/>
        </body>
      </body>
    </frame>
  </worldbody>
</mujoco>
"""


@pytest.mark.parametrize(("angle", "order"), [("degree", "xyz"), ("radian", "ZYX"), ("radian", "zxZ")])
def test_poses_are_those_of_mujoco(angle: str, order: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    a, b, c = np.array([0.3, -0.5, 0.7]) * (1.0 if angle == "radian" else 180.0 / np.pi)
    text = EVERYTHING.format(angle=angle, order=order, a=a, b=b, c=c, turned="")
    model, tree = mujoco.MjModel.from_xml_string(text), file_of(text).tree
    data = mujoco.MjData(model)
    for values in np.random.default_rng(0).uniform(-1.0, 1.0, (10, 3)):
        data.qpos[:] = values
        mujoco.mj_kinematics(model, data)
        ours = poses(tree, dict(zip("abc", values.tolist(), strict=True)))
        for name in ("one", "two"):
            np.testing.assert_allclose(ours[name][:3, :3], data.body(name).xmat.reshape(3, 3), atol=1e-12)
            np.testing.assert_allclose(ours[name][:3, 3], data.body(name).xpos, atol=1e-12)
        np.testing.assert_allclose(ours["tip"][:3, 3], data.site("tip").xpos, atol=1e-12)
    inertia = tree.links["one"].inertia
    assert inertia is not None
    np.testing.assert_allclose(
        np.linalg.eigvalsh(np.array(inertia.matrix)), np.sort(model.body("one").inertia), atol=1e-12
    )
    shapes = [*tree.links["one"].shapes, *tree.links["two"].shapes]
    assert [type(shape) for shape in shapes] == [BoxShape, CylinderShape, HullShape]
    for shape, pose, quaternion in zip(shapes, model.geom_pos, model.geom_quat, strict=True):
        np.testing.assert_allclose(shape.pose.translation, pose, atol=1e-12)
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, quaternion)
        np.testing.assert_allclose(np.array(shape.pose.rotation), turn.reshape(3, 3), atol=1e-12)


BODY = '<mujoco><worldbody><body name="a">{}</body></worldbody></mujoco>'


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<mujoco><include file='a.xml'/></mujoco>", "it includes other files"),
        ("<mujoco><worldbody><geom type='plane' size='1 1 1'/></worldbody></mujoco>", "of type 'plane' is not read"),
        (BODY.format("<geom type='cone' size='1'/>"), "of type 'cone'; there are sphere, capsule, cylinder"),
        (BODY.format("<geom type='mesh' mesh='b'/>"), "no mesh 'b' in <asset>"),
        (BODY.format("<geom type='box' size='1 1'/>"), "has 2 numbers, not 3"),
        (BODY.format("<geom size='-1'/>"), "size of a geom of type 'sphere' must be 1 lengths above 0 m"),
        (BODY.format("<geom class='b' size='1'/>"), "no default class 'b'; there are main"),
        (BODY.format("<joint type='screw'/>"), "type 'screw'; there are hinge, slide, ball and free"),
        (BODY.format("<joint name='j' range='2 1'/>"), "joint 'j': its range 2 to 1 is empty"),
        (BODY.format("<joint name='j' axis='0 0 0'/>"), "joint 'j': an axis is zero"),
        (BODY.format("<body name='a'/>"), "two bodies, sites or joints make a link 'a'"),
        (BODY.format("<replicate count='2'/>"), "<replicate> is not read: save the model as MuJoCo has compiled it"),
        (BODY.format("<inertial pos='0 0 0' mass='-1'/>"), "the mass of <inertial> must be from 0"),
        ("<mujoco><asset><mesh name='m' vertex='0 0 0'/></asset></mujoco>", "mesh 'm' of <asset> names no file"),
        ("<mujoco><asset><mesh file='m.stl' scale='0 1 1'/></asset></mujoco>", "three factors other than 0"),
        ("<mujoco><default><default><geom/></default></default></mujoco>", "a <default> within another one has no"),
        ("<mujoco><compiler eulerseq='abc'/><worldbody><body euler='1 0 0'/></worldbody></mujoco>", "eulerseq of"),
        (
            BODY.format("<joint name='j'/>").replace(
                "</mujoco>", "<equality><joint joint1='j' joint2='k' polycoef='0 1 1 0 0'/></equality></mujoco>"
            ),
            "joint 'j' follows 'k' along a curve",
        ),
        (
            BODY.format("<joint name='j'/>").replace(
                "</mujoco>", "<keyframe><key name='home' qpos='1 2'/></keyframe></mujoco>"
            ),
            "keyframe 'home': qpos of <key> has 2 numbers, not 1",
        ),
        ("<sdf/>", "its root is <sdf>, not <robot> or <mujoco>"),
    ],
)  # fmt: skip
def test_what_is_not_read_is_said(text: str, reason: str) -> None:
    with pytest.raises(InvalidProblem, match="urdf: ") as caught:
        file_of(text)
    assert reason in caught.value.reason and "\n" not in caught.value.reason


def test_several_joints_and_a_free_one_move_a_body() -> None:
    tree = file_of(
        BODY.format("<freejoint/><body name='b'><joint name='x'/><joint name='y' axis='1 0 0'/></body>")
    ).tree
    assert [(joint.name, joint.kind, joint.parent, joint.child) for joint in tree.joints.values()] == [
        ("a_joint", "floating", "world", "a"),
        ("x", "continuous", "a", "b_x"),
        ("y", "continuous", "b_x", "b"),
    ]
    assert tree.joints["x"].origin.translation == Transform().translation
