"""Obstacles that files hold: meshes, clouds of points, MoveIt scenes; what is made of them, stored, and refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from trimesh.transformations import translation_matrix

import tpbso_casadi as tp
from problems import Box, Cylinder, MovingObstacle, Polytope
from problems.scene import Obstacle
from tpbso_casadi.scenario import InputFolder, ScenarioError, parse_scenario
from tpbso_casadi.scenario.scene_files import scene_tables

ROBOT: dict[str, Any] = {"model": "panda"}
TASK = {"kind": "point-to-point", "start": {"joints": [0.0, -0.8, 0.0, -2.2, 0.0, 1.5, 0.8]}}
TASK |= {"goal": {"joints": [0.9, -0.8, 0.0, -2.0, 0.0, 1.5, 0.8]}}
QUARTER = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # about z
SCENE = """(noname)+
* table top
0.5 0 0.1
0 0 0.70710678 0.70710678
1
box
0.8 0.6 0.04
0.1 0 0
0 0 0 1
0 0 0 0
0
* bin
0 0 0.5
0 0 0 1
4
cylinder
0.05 0.2
0.6 0 0
0 0 0 1
0 0 0 0
cone
0.05 0.1
0.6 0 0.2
0 0 0 1
0 0 0 0
sphere
0.04
0.6 0 0.3
0 0 0 1
1 0 0 1
mesh
4 4
0 0 0
0.1 0 0
0 0.1 0
0 0 0.1
0 2 1
0 1 3
0 3 2
1 2 3
0.6 0.3 0
0 0 0 1
0 0 0 0
1
grasp
0 0 0.5
0 0 0 1
.
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("world")
    block = trimesh.creation.box([400.0, 200.0, 100.0])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    wedge = trimesh.Trimesh([[0, 0, 0], [100, 0, 0], [0, 100, 0], [0, 0, 300]], faces)
    wedge.apply_transform(translation_matrix([600.0, 0.0, 0.0]))
    trimesh.util.concatenate([block, wedge]).export(path / "fixture.stl")
    np.save(path / "cloud.npy", np.random.default_rng(0).uniform(-0.1, 0.1, (500, 3)))
    (path / "cell.scene").write_text(SCENE)
    (path / "cart.csv").write_text("t,x,y,z\n0,0,0,0\n1,0.1,0,0\n2,0.2,0,0\n")
    return path


def obstacles(folder: Path, *tables: dict[str, Any], **keys: Any) -> tuple[Obstacle, ...]:
    content = {"robot": ROBOT, "task": TASK, "obstacles": list(tables), **keys}
    scenario = parse_scenario(content, InputFolder(folder))
    again = parse_scenario(scenario.table())  # complete without the files
    assert again == scenario
    found = scenario.criteria().obstacles
    assert again.criteria().obstacles == found
    return tuple(found)


def test_a_mesh_becomes_convex_parts(folder: Path) -> None:
    table = {"shape": "mesh", "file": "fixture.stl", "scale": 0.001, "center": [0.5, 0.0, 0.9], "quaternion": QUARTER}
    box, wedge = obstacles(folder, {"shape": "sphere", "center": [0.0, 0.9, 0.9], "radius": 0.1}, table)[1:]
    assert isinstance(box, Box) and isinstance(wedge, Polytope)
    np.testing.assert_allclose(box.center, (0.5, 0.0, 0.9), atol=1e-9)
    np.testing.assert_allclose(box.bounding_box(), [[0.4, -0.2, 0.85], [0.6, 0.2, 0.95]], atol=1e-6)
    np.testing.assert_allclose(wedge.bounding_box(), [[0.4, 0.6, 0.9], [0.5, 0.7, 1.2]], atol=1e-6)
    assert [part.label(9) for part in (box, wedge)] == ["obstacle 2"] * 2


