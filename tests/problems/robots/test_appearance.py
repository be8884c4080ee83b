"""What links look like: what a URDF shows, its colours, what is shown instead, and what nothing depends on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from helpers.urdf import ARM

from problems.base import InvalidProblem, Reading, cache
from problems.robots import MeshShape, RobotDescription, SpatialArm, appearance_text, read_appearances, read_urdf

RED = '<material name="paint"><color rgba="1 0 0 1"/></material>'
BOX = '<geometry><box size="0.2 0.1 0.1"/></geometry>'


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))


def described(*visuals: str, materials: str = "") -> RobotDescription:
    """The crane whose jib is shown so."""
    shown = "".join(f"<visual>{visual}</visual>" for visual in visuals)
    return read_urdf(ARM.replace('<link name="jib">', f'{materials}<link name="jib">{shown}'), tip_link="tool0")


def never(shape: MeshShape) -> bytes:
    raise InvalidProblem("mesh", "there is no such file")


def test_visuals_and_else_collision_geometry_are_shown_where_they_stand() -> None:
    description = described(f'<origin xyz="0 0 0.3"/>{BOX}')
    appearances, notes = description.new_appearances(never)
    assert notes == [] and list(appearances) == ["jib", "mast"]
    [(colour, box)] = appearances["jib"]
    assert colour == "" and len(box.faces) == 12
    np.testing.assert_allclose(
        [box.vertices.min(axis=0), box.vertices.max(axis=0)], [[-0.1, -0.05, 0.25], [0.1, 0.05, 0.35]]
    )
    [(_, mast)] = appearances["mast"]  # of its cylinder
    np.testing.assert_allclose(np.ptp(mast.vertices, axis=0), [0.1, 0.1, 0.4], rtol=0.01)


def test_looks_move_with_the_bodies_that_carry_the_links() -> None:
    description = described(f'<origin xyz="0 0 0.3"/>{BOX}')
    arm = description.with_appearances(description.new_appearances(never)[0]).drawn
    assert {(appearance.link, appearance.body) for appearance in arm.appearances} == {("mast", 1), ("jib", 2)}
    frames = arm.body_frames(np.array([[np.pi / 2.0, 0.3]]))
    assert frames.shape == (1, 3, 4, 3)
    # The mast stands at 1.5 m, turned by a quarter; the jib 0.3 m along its x and 0.1 + 0.3 m along its y.
    np.testing.assert_allclose(frames[0, 1], [[0, 0, 1.5], [0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(frames[0, 2, 0], [-0.4, 0.3, 1.5], atol=1e-12)


@pytest.mark.parametrize(
    ("material", "materials", "colour"),
    [
        (RED, "", "#ff0000"),
        ('<material name="paint"/>', RED, "#ff0000"),
        ('<material name="paint"/>', "", ""),
        ('<material name="paint"><color rgba="2 -1 0.5 1"/></material>', "", "#ff0080"),
        ('<material name="paint"><color rgba="red"/></material>', RED, "#ff0000"),
        ('<material name="paint"><texture filename="a.png"/></material>', "", ""),
    ],
)
def test_colours_of_materials(material: str, materials: str, colour: str) -> None:
    appearances, notes = described(BOX + material, materials=materials).new_appearances(never)
    assert [each for each, _ in appearances["jib"]] == [colour] and notes == []


@pytest.mark.parametrize(
    ("visual", "note"),
    [
        ('<geometry><torus radius="1"/></geometry>', "link 'jib': a shape <torus>; there are"),
        ('<origin xyz="a b c"/>' + BOX, "link 'jib': xyz of <origin> is 'a b c', which are no numbers"),
        ('<geometry><mesh filename="jib.stl"/></geometry>', "there is no such file"),
    ],
)
def test_what_cannot_be_shown_is_noted_and_its_collision_geometry_is_shown(visual: str, note: str) -> None:
    appearances, [found] = described(BOX, visual).new_appearances(never)
    assert (found.link, found.note[: len(note)]) == ("jib", note)
    [(_, ball)] = appearances["jib"]  # the sphere of its collision geometry
    np.testing.assert_allclose(np.ptp(ball.vertices, axis=0), 0.12, rtol=1e-2)


def test_broken_meshes_and_none_at_all_leave_a_link_out() -> None:
    text = ARM.replace('<sphere radius="0.06"/>', '<mesh filename="jib.stl"/>')
    appearances, notes = read_urdf(text, tip_link="tool0").new_appearances(lambda shape: b"solid nothing")
    assert list(appearances) == ["mast"] and [note.file for note in notes] == ["jib.stl"]


def test_a_robot_has_about_so_many_triangles_and_is_read_once() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=60.0).export(file_type="stl")
    reads = []

    def read(shape: MeshShape) -> bytes:
        reads.append(shape.file)
        return bytes(ball)

    description = described('<geometry><mesh filename="jib.stl" scale="0.001 0.001 0.001"/></geometry>')
    appearances, _ = description.new_appearances(read)
    count = sum(len(triangles.faces) for parts in appearances.values() for _, triangles in parts)
    assert 1_000 < count <= 3_000
    again, _ = description.new_appearances(read)
    assert appearance_text(again) == appearance_text(appearances) and reads == ["jib.stl"] * 2


def test_nothing_depends_on_them() -> None:
    description = described(BOX)
    arm = description.with_appearances(description.new_appearances(never)[0]).drawn
    plain = replace(arm, appearances=())
    assert arm == plain and hash(arm) == hash(plain)
    assert Reading(arm).structure_key == Reading(plain).structure_key
    assert isinstance(arm, SpatialArm) and replace(arm, margin=0.1).appearances[0] is arm.appearances[0]


TEXT = appearance_text(described(BOX + RED).new_appearances(lambda shape: b"")[0])


def test_what_is_read_is_what_was_written() -> None:
    assert appearance_text(read_appearances(TEXT)) == TEXT


@pytest.mark.parametrize(
    "text", ["", "[]", "1", '{"jib": 1}', '{"jib": [["", "?"]]}', TEXT.replace("#ff0000", "</scr")]
)
def test_anything_else_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(InvalidProblem, match=r"^(looks|triangles): ") as error:
        read_appearances(text)
    assert "\n" not in str(error.value)
