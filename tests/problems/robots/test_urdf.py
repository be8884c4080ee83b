"""URDF: what becomes of it, against values computed by hand, and one line for each thing that cannot be read."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.urdf import ARM

from problems import InvalidProblem
from problems.robots import RobotDescription, read_urdf
from problems.robots.chain import JointKind


def crane(text: str = ARM, tip_link: str | None = "tool0") -> RobotDescription:
    return read_urdf(text, tip_link=tip_link)


def changed(old: str, new: str) -> str:
    assert old in ARM
    return ARM.replace(old, new)


# What is read


def test_joints_have_the_limits_of_the_file() -> None:
    turn, slide = crane().chain.joints
    assert turn.axis == (0.0, 0.0, 1.0)  # of length 1
    assert crane().notes == ("joint 'grip' is off the chain: locked at 0, its masses kept",)
    assert (turn.name, turn.link, turn.kind) == ("turn", "mast", JointKind.REVOLUTE)
    assert (turn.position, turn.speed, turn.effort, turn.damping, turn.friction) == ((-2.0, 2.5), 1.5, 40.0, 0.7, 0.2)
    assert (slide.kind, slide.position, slide.speed, slide.effort) == (JointKind.PRISMATIC, (0.1, 0.8), 0.5, 300.0)


def test_fixed_joints_are_folded() -> None:
    turn, slide = crane().chain.joints
    assert turn.pose.translation == (0.0, 0.0, 1.5)  # the stand's 1 m and its own 0.5 m
    assert slide.pose.translation == (0.3, 0.1, 0.0)
    assert slide.pose.rotation == ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))  # exactly: no cosine of 6e-17


def test_the_tool_is_where_it_was_computed_by_hand() -> None:
    arm = crane().arm(max_acceleration=1.0)
    position, rotation = arm.tool.pose(ca.DM([[np.pi / 2, 0.4]]))
    # before the turn: (0.3, 0.1 + 0.4, 0.2), because the slide's x is the mast's y; a quarter of a turn: (-y, x)
    assert np.array(position).ravel() == pytest.approx([-0.5, 0.3, 1.7])
    # the slide's frame is turned by another quarter: x = (-1, 0, 0); the tool is upside down: y = (0, 1, 0), z down
    assert np.array(rotation).reshape(3, 3) == pytest.approx(np.diag([-1.0, 1.0, -1.0]))


def test_masses_of_what_is_fixed_or_locked_are_kept() -> None:
    mast, jib = (joint.inertia for joint in crane().chain.joints)
    assert mast is not None and jib is not None
    assert mast.mass == 3.0  # with the bolted 1 kg at (0.3, 0, 0.5)
    assert mast.center == pytest.approx((0.5 / 3.0, 0.0, 0.5 / 3.0))
    # about that centre: 2 kg at (-1/15, 0, -1/6), 1 kg at (2/15, 0, 1/3)
    far = 2.0 * ((1 / 15) ** 2 + (1 / 6) ** 2) + (2 / 15) ** 2 + (1 / 3) ** 2
    assert mast.matrix[1][1] == pytest.approx(0.2 + far)
    assert mast.matrix[0][2] == pytest.approx(-(2.0 * (1 / 15) * (1 / 6) + (2 / 15) * (1 / 3)))
    assert (jib.mass, jib.center) == (0.5, (0.0, 0.0, pytest.approx(0.3)))  # the finger


def test_spheres_hold_the_collision_shapes() -> None:
    arm = crane()
    assert {sphere.name: sphere.link for sphere in arm.spheres} == {"mast": 1, "jib": 2}
    jib = arm.spheres[-1]
    assert (jib.center, jib.radius) == ((0.0, 0.0, 0.0), pytest.approx(0.06))
    heights = [sphere.center[2] for sphere in arm.spheres[:-1]]
    assert min(heights) > 0.0 and max(heights) < 0.4


def test_a_chain_may_begin_and_end_inside() -> None:
    description = read_urdf(ARM, base_link="base", tip_link="mast")
    assert [joint.name for joint in description.chain.joints] == ["turn"]
    assert description.chain.joints[0].pose.translation == (0.0, 0.0, 0.5)
    assert "joint 'slide' is off the chain: locked at 0.45, its masses kept" in description.notes


def test_without_a_tip_the_chain_goes_on_while_one_joint_moves() -> None:
    description = crane(ARM.replace('<joint name="grip" type="revolute">', '<joint name="grip" type="fixed">'), None)
    assert description.chain.tip_link == "tool0"
    assert description.notes[0] == "tip_link is not stated: 'tool0' is taken"


def test_a_fork_ends_the_chain() -> None:
    fingers = ARM.replace('link="tool0"', 'link="wrist"').replace('name="tool0"', 'name="wrist"')
    thumb = """<link name="thumb"/><joint name="grip2" type="revolute"><parent link="plate"/><child link="thumb"/>
      <axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""
    description = crane(fingers.replace("</robot>", thumb), None)
    assert [joint.name for joint in description.chain.joints] == ["turn", "slide"]
    assert description.chain.tip_link == "wrist"