def test_a_wall_of_relative_corners_stands_where_it_is_stated(tmp_path: Path) -> None:
    """Counted from the file's end, all its faces would be those of the block far away."""
    texts = []
    for middle in ([0.4, 0.9, 0.9], [3.0, 3.0, 3.0]):
        block = trimesh.creation.box([0.2, 0.02, 0.2], translation_matrix(middle))
        texts += [f"v {' '.join(map(str, place))}" for place in block.vertices]
        texts += [f"f {' '.join(str(corner - 8) for corner in face)}" for face in block.faces]
    (tmp_path / "wall.obj").write_text("\n".join(texts))
    wall, block = obstacles(tmp_path, {"shape": "mesh", "file": "wall.obj"})
    np.testing.assert_allclose(wall.bounding_box(), [[0.3, 0.89, 0.8], [0.5, 0.91, 1.0]], atol=1e-6)
    np.testing.assert_allclose(block.bounding_box(), [[2.9, 2.99, 2.9], [3.1, 3.01, 3.1]], atol=1e-6)
    (tmp_path / "wall.obj").write_text("\n".join([*texts, "surf 0 1 0 1 1 2 3"]))
    with pytest.raises(
        ScenarioError, match=r"obstacles\.0\.file: .*wall\.obj: line 41: the element 'surf' is not read"
    ):
        obstacles(tmp_path, {"shape": "mesh", "file": "wall.obj"})


def test_what_a_dae_says_of_its_unit_and_axis_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    content = trimesh.creation.box([20.0, 40.0, 60.0], translation_matrix([50.0, 90.0, 90.0])).export(file_type="dae")
    assert b"<up_axis>Y_UP" in content and b"<unit" not in content
    (tmp_path / "box.dae").write_bytes(content.replace(b"<up_axis>", b'<unit meter="0.01"/><up_axis>'))
    (box,) = obstacles(tmp_path, {"shape": "mesh", "file": "box.dae"})
    np.testing.assert_allclose(box.bounding_box(), [[0.4, 0.7, 0.6], [0.6, 1.1, 1.2]], atol=1e-6)
    assert [record.getMessage() for record in caplog.records if record.levelname == "WARNING"] == [
        "box.dae: the mesh is in a unit of 0.01 m, as it says: its lengths are converted",
        "box.dae: it calls Y up; its coordinates are not turned, as in ROS",
    ]


def test_its_hull_is_one_part(folder: Path) -> None:
    table = {"shape": "mesh", "file": "fixture.stl", "scale": [0.001, 0.001, 0.002], "hull": True, "name": "fixture"}
    (hull,) = obstacles(folder, table | {"center": [0.5, 0.9, 0.9]})
    assert isinstance(hull, Polytope) and hull.label(1) == "fixture"
    np.testing.assert_allclose(hull.bounding_box(), [[0.3, 0.8, 0.8], [1.2, 1.0, 1.5]], atol=1e-6)


def test_all_parts_move_together(folder: Path) -> None:
    table = {"shape": "mesh", "file": "fixture.stl", "scale": 0.001, "center": [0.5, 0.9, 0.9]}
    for motion in ({"velocity": [0.1, 0.0, 0.0]}, {"motion": "cart.csv"}):
        parts = obstacles(folder, table | motion)
        assert len(parts) == 2 and all(isinstance(part, MovingObstacle) for part in parts)
        np.testing.assert_allclose(parts[0].at(1.5).place, (0.65, 0.9, 0.9), atol=1e-9)


def test_points_become_boxes(folder: Path) -> None:
    table = {"shape": "points", "file": "cloud.npy", "radius": 0.02, "center": [0.5, 0.0, 0.9], "quaternion": QUARTER}
    boxes = obstacles(folder, table)
    points = np.load(folder / "cloud.npy")[:, [1, 0, 2]] * [-1.0, 1.0, 1.0] + [0.5, 0.0, 0.9]
    assert all(isinstance(box, Box) and box.label(7) == "obstacle 1" for box in boxes)
    for point in points[::10]:
        assert min(box.distance_of(tuple(point), tuple(point)) for box in boxes) <= -0.02 + 1e-9


