"""Which own links need not keep apart: joined by a joint, or never parted by the one between them."""

from __future__ import annotations

import numpy as np
import pytest

from problems import InvalidProblem
from problems.geometry import Balls
from problems.robots import FixedFrame, SpatialArm, complete_arm, read_urdf
from problems.robots.arm_cover import CoveredLink
from problems.robots.chain import ChainJoint, JointKind, LinkFrame
from problems.robots.neighbours import are_never_parted, connected_links

FRAMES = (  # base - wall, base - j1 - plate (bare) - arm - bracket, arm - j2 - hub (bare) - hand
    LinkFrame("base", 0),
    LinkFrame("wall", 0, parent="base"),
    LinkFrame("plate", 1, parent="base"),
    LinkFrame("arm", 1, parent="plate"),
    LinkFrame("bracket", 1, parent="arm"),
    LinkFrame("hub", 2, parent="arm"),
    LinkFrame("hand", 2, parent="hub"),
    LinkFrame("part", 2),
)
PARENTS = (0, 1)


def named(*pairs: str) -> set[frozenset[str]]:
    return {frozenset(pair.split()) for pair in pairs}


@pytest.mark.parametrize(
    ("solid", "connected"),
    [
        ({"base", "wall", "arm", "bracket", "hand", "part"}, named("base arm", "arm hand")),  # by way of bare ones
        ({"wall", "arm", "hand"}, named("arm hand")),  # what is fixed beside a bare base is not
        ({"base", "hand"}, set()),  # two joints connect nothing
    ],
)
def test_a_joint_connects_links_by_way_of_bare_ones(solid: set[str], connected: set[frozenset[str]]) -> None:
    assert connected_links(FRAMES, PARENTS, solid) == connected


def balls(*places: tuple[float, float, float, float]) -> CoveredLink:
    return CoveredLink("link", 0, Balls(np.array(places)[:, :3], np.array(places)[:, 3]), 0.002)


HINGE = ChainJoint(name="hinge", link="link", pose=FixedFrame(translation=(0.0, 0.0, 0.5)), axis=(0.0, 0.0, 1.0))
RAIL = ChainJoint(name="rail", link="link", kind=JointKind.PRISMATIC, axis=(1.0, 0.0, 0.0))
HALF_RING = balls(*((0.2 * np.cos(a), 0.2 * np.sin(a), 0.5, 0.05) for a in np.arange(0.0, 3.3, 0.3)))
RING = balls(*((0.2 * np.cos(a), 0.2 * np.sin(a), 0.5, 0.05) for a in np.arange(0.0, 6.28, 0.3)))


@pytest.mark.parametrize(
    ("one", "two", "joint", "bounds", "never"),
    [
        (balls((0.0, 0.0, 0.45, 0.06)), balls((0.0, 0.0, 0.0, 0.01)), HINGE, (-9.0, 9.0), True),  # on the axis
        (RING, balls((0.2, 0.0, 0.0, 0.03)), HINGE, (-3.0, 3.0), True),  # all around it
        (RING, balls((0.32, 0.0, 0.0, 0.03)), HINGE, (-3.0, 3.0), False),  # beyond it
        (balls((0.2, 0.0, 0.5, 0.05)), balls((0.2, 0.0, 0.0, 0.05)), HINGE, (-0.4, 0.4), True),  # less than 0.5 rad
        (balls((0.2, 0.0, 0.5, 0.05)), balls((0.2, 0.0, 0.0, 0.05)), HINGE, (-0.6, 0.6), False),
        (HALF_RING, balls((0.2, 0.0, 0.0, 0.03)), HINGE, (0.0, 3.0), True),
        (HALF_RING, balls((0.2, 0.0, 0.0, 0.03)), HINGE, (0.0, 6.2), False),  # more than half a turn
        (HALF_RING, balls((0.2, 0.0, 0.0, 0.03)), HINGE, (3.2, 6.0), False),
        (balls((0.0, 0.0, 0.43, 0.06)), balls((0.0, 0.0, 0.0, 0.013)), HINGE, (-1.0, 1.0), False),  # by what sticks out
        (balls((0.0, 0.0, 0.0, 0.1)), balls((0.0, 0.0, 0.0, 0.1)), RAIL, (-0.18, 0.18), True),
        (balls((0.0, 0.0, 0.0, 0.1)), balls((0.0, 0.0, 0.0, 0.1)), RAIL, (-0.18, 0.21), False),
    ],
)
def test_what_the_joint_between_them_never_parts(
    one: CoveredLink, two: CoveredLink, joint: ChainJoint, bounds: tuple[float, float], never: bool
) -> None:
    assert are_never_parted(one, two, joint, bounds) is never


CELL = """<robot name="r"><link name="cart"><collision><geometry><box size="1 1 0.1"/></geometry></collision></link>
<link name="base"/><link name="rail"/>
<joint name="lift" type="prismatic"><parent link="cart"/><child link="rail"/><axis xyz="0 0 1"/>
  <limit lower="0.2" upper="0.6" velocity="1" effort="1"/></joint>
<joint name="on" type="fixed"><parent link="rail"/><child link="base"/><origin xyz="0.1 0 0" rpy="0 0 0.5"/></joint>
<link name="l1"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" velocity="2" effort="9"/>
  <safety_controller k_velocity="1" soft_lower_limit="-0.8"/></joint>
<link name="f0"/><link name="f1"/>
<link name="f2"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
<joint name="g0" type="revolute"><parent link="l1"/><child link="f0"/><axis xyz="0 0 1"/>
  <limit lower="0.1" upper="0.5" velocity="1" effort="1"/></joint>
<joint name="g1" type="revolute"><parent link="f0"/><child link="f1"/><axis xyz="0 0 1"/>
  <mimic joint="g0" multiplier="2" offset="0.1"/></joint>
<joint name="g2" type="prismatic"><parent link="f1"/><child link="f2"/><axis xyz="1 0 0"/>
  <mimic joint="g1" multiplier="-1"/></joint>
<link name="l2"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0 0 0.3"/>
  <limit lower="-1" upper="1" velocity="2" effort="9"/></joint></robot>"""
