"""SRDF: which joints a group plans, its named postures, which links may touch, and what is refused."""

from __future__ import annotations

import re

import pytest
from helpers.urdf import ARM

from problems.base import InvalidProblem
from problems.robots import RobotDescription, read_srdf, read_urdf

JOINTS = '<joint name="turn"/><joint name="slide"/>'
SIDE = """<link name="side"/><joint name="aside" type="revolute"><parent link="mast"/><child link="side"/>
<limit lower="-1" upper="1"/></joint></robot>"""


def group(content: str = JOINTS, name: str = "arm") -> str:
    return f'<group name="{name}">{content}</group>'


def tool(link: str, of: str = "") -> str:
    hand = '<group name="hand"><joint name="grip"/></group>'
    return f'{hand}<end_effector name="h" parent_link="{link}" group="hand" parent_group="{of}"/>'


FIXED = '<virtual_joint name="v" type="fixed"/>'
ALL = group('<group name="arm"/><group name="hand"/>', "all")


def state(name: str, of: str = "arm", **values: object) -> str:
    joints = "".join(f'<joint name="{joint}" value="{value}"/>' for joint, value in values.items())
    return f'<group_state name="{name}" group="{of}">{joints}</group_state>'


def read(srdf: str, *, of: str | None = None, urdf: str = ARM, **locked: float) -> RobotDescription:
    return read_urdf(urdf, None, None, locked, read_srdf(f"<robot>{srdf}</robot>"), of)


@pytest.mark.parametrize(
    ("srdf", "of", "ends", "joints"),
    [
        (group('<chain base_link="base" tip_link="plate"/>'), None, "base plate", "turn slide"),
        (group(), None, "world jib", "turn slide"),
        (group(JOINTS + '<link name="plate"/><link name="tool0"/>'), None, "world tool0", "turn slide"),
        (group('<link name="mast"/><link name="jib"/>'), "arm", "world jib", "turn slide"),
        (group('<joint name="turn"/>'), "arm", "world mast", "turn"),
        (group('<joint name="slide"/><joint name="screws"/>'), None, "mast jib", "slide"),
        (group() + tool("plate", of="arm"), None, "world plate", "turn slide"),
        (group() + tool("plate") + ALL, None, "world jib", "turn slide"),
        (group() + tool("plate") + ALL, "all", "world finger", "turn slide grip"),
        (group() + FIXED, None, "world jib", "turn slide"),
        (
            group(JOINTS + '<joint name="v"/>') + '<virtual_joint name="v" type="fixed"/>',
            None,
            "world jib",
            "turn slide",
        ),
        ("<group_state name='x' group='y'/>", None, "world tool0", "turn slide"),
    ],
)
def test_what_a_group_plans(srdf: str, of: str | None, ends: str, joints: str) -> None:
    chain = read(srdf, of=of).chain
    assert f"{chain.base_link} {chain.tip_link}" == ends
    assert " ".join(joint.name for joint in chain.joints) == joints


def test_a_tip_needs_no_group() -> None:
    srdf = group() + group('<joint name="slide"/>', "short") + state("up", turn=1, slide=0.3)
    description = read_urdf(ARM, tip_link="jib", srdf=read_srdf(f"<robot>{srdf}</robot>"))
    assert description.chain.tip_link == "jib" and description.postures == {"up": (1.0, 0.3)}


def test_joints_between_those_of_a_group_may_be_locked() -> None:
    chain = read(group('<joint name="turn"/><joint name="grip"/>'), slide=0.4).chain
    assert [joint.name for joint in chain.joints] == ["turn", "grip"]


