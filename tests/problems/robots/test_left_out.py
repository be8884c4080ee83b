"""What a verdict does not speak of is said, or refused: geometry that is not read, not stated, held, or ignored."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems import InvalidProblem
from problems.robots import BoxShape, RobotDescription, SpatialArm, complete_arm, read_spheres, read_urdf
from problems.robots.link_covers import fine_balls, overhang_of

BOX, MESH = '<box size="0.1 0.1 0.1"/>', '<mesh filename="wall.stl"/>'
LIMIT = '<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="2" effort="9"/>'


def link(name: str, *shapes: str, more: str = "") -> str:
    parts = "".join(f"<collision><geometry>{shape}</geometry></collision>" for shape in shapes)
    return f'<link name="{name}">{parts}{more}</link>'


def joint(name: str, parent: str, child: str, kind: str = "revolute", more: str = LIMIT) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 0.3"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{more}</joint>'


def described(*parts: str, l2: str = "", base: str = "", locked: dict[str, float] | None = None) -> RobotDescription:
    """A base, and links l1 and l2 with boxes, unless something else is stated."""
    links = [base or link("base"), link("l1", BOX), l2 or link("l2", BOX)]
    joints = [joint("j1", "base", "l1"), joint("j2", "l1", "l2")]
    return read_urdf(f'<robot name="r">{"".join([*links, *joints, *parts])}</robot>', "base", "l2", locked)


def completed(description: RobotDescription, **keys: object) -> SpatialArm:
    arm = complete_arm(description, description.arm(max_acceleration=5.0), **keys)  # type: ignore[arg-type]
    return replace(arm, self_collision=True)


def said(description: RobotDescription, **keys: object) -> str:
    return " / ".join(completed(description, **keys).unjudged)


def test_a_mesh_is_not_read_because_a_box_beside_it_is() -> None:
    assert "base, which stands still: its mesh wall.stl is not read" in said(described(base=link("base", BOX, MESH)))
    with pytest.raises(InvalidProblem, match=r"^urdf: link 'l2': its mesh wall.stl is not read"):
        completed(described(l2=link("l2", BOX, MESH)))


def test_what_a_spheres_file_leaves_out_is_said() -> None:
    description = described(link("bracket", BOX), joint("f", "l2", "bracket", "fixed", ""))
    spheres = "\n".join(f'[[spheres]]\nlink = "{name}"\ncenter = [0, 0, 0]\nradius = 0.1' for name in ("l1", "l2"))
    stated = description.with_spheres(read_spheres(spheres, description.links))
    assert "the collision geometry of bracket: the spheres leave it out" in said(stated)
    assert "leave it out" not in said(description) and "leave it out" not in said(stated, ignored=("bracket",))


ROD = (link("rod", BOX), joint("m", "l1", "rod", more=LIMIT + '<mimic joint="j2"/>'))


def test_what_follows_the_chain_cannot_be_locked() -> None:
    with pytest.raises(InvalidProblem, match=r"^locked: m mimics j2, which is planned: lock j2, or neither"):
        described(*ROD, locked={"m": 0.5})
    tree = described(*ROD, l2=link("l2", BOX, more=""), locked={"m": 0.5, "j2": 0.1})
    assert [joint.name for joint in tree.chain.joints] == ["j1"]


def test_a_base_that_follows_the_chain_is_refused() -> None:
    up = joint("up", "world", "base", "prismatic", LIMIT + '<mimic joint="j1"/>')
    with pytest.raises(
        InvalidProblem, match=r"^base_link: 'base' itself moves with 'j1' of the chain, which joint 'up'"
    ):
        described(link("world"), up)


def test_own_links_that_nobody_compares_are_said() -> None:
    arm = completed(described())
    assert "own links that a joint connects: l1 and l2" in arm.unjudged
    assert "own links from each other: self_collision is off" in replace(arm, self_collision=False).unjudged


def test_what_is_ignored_connects_nothing() -> None:
    """A bridge between two links stays between them."""
    bridge = (
        link("bridge", BOX),
        joint("f", "l1", "bridge", "fixed", ""),
        link("l3", BOX),
        joint("j3", "bridge", "l3"),
    )
    text = f'<robot name="r">{link("base")}{link("l1", BOX)}{joint("j1", "base", "l1")}{"".join(bridge)}</robot>'
    arm = completed(read_urdf(text, "base", "l3"), ignored=("bridge",))
    assert not any("a joint connects" in line for line in arm.unjudged)
    pairs = {frozenset((arm.spheres[a].name, arm.spheres[b].name)) for a, b in (*arm.kept_pairs, *arm.proven_pairs)}
    assert frozenset(("l1", "l3")) in pairs


@pytest.mark.parametrize(
    ("kind", "more", "line"),
    [
        ("revolute", LIMIT, "joints off the chain elsewhere than at a = 0: say where they are by locked"),
        ("revolute", LIMIT.replace('lower="-2"', 'lower="1"'), "elsewhere than at a = 1.5: say"),
        ("revolute", LIMIT.replace('lower="-2"', 'lower="2"'), "elsewhere than at a = 2: say"),
        ("floating", '<limit lower="0.5" upper="1.5"/>', "what a carry, elsewhere than at the joint's origin"),
    ],
)
def test_where_joints_off_the_chain_are_taken_to_be_is_said(kind: str, more: str, line: str) -> None:
    assert line in said(described(link("finger", BOX), joint("a", "l2", "finger", kind, more)))


def test_a_mimic_of_a_fixed_joint_stands_where_that_is() -> None:
    stiff = joint("a", "l2", "f1", "fixed", '<limit lower="0.5" upper="1.5"/>')
    follower = joint("b", "f1", "f2", more=LIMIT + '<mimic joint="a"/>')
    assert "elsewhere than at b = 0: say" in said(described(link("f1"), link("f2", BOX), stiff, follower))


def test_links_without_geometry_are_said_where_there_is_something() -> None:
    tool = (link("tool", BOX), joint("f", "l2", "tool", "fixed", ""))
    assert "bodies of l2" in said(described(l2=link("l2")))
    assert "bodies of" not in said(described(*tool, l2=link("l2")))
    shown = link("gripper", more=f"<visual><geometry>{BOX}</geometry></visual>")
    assert "bodies of gripper" in said(described(shown, joint("f", "l2", "gripper", "fixed", "")))


def test_what_nothing_connects_may_be_ignored() -> None:
    description = described(link("lone", BOX))
    assert "lone: no joint connects them with the arm" in said(description)
    assert any("no joint connects lone with 'base'" in note for note in description.notes)
    assert "no joint connects" not in said(description, ignored=("lone",))


def test_balls_of_a_large_box_say_how_far_they_stick_out() -> None:
    floor = (BoxShape(sizes=(5.0, 5.0, 0.1)),)
    balls, overhang = fine_balls(floor, None), overhang_of(floor, None)
    assert overhang < 0.1
    out = np.abs(balls.centers) + balls.radii[:, None] - np.array([2.5, 2.5, 0.05])
    assert out.max() <= overhang