def test_a_scene_of_moveit(folder: Path) -> None:
    box, cylinder, cone, sphere, wedge = obstacles(folder, scene="cell.scene")
    assert [part.label(1) for part in (box, cylinder, cone, sphere, wedge)] == ["table top", *["bin"] * 4]
    np.testing.assert_allclose(box.bounding_box(), [[0.2, -0.3, 0.08], [0.8, 0.5, 0.12]], atol=1e-6)
    assert isinstance(cylinder, Cylinder) and cylinder.center == (0.6, 0.0, 0.5)
    assert isinstance(cone, Polytope) and cone.contains((0.6, 0.049, 0.651)) and not cone.contains((0.6, 0.05, 0.75))
    np.testing.assert_allclose(wedge.bounding_box(), [[0.6, 0.3, 0.5], [0.7, 0.4, 0.6]], atol=1e-6)
    only = obstacles(folder, {"shape": "sphere", "center": [0.0, 0.9, 0.9], "radius": 0.1}, scene="cell.scene")
    assert len(only) == 6


def test_the_old_format_has_no_poses_of_objects() -> None:
    text = "cell\n* box\n1\nbox\n0.1 0.2 0.3\n0.5 0 0.25\n0 0 0 1\n0 0 0 0\n.\n"
    assert scene_tables(text) == [
        {"name": "box", "shape": "box", "size": [0.1, 0.2, 0.3], "center": [0.5, 0.0, 0.25], "quaternion": [0, 0, 0, 1]}
    ]


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("box\n", "torus\n", r"line 6: shape 'torus'; box, sphere, cylinder, cone, mesh are read"),
        ("0.8 0.6 0.04", "0.8 0.6", r"line 12: a number is needed, not '\*'"),
        ("0.8 0.6 0.04", "0.8 x 0.04", r"line 7: a number is needed, not 'x'"),
        ("0.8 0.6 0.04", "0.8 1_0 0.04", r"line 7: a number is needed, not '1_0'"),
        ("0.8 0.6 0.04", "0.8 nan 0.04", r"line 7: a number is not finite"),
        ("0 0 0.70710678 0.70710678", "0 0 0 0", r"line 4: the quaternion is not of length 1"),
        ("0.05 0.2", "-0.05 0.2", r"radius: "),
        ("* bin", "bin", r"line 12: '\*' before an object or '\.' at the end is needed, not 'bin'"),
        ("0 3 2", "0 3 9", r"a mesh needs triangles of its own vertices"),
        ("0 3 2", "0 3 1.5", r"a mesh needs triangles of its own vertices"),
        ("\n.\n", "\n", r"it ends in the middle"),
        ("(noname)+", "", r"line"),
    ],
)
def test_a_broken_scene(old: str, new: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "cell.scene").write_text(SCENE.replace(old, new, 1))
    with pytest.raises(ScenarioError, match=rf"^scene: .*cell\.scene: .*({reason})"):
        obstacles(tmp_path, scene="cell.scene")


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ({"shape": "mesh", "file": "none.stl"}, r"obstacles\.0\.file: .*none\.stl: cannot be read: No such file"),
        ({"shape": "mesh", "file": "fixture.stl"}, r"obstacles\.0\.file: .*fixture\.stl: it is .* in mm, and scale"),
        ({"shape": "mesh", "file": "../secret.stl"}, r"lies outside the scenario's folder"),
        ({"shape": "points", "file": "fixture.stl", "radius": 0.1}, r"ends with 'stl'; ply, xyz, npy are read"),
    ],
)
def test_what_is_refused(table: dict[str, Any], reason: str, folder: Path) -> None:
    with pytest.raises(ScenarioError, match=reason):
        obstacles(folder, table)


def test_files_are_named_from_python(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    ends = {key: TASK[key] for key in ("start", "goal")}
    given: Any
    for given, count in (
        ([{"shape": "points", "file": "cloud.npy", "radius": 0.05, "center": [0, 0.9, 0.9]}], 1),
        ("cell.scene", 5),
    ):
        scenario = tp.scenario_of("panda", **ends, obstacles=given)
        assert len(scenario.criteria().obstacles) == count
    named = tp.scenario_of("panda", **ends, obstacles=[tp.Box(center=(0.0, 0.9, 0.9), size=(0.1,) * 3, name="crate")])
    assert named.criteria().obstacles[0].label(1) == "crate"