ROD = """<link name="rod"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
<joint name="m" type="revolute"><parent link="l1"/><child link="rod"/><mimic joint="j2"/></joint></robot>"""


def cell(text: str = CELL, locked: dict[str, float] | None = None, **keys: object) -> SpatialArm:
    description = read_urdf(text, "base", "l2", locked)
    return complete_arm(description, description.arm(max_acceleration=5.0), **keys)  # type: ignore[arg-type]


def test_what_is_above_the_base_stands_with_it_where_its_joints_usually_are() -> None:
    frames = {frame.name: frame for frame in read_urdf(CELL, "base", "l2").links}
    turned = np.array([[np.cos(0.5), np.sin(0.5)], [-np.sin(0.5), np.cos(0.5)]]) @ [-0.1, 0.0]
    assert frames["cart"].body == 0
    np.testing.assert_allclose(frames["cart"].pose.translation, [*turned, -0.4], atol=1e-12)
    assert "lift = 0.4" in " ".join(cell().left_out.others)
    assert not any("lift" in line for line in cell(locked={"lift": 0.3}).left_out.others)


@pytest.mark.parametrize(
    ("locked", "angle", "slid"), [({}, 1.0, -0.7), ({"g0": 0.5}, 1.6, -1.1), ({"g1": 0.0}, 0.3, 0.0)]
)
def test_what_mimics_a_mimic_follows(locked: dict[str, float], angle: float, slid: float) -> None:
    """At g0 = 0.3, g1 is 2 * 0.3 + 0.1 = 0.7 and g2 slides by -0.7 along an axis turned by 1."""
    frames = {frame.name: frame for frame in read_urdf(CELL, "base", "l2", locked).links}
    place = [slid * np.cos(angle), slid * np.sin(angle), 0.0]
    np.testing.assert_allclose(frames["f2"].pose.translation, place, atol=1e-12)


def test_what_follows_the_chain_is_refused_or_left_out_and_said() -> None:
    text = CELL.replace("</robot>", ROD)
    with pytest.raises(InvalidProblem, match=r"^urdf: link 'rod': joint 'm' moves it with 'j2', which is not planned"):
        cell(text)
    arm = cell(text, ignored=("rod",))
    assert "the geometry of rod, which is to be ignored" in arm.left_out.others
    assert "rod" not in {sphere.name for sphere in arm.spheres}
    appearances, notes = read_urdf(text, "base", "l2").new_appearances(lambda shape: b"")
    assert "rod" not in appearances and [(note.link, note.note) for note in notes] == [
        ("rod", "it moves with joint 'j2'")
    ]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('joint="g0"', 'joint="g9"', "joint 'g1' mimics 'g9', which is not in the file; state where it stands"),
        ('joint="g0"', 'joint="g2"', "joint 'g.' mimics itself, by way of others"),
        (' joint="g0"', "", "<mimic> without 'joint'"),
        ('multiplier="2"', 'multiplier="1e9"', "joint 'g1' would stand at 3e.08, as it mimics 'g0'"),
        ('<origin xyz="0 0 0.3"/>', '<origin quat_xyzw="0 0 0 0"/>', "quat_xyzw of <origin> is zero"),
        ('<origin xyz="0 0 0.3"/>', '<origin rpy="0 0 1" quat_xyzw="0 0 0 1"/>', "has both rpy and quat_xyzw"),
        ('<origin xyz="0 0 0.3"/>', '<origin xyz="0 0 1_0"/>', "xyz of <origin> is '0 0 1_0', which are no numbers"),
    ],
)
def test_what_cannot_be_is_named(old: str, new: str, message: str) -> None:
    assert old in CELL
    with pytest.raises(InvalidProblem, match=f"^urdf: .*{message}"):
        cell(CELL.replace(old, new))


def test_soft_limits_and_quaternions_are_read() -> None:
    assert cell().position_limits == ((-0.8, 1.0), (-1.0, 1.0))
    zeros = CELL.replace('soft_lower_limit="-0.8"', 'soft_lower_limit="0" soft_upper_limit="0"')
    assert cell(zeros).position_limits == ((-1.0, 1.0),) * 2  # they state nothing
    turned = read_urdf(CELL.replace('<origin xyz="0 0 0.3"/>', '<origin quat_xyzw="0 0 2 2"/>'), "base", "l2")
    np.testing.assert_allclose(turned.chain.joints[1].pose.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    assert any("soft limits bound j1" in note for note in turned.notes)


def test_any_pair_may_be_kept_but_one_on_a_body() -> None:
    assert "own links that a joint connects: l1 and l2" in cell().left_out.contacts
    kept = cell(kept=(("l1", "l2"),))
    assert not any("a joint connects" in line for line in kept.left_out.contacts)
    names = {frozenset((kept.spheres[a].name, kept.spheres[b].name)) for a, b in (*kept.kept_pairs, *kept.proven_pairs)}
    assert frozenset(("l1", "l2")) in names
    with pytest.raises(InvalidProblem, match=r"^kept_pairs: 'l1' and 'f2' are one body: no joint is between them"):
        cell(kept=(("l1", "f2"),))