@pytest.mark.parametrize(
    ("srdf", "of", "line"),
    [
        (group(), "leg", "group: the SRDF states no group 'leg'; there are arm"),
        ("<end_effector name='h' parent_link='plate'/>", "leg", "group: the SRDF states no group 'leg'"),
        (group() + group('<joint name="slide"/>', "short"), None, "group: must be stated, for there are arm, short"),
        (group('<joint name="flange"/>'), "arm", "group: 'arm' moves no joint"),
        (group('<joint name="knee"/>'), "arm", "group: 'arm': the URDF has no 'knee'"),
        (group('<link name="foot"/>'), "arm", "group: 'arm': the URDF has no 'foot'"),
        (group('<group name="leg"/>'), "arm", "group: 'leg' is not in the SRDF"),
        (group('<group name="arm"/>'), "arm", "group: 'arm' is part of itself"),
        (group('<joint name="slide"/><joint name="aside"/>'), "arm", "group: 'arm' is no chain: "),
        (group('<joint name="turn"/><joint name="grip"/>'), "arm", "group: 'slide' moves between its joints, and is "
            "none of 'arm'; locked = { slide = 0.0 } says where it stands"),
        (group(JOINTS + '<joint name="v"/>') + '<virtual_joint name="v" type="planar"/>', "arm",
            "group: 'arm' moves the base: virtual joint 'v' is planar; only fixed is"),
        (group('<chain base_link="base" tip_link="toe"/>'), "arm", "tip_link: no link 'toe' in the URDF"),
        (group() + group(), None, "srdf: two groups of one name"),
        (group('<joint/>'), None, "srdf: <joint> without 'name'"),
        (state("ready", turn="up"), None, "srdf: group_state 'ready': joint 'turn' is at 'up', which is no number"),
        ("<joint/>", None, "srdf: states nothing: no <group>, <group_state>, "),
        ("<group>", None, "srdf: no XML: "),
        ('<disable_collisions link1="a" link2="b"/>' * 100_001, None, "srdf: more than 100000 pairs"),
    ],
)  # fmt: skip
def test_what_is_refused(srdf: str, of: str | None, line: str) -> None:
    with pytest.raises(InvalidProblem, match=f"^{re.escape(line)}"):
        read(srdf, of=of, urdf=ARM.replace("</robot>", SIDE))


def test_named_postures_are_those_of_all_joints_and_of_the_group_first() -> None:
    states = state("up", turn=1, slide="0.5") + state("up", "other", slide=0.2, turn=2.0, grip=0.1)
    states += state("half", turn=1.0) + state("shut", "hand", grip=0.0) + state("wide", turn="1 2", slide=0.3)
    assert read(group() + states).postures == {"up": (1.0, 0.5)}
    assert read(states + state("far", "other", turn=0, slide=0.7)).postures == {"up": (2.0, 0.2), "far": (0.0, 0.7)}


def test_a_hand_is_held_in_its_named_posture() -> None:
    states = state("open", "hand", grip=0.02) + state("up", turn=1, slide=0.5)
    srdf = read_srdf(f"<robot>{group()}{states}</robot>")
    assert dict(read_urdf(ARM, locked="open", srdf=srdf).locked)["grip"] == 0.02
    for name, line in (
        ("shut", "locked: no posture 'shut'; there are open, up"),
        ("up", "locked: posture 'up' states no joint off the chain"),
    ):
        with pytest.raises(InvalidProblem, match=rf"^{line}$"):
            read_urdf(ARM, locked=name, srdf=srdf)
    with pytest.raises(InvalidProblem, match=r"^locked: no posture 'open'$"):
        read_urdf(ARM, tip_link="tool0", locked="open")


def test_links_that_may_touch() -> None:
    pairs = '<disable_collisions link1="mast" link2="jib" reason="Never"/><disable_default_collisions link="plate"/>'
    disabled = read(f'{pairs}<enable_collisions link1="jib" link2="plate"/>').disabled
    links = {"world", "base", "mast", "bolted", "jib", "tool0", "finger"}
    assert {*disabled} == {("mast", "jib"), *(("plate", link) for link in links - {"jib"})}


def test_a_base_that_may_move_is_noted() -> None:
    notes = read(group() + '<virtual_joint name="v" type="floating" parent_frame="w" child_link="world"/>').notes
    assert notes[-1] == "virtual joint 'v' is floating: the robot stands where base says"