def test_joints_that_turn_without_end_have_no_limits() -> None:
    text = changed('<joint name="turn" type="revolute">', '<joint name="turn" type="continuous">')
    assert crane(text).chain.joints[0].position is None
    low, high = crane(text).arm(max_acceleration=1.0).position_limits[0]  # type: ignore[index]
    assert high - low > 1000.0


def test_what_the_file_does_not_state_is_named() -> None:
    text = changed('<limit lower="-2" upper="2.5" velocity="1.5" effort="40"/>', "")
    assert crane(text).gaps == [f"no {what} stated for turn" for what in ("position limits", "velocity", "effort")]


def test_missing_inertias_and_meshes_are_named() -> None:
    text = changed('<sphere radius="0.06"/>', '<mesh filename="jib.stl"/>').replace('<mass value="0.5"/>', "")
    notes = crane(text).notes
    assert crane(text).unread == (("jib", "jib.stl"),)
    assert "no masses stated for jib: torques are unknown" in notes
    assert crane(text).chain.joints[1].inertia is None


# The robot to plan with


def test_limits_may_be_overridden() -> None:
    arm = crane().arm(max_speed=[1.0, 0.2], max_acceleration=3.0, max_jerk=50.0, position_limits=[(-1, 1), (0.2, 0.5)])
    assert arm.max_speed == (1.0, 0.2)
    assert (arm.max_acceleration, arm.max_jerk) == ((3.0, 3.0), (50.0, 50.0))
    assert arm.position_limits == ((-1.0, 1.0), (0.2, 0.5))
    assert arm.chain.joints[1].position == (0.2, 0.5)  # decides how far the slide's frame can be
    assert arm.reach() < crane().arm(max_acceleration=3.0).reach()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('velocity="1.5"', 'velocity="0"', "max_speed: missing: none is known for joint 'turn'"),
        ('lower="0.1" upper="0.8" ', "", "position_limits: missing: none are known for joint 'slide'"),
    ],
)
def test_what_is_not_known_has_to_be_stated(old: str, new: str, message: str) -> None:
    with pytest.raises(InvalidProblem, match=message):
        crane(changed(old, new)).arm(max_acceleration=1.0)
    with pytest.raises(InvalidProblem, match="max_acceleration: missing: none is known for joint 'turn'"):
        crane().arm()


@pytest.mark.parametrize("given", [{"max_speed": [1.0]}, {"max_jerk": [1.0] * 3}, {"position_limits": [(0.0, 1.0)]}])
def test_overrides_of_another_length(given: dict[str, list[float]]) -> None:
    with pytest.raises(InvalidProblem, match="for 2 joints"):
        crane().arm(max_acceleration=1.0, **given)  # type: ignore[arg-type]


# What cannot be read


TREE = [
    ('<child link="jib"/>', '<child link="nowhere"/>', "joint 'slide': no link 'nowhere' in the file"),
    ('<child link="finger"/>', '<child link="jib"/>', "link 'jib' hangs on two joints: a loop cannot be planned"),
    ('<parent link="world"/><child link="base"/>', '<parent link="tool0"/><child link="base"/>', "'base' is in a loop"),
    ('<link name="plate"/>', '<link name="jib"/>', "two links of one name"),
    ('name="screws"', 'name="turn"', "two joints of one name"),
    ('<link name="plate"/>', "<link/>", "<link> without 'name'"),
    ('<child link="jib"/>', "", "joint 'slide': no <child>"),
]
JOINTS = [
    ('name="slide" type="prismatic"', 'name="slide" type="helical"', "joint 'slide': type 'helical'; there are rev"),
    ('name="slide" type="prismatic"', 'name="slide" type="floating"', "joint 'slide' of the chain is floating, which"),
    ('name="slide" type="prismatic"', 'name="slide" type="planar"', "joint 'slide' of the chain is planar, which"),
    ('<axis xyz="1 0 0"/>', '<axis xyz="1 0 0"/><mimic joint="turn"/>', "joint 'slide' of the chain mimics 'turn'"),
    ('<axis xyz="1 0 0"/>', '<axis xyz="0 0 0"/>', "joint 'slide': its axis is zero"),
    ('lower="-2"', 'lower="3"', "joint 'turn': lower limit 3 is above upper limit 2.5"),
]
NUMBERS = [
    ('velocity="1.5"', 'velocity="fast"', "joint 'turn': velocity of <limit> is 'fast', which are no numbers"),
    ('velocity="1.5"', 'velocity="-1.5"', "joint 'turn': velocity of <limit> is -1.5, below 0"),
    ('effort="40"', 'effort="-40"', "joint 'turn': effort of <limit> is -40, below 0"),
    ('damping="0.7"', 'damping="-0.7"', "joint 'turn': damping of <dynamics> is -0.7, below 0"),
    ('friction="0.2"', 'friction="-1"', "joint 'turn': friction of <dynamics> is -1, below 0"),
    (
        '<geometry><sphere radius="0.06"/></geometry>',
        '<geometry><sphere radius="1"/>' + '<sphere radius="1"/>' * 1_000 + "</geometry>",
        "spheres cover its collision shapes, of at most 1000: give spheres",
    ),
    ('<axis xyz="1 0 0"/>', '<axis xyz="1 0"/>', "joint 'slide': xyz of <axis> has 2 numbers, not 3"),
    ('<origin xyz="0.3 0 0"/>', '<origin xyz="1e300 0 0"/>', "joint 'bolts': xyz of <origin> is 1e+300, out of range"),
    ('<mass value="2"/>', '<mass value="-2"/>', "link 'mast': a mass of -2 kg"),
    ('<sphere radius="0.06"/>', '<sphere radius="0"/>', "link 'jib': radius of <sphere> must be a length above 0 m"),
    ('<sphere radius="0.06"/>', '<box size="1 -1 1"/>', "link 'jib': size of <box> must be three lengths above 0 m"),
    ('<sphere radius="0.06"/>', "<cone/>", "link 'jib': a shape <cone>; there are box"),
]


@pytest.mark.parametrize(("old", "new", "message"), TREE + JOINTS + NUMBERS)
def test_what_cannot_be_is_named(old: str, new: str, message: str) -> None:
    with pytest.raises(InvalidProblem) as error:
        crane(changed(old, new))
    assert str(error.value).startswith("urdf: ")
    assert message in error.value.reason
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no XML: no element found"),
        ("<robot>", "no XML: no element found"),
        ("<sdf/>", "its root is <sdf>, not <robot>"),
        ("<robot/>", "no links"),
        ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro/></robot>', "a xacro file: let its name end"),
        ("<robot name='\ud800'/>", "no XML: 'utf-8' codec can't encode"),
        (f"<robot>{' ' * 10_000_000}</robot>", "10000015 characters, of at most 10000000"),
        ("<robot>" + '<link name="a"/>' * 1_001 + "</robot>", "more than 1000 links"),
    ],
)
def test_other_texts_are_refused(text: str, message: str) -> None:
    with pytest.raises(InvalidProblem, match=r"^urdf: ") as error:
        read_urdf(text)
    assert message in error.value.reason


def test_entities_are_refused_before_they_grow() -> None:
    laughs = "".join(f'<!ENTITY l{i + 1} "{f"&l{i};" * 10}">' for i in range(30))
    bomb = f'<!DOCTYPE robot [<!ENTITY l0 "ha">{laughs}]><robot name="&l30;"/>'
    with pytest.raises(InvalidProblem, match=r"a document type \(DOCTYPE\) is not read"):
        read_urdf(bomb)


def test_a_chain_may_not_be_endless() -> None:
    links = "".join(f'<link name="l{i}"/>' for i in range(60))
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/></joint>' for i in range(59)
    )
    with pytest.raises(InvalidProblem, match="59 joints in a chain, of at most 50"):
        read_urdf(f"<robot>{links}{joints}</robot>")


@pytest.mark.parametrize(
    ("base", "tip", "message"),
    [
        ("desk", None, "base_link: no link 'desk' in the URDF; there are world, base, mast"),
        (None, "hook", "tip_link: no link 'hook' in the URDF; there are world, base, mast"),
        ("jib", "mast", "tip_link: 'mast' is not carried by 'jib'"),
        (None, "base", "tip_link: no joint moves between 'world' and the tip"),
        ("plate", "plate", "tip_link: no joint moves between 'plate' and the tip"),
    ],
)
def test_links_that_make_no_chain(base: str | None, tip: str | None, message: str) -> None:
    with pytest.raises(InvalidProblem, match=message):
        read_urdf(ARM, base, tip)


def test_two_roots_need_a_base() -> None:
    text = ARM.replace("</robot>", '<link name="crate"/></robot>')
    with pytest.raises(InvalidProblem, match="base_link: must be stated: world, crate hang on nothing"):
        read_urdf(text)
    assert read_urdf(text, base_link="world", tip_link="tool0").chain.base_link == "world"


def test_a_fork_at_the_base_needs_a_tip() -> None:
    arms = "".join(
        f'<link name="{side}"/>'
        f'<joint name="{side}" type="continuous"><parent link="torso"/><child link="{side}"/></joint>'
        for side in ("left", "right")
    )
    listed = r"'left' \(1 joint: left\), 'right' \(1 joint: right\)"
    with pytest.raises(InvalidProblem, match=f"tip_link: must be stated, for several chains end at {listed}"):
        read_urdf(f'<robot><link name="torso"/>{arms}</robot>')
