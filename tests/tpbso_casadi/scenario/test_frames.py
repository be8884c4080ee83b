"""[[frames]]: numbers by hand, rigid motions of every shape, what is stored, templates that move, and refusals."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import line_of, refusal, result_of, status
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from problems.base import FloatArray
from problems.scene import OBSTACLES, SOLIDS, Obstacle
from problems.tasks import AtTips, Pose
from tpbso_casadi.cli.commands.solve import main as solve
from tpbso_casadi.planning import bound
from tpbso_casadi.reaching import ArmAmong
from tpbso_casadi.scenario import (
    FrameSection,
    InputFolder,
    Scenario,
    ScenarioError,
    overridden,
    parse_scenario,
    parse_stated,
    read_scenario,
    stated_scenario,
)
from tpbso_casadi.scenario.obstacles import IN_FILES, SHAPES
from tpbso_casadi.storage.result import stored_scenario

S = float(np.sqrt(0.5))
QUARTER, HALF = [0.0, 0.0, S, S], [0.0, 0.0, 1.0, 0.0]  # about z
BIN = {"name": "bin", "position": [0.5, 0.25, 0.1], "quaternion": QUARTER}  # x of it is y of the world, y is -x
HOME = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
ROBOT: dict[str, Any] = {"model": "ur5e"}
DOWN = [1.0, 0.0, 0.0, 0.0]
BOX = {"shape": "box", "center": [0.2, 0.0, 0.1], "size": [0.1, 0.2, 0.3]}


def content(stages: list[dict[str, Any]] | None = None, **tables: Any) -> dict[str, Any]:
    """A sequence of a UR5e beside a frame called bin; the given tables are added, or take the place of these."""
    move = {"kind": "move", "goal": {"joints": HOME}}
    task = {"kind": "sequence", "start": {"joints": HOME}, "stages": stages or [move]}
    return {"robot": ROBOT, "frames": [BIN], "task": task} | tables


def parsed(stages: list[dict[str, Any]] | None = None, **tables: Any) -> Any:
    return parse_scenario(content(stages, **tables))


def move(**goal: Any) -> dict[str, Any]:
    return {"kind": "move", "goal": goal}


def table_of(scenario: Scenario, *keys: str | int) -> Any:
    found: Any = scenario.table()
    for key in keys:
        found = found[key]
    return found


def test_a_quarter_turn_by_hand() -> None:
    """A point (x, y, z) of the bin is at (0.5 - y, 0.25 + x, 0.1 + z)."""
    stages = [
        move(frame="bin", position=[0.2, 0.1, 0.3], quaternion=DOWN, free="z", turn=[-0.5, 0.5], within=0.01, cost=2.0),
        {"kind": "line", "frame": "bin", "by": [0.1, 0.2, -0.1], "tool_speed": 0.1},
        {"kind": "line", "frame": "bin", "goal": {"position": [0.2, 0.1, 0.2]}, "through": [0.0, 0.0, 0.4]},
        {"kind": "line", "goal": {"frame": "bin", "position": [0.0, 0.1, 0.2]}},
        {"kind": "path", "frame": "bin", "points": [[0.1, 0.0, 0.2], [0.0, 0.1, 0.2]], "accuracy": 0.01},
        {"kind": "move", "goal": [{"frame": "bin", "position": [0.1, 0, 0]}, {"joints": HOME}],
         "via": [{"frame": "bin", "position": [0.2, 0, 0]}]},
    ]  # fmt: skip
    base = {"frame": "bin", "position": [0.1, 0.2, -0.1]}
    found = parsed(stages, robot=ROBOT | {"base": base}, obstacles=[BOX | {"frame": "bin"}])
    one, by, arc, line, path, last = found.task.stages
    assert one.goal.point == pytest.approx((0.4, 0.45, 0.4))
    assert one.goal.quaternion == pytest.approx((S, S, 0.0, 0.0))  # (0, 0, s, s) times (1, 0, 0, 0)
    assert (one.goal.free, one.goal.turn, one.goal.within, one.goal.cost) == ("z", (-0.5, 0.5), 0.01, 2.0)
    assert by.by == pytest.approx((-0.2, 0.1, -0.1)) and by.frame is None
    assert by.tool_speed.speed == 0.1  # a frame that stands still forbids nothing
    assert arc.goal == Pose(pytest.approx((0.4, 0.45, 0.3))) and arc.through == pytest.approx((0.5, 0.25, 0.5))
    assert line.goal.point == pytest.approx((0.4, 0.25, 0.3)) and line.goal.quaternion is None
    assert np.array(path.points) == pytest.approx(np.array([[0.5, 0.35, 0.3], [0.4, 0.25, 0.3]]))
    assert last.goal[0].point == pytest.approx((0.5, 0.35, 0.1)) and last.via[0].point == pytest.approx(
        (0.5, 0.45, 0.1)
    )
    assert found.robot.base.position == pytest.approx((0.3, 0.35, 0.0))
    assert found.robot.base.quaternion == pytest.approx(QUARTER)
    assert found.obstacles[0].build().center == pytest.approx((0.5, 0.45, 0.2))
    text = json.dumps(found.table())
    assert '"frame"' not in text and '"frames"' not in text and found.frames == []
    assert stored_scenario(found.table()).table() == found.table()


def test_a_frame_in_a_frame_and_one_that_is_not_turned() -> None:
    inner = {
        "name": "slot",
        "frame": "bin",
        "position": [0.1, 0.0, 0.0],
        "quaternion": [0.0, 0.0, 0.9995 * S, 0.9995 * S],
    }
    shifted = {"name": "table", "position": [0.25, 0.5, 0.0], "quaternion": [0.0, 0.0, 0.0, 1.0]}
    goals = [
        {"frame": "slot", "position": [0.1, 0.2, 0.3], "quaternion": [0.0, 0.0, 0.0, 1.0]},
        {"frame": "table", "position": [0.25, 0.0, 0.3], "quaternion": [0.3, 0.4, 0.5, 0.70711]},
    ]
    half = {"shape": "half-space", "center": [0.0, 0.0, 0.25], "normal": [0.0, 1.0, 0.0], "frame": "table"}
    ball = {"shape": "sphere", "center": [0.1, 0.2, 0.3], "radius": 0.1, "frame": "slot"}
    found = parsed([{"kind": "move", "goal": goals}], frames=[BIN, inner, shifted], obstacles=[half, ball])
    slot, other = found.task.stages[0].goal
    assert slot.point == pytest.approx((0.5 - 0.1, 0.25 + 0.1 - 0.2, 0.4))  # half a turn, at (0.5, 0.35, 0.1)
    assert np.abs(slot.quaternion) == pytest.approx([0.0, 0.0, 1.0, 0.0], abs=1e-12)  # of length 1, as the frame is
    assert other.point == (0.5, 0.5, 0.3) and other.quaternion == (0.3, 0.4, 0.5, 0.70711)  # bit by bit
    wall = found.obstacles[0].build()
    assert wall.distance_of((0.0, 0.75, 9.0), (0.0, 0.75, 9.0)) == pytest.approx(0.25)
    assert found.obstacles[1].build().center == pytest.approx((0.4, 0.15, 0.4))


def test_point_to_point_tasks_paths_and_simulations() -> None:
    task = {"kind": "point-to-point", "start": {"joints": HOME}, "goal": {"frame": "bin", "position": [0.1, 0.0, 0.3]}}
    found = parsed(task=task, simulation={"goals": [{"frame": "bin", "position": [0.0, 0.0, 0.2]}, {"joints": HOME}]})
    assert found.task.goal.point == pytest.approx((0.5, 0.35, 0.4))
    assert found.simulation.goals[0].point == pytest.approx((0.5, 0.25, 0.3))
    poses = [[0.1, 0.0, 0.3, *DOWN], [0.2, 0.0, 0.3, *DOWN]]
    traced = parsed(task={"kind": "path", "frame": "bin", "accuracy": 0.01, "angular_accuracy": 0.1, "points": poses})
    assert traced.task.path().array == pytest.approx(np.array([[0.5, 0.35, 0.4], [0.5, 0.45, 0.4]]))
    turns = [Rotation.from_quat(each).as_matrix() for each in traced.task.path().quaternions]
    assert turns[0] == pytest.approx((Rotation.from_quat(QUARTER) * Rotation.from_quat(DOWN)).as_matrix())


def test_degrees_of_a_pose_in_a_frame() -> None:
    goal = {"frame": "bin", "position": [0.1, 0.0, 0.3], "quaternion": DOWN, "free": "z", "turn": [-90.0, 90.0]}
    found = parse_scenario({"unit": "deg"} | content([move(**goal)]))
    assert found.task.stages[0].goal.turn == pytest.approx((-np.pi / 2, np.pi / 2))


CELL = {
    "left": {"model": "ur5e", "base": {"frame": "bin", "position": [0.0, 0.0, 0.0]}},
    "right": {"model": "ur5e", "base": {"position": [1.5, 0.25, 0.1]}},
}


def of_cell(task: dict[str, Any], **tables: Any) -> Any:
    named = {"kind": "point-to-point", "start": {"left": {"joints": HOME}, "right": {"joints": HOME}}} | task
    return parse_scenario({"robots": CELL, "frames": [BIN], "task": named} | tables)


def test_places_of_several_arms_and_bases_of_a_cell() -> None:
    pose = {"frame": "bin", "position": [0.2, 0.1, 0.3], "quaternion": DOWN}
    found = of_cell({"goal": {"left": pose, "right": {"joints": HOME}}})
    assert isinstance(found.task.goal, AtTips)
    assert found.task.goal.places[0].point == pytest.approx((0.4, 0.45, 0.4))
    assert found.robots.robots["left"].base.position == (0.5, 0.25, 0.1)
    stays = of_cell({"goal": {"left": pose, "right": "stay"}})
    assert stays.task.goal.point == pytest.approx((0.4, 0.45, 0.4)) and not stays.frames
    stages = [move(left=pose) | {"via": [{"left": pose}]}, move(**pose) | {"arm": "left"}]
    sequence = of_cell({"kind": "sequence", "stages": stages}).task
    assert dict(sequence.stages[0].goal.parts)["left"].point == pytest.approx((0.4, 0.45, 0.4))
    assert sequence.stages[1].goal.point == pytest.approx((0.4, 0.45, 0.4))
    line = {"kind": "line", "arm": "left", "by": [0.1, 0.0, 0.0]}
    led = of_cell({"kind": "sequence", "stages": [line | {"frame": "right"}, line | {"frame": "bin"}]}).task.stages
    assert led[0].frame == "right" and led[0].by == [0.1, 0.0, 0.0]  # in the frame of a tool, as it was
    assert led[1].frame is None and led[1].by == pytest.approx((0.0, 0.1, 0.0))


TETRA = [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.1, 0.4]]
CUBE = [[x, y, z] for x in (0.0, 0.1) for y in (0.0, 0.2) for z in (0.0, 0.3)]
TURNED = {"center": [0.2, -0.1, 0.3], "quaternion": [0.5, 0.5, -0.5, 0.5]}
TABLES: dict[str, dict[str, Any]] = {
    "box": TURNED | {"size": [0.1, 0.2, 0.3]},
    "sphere": {"center": [0.2, -0.1, 0.3], "radius": 0.1},
    "capsule": TURNED | {"radius": 0.1, "length": 0.3},
    "cylinder": TURNED | {"radius": 0.1, "length": 0.3},
    "half-space": {"center": [0.2, -0.1, 0.3], "normal": [1.0, 2.0, -0.5]},
    "ellipsoid": TURNED | {"semi_axes": [0.1, 0.2, 0.3]},
    "polytope": TURNED | {"points": TETRA},
    "mesh": TURNED | {"file": "part.stl", "parts_points": [TETRA, CUBE]},
    "points": TURNED | {"file": "cloud.ply", "radius": 0.05, "boxes": [[[0.0, 0.0, 0.0], [0.1, 0.2, 0.3]]]},
}
MOTIONS: dict[str, dict[str, Any]] = {
    "still": {},
    "even": {"velocity": [0.3, -0.2, 0.1], "margin_rate": 0.02},
    "sliding": {"motion_rows": [[0.0, 0.0, 0.0, 0.0], [1.0, 0.3, 0.1, 0.0], [2.0, 0.4, 0.4, 0.2]]},
    "turning": {
        "motion_rows": [[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [1.0, 0.3, 0.1, 0.0, 0.0, 0.38, 0.0, 0.925],
                        [2.0, 0.4, 0.4, 0.2, 0.3, -0.6, 0.1, -0.7348]],
    },
}  # fmt: skip
NUMBERS = st.floats(-1.0, 1.0)


@st.composite
def frames(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    """A position and a quaternion of length 1."""
    quaternion = np.array(draw(st.tuples(*[NUMBERS] * 4)))
    length = float(np.linalg.norm(quaternion))
    unit = quaternion / length if length > 0.1 else np.array([0.0, 0.0, 0.0, 1.0])
    return list(draw(st.tuples(*[NUMBERS] * 3))), unit.tolist()


def test_every_shape_of_space_is_moved() -> None:
    in_plane = {name for name in OBSTACLES if name not in SOLIDS}
    assert {*SHAPES} - in_plane == {*TABLES} == {*SOLIDS, *IN_FILES}


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("shape", TABLES)
@settings(max_examples=5, deadline=None)
@example(frame=([0.5, 0.25, 0.1], QUARTER), other=([0.0, 0.0, 0.2], [0.0, 0.0, 0.0, 1.0]))
@given(frame=frames(), other=frames())
def test_distances_in_the_frame_are_those_in_the_world(shape: str, motion: str, frame: Any, other: Any) -> None:
    """SciPy moves the points, from the inner frame to the outer one and on to the world."""
    outer = {"name": "outer", "position": frame[0], "quaternion": frame[1]}
    inner = {"name": "inner", "position": other[0], "quaternion": other[1], "frame": "outer"}
    table = {"shape": shape, **TABLES[shape], **MOTIONS[motion]}
    near = parsed(frames=[], obstacles=[table]).obstacles[0].built(1)
    far = parsed(frames=[outer, inner], obstacles=[table | {"frame": "inner"}]).obstacles[0].built(1)
    points = np.random.default_rng(5).uniform(-0.6, 0.8, (4, 3))
    moved = points
    for position, quaternion in (other, frame):
        moved = Rotation.from_quat(quaternion).apply(moved) + position
    assert len(near) == len(far)
    for one, two in zip(near, far, strict=True):
        for time in (0.0, 0.7, 1.6) if one.moves else (0.0,):
            assert distances(two, moved, time) == pytest.approx(distances(one, points, time), abs=1e-9)
            assert two.growth_rate == one.growth_rate


def distances(obstacle: Obstacle, points: FloatArray, time: float) -> FloatArray:
    seen = points if not obstacle.moves else obstacle.frames(np.array([time])).seen(points)  # type: ignore[union-attr]
    each = [tuple(point) for point in np.reshape(seen, (-1, 3)).tolist()]
    return np.array([obstacle.unmoved.distance_of(point, point) for point in each])


@settings(max_examples=3, deadline=None)
@given(frame=frames())
def test_a_robot_that_moves_with_its_cell_sees_the_same(frame: Any) -> None:
    """Base and obstacles stand in one frame: wherever that is, postures have the same room, and poses the same."""
    base = {"frame": "cell", "position": [0.1, 0.0, 0.2], "quaternion": QUARTER}
    around = [
        BOX | {"frame": "cell", "center": [0.5, 0.4, 0.3]},
        {"shape": "half-space", "center": [0, 0, 0], "frame": "cell"},
    ]
    goal = {"frame": "cell", "position": [0.3, 0.4, 0.5], "quaternion": DOWN}
    postures = np.random.default_rng(3).uniform(-2.0, 2.0, (5, 6))
    found, places = [], []
    for position, quaternion in (frame, ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])):
        cell = {"name": "cell", "position": position, "quaternion": quaternion}
        scenario = parsed([move(**goal)], robot=ROBOT | {"base": base}, obstacles=around, frames=[cell])
        built = parsed(
            task={"kind": "recorded-motion"}, frames=[], robot=scenario.robot, obstacles=scenario.obstacles
        ).built()
        arm = ArmAmong.of(built.robot, built.obstacles, None)
        found.append(arm.clearance(postures))
        tools, stated = arm.forward(postures), scenario.task.stages[0].goal
        seen = Rotation.from_matrix(tools[:, :3, :3]).inv() * Rotation.from_quat(stated.quaternion)
        away = np.einsum("nji,nj->ni", tools[:, :3, :3], np.array(stated.point) - tools[:, :3, 3])
        places.append(np.hstack([seen.as_matrix().reshape(-1, 9), away]))
    assert found[0] == pytest.approx(found[1], abs=1e-9)
    np.testing.assert_allclose(places[0], places[1], atol=1e-9)


def test_the_bound_of_a_sequence_is_that_of_its_cell_elsewhere() -> None:
    base = {"frame": "cell", "position": [0.1, 0.0, 0.2]}
    stages = [
        move(frame="cell", position=[0.4, 0.3, 0.4], quaternion=DOWN),
        {"kind": "line", "frame": "cell", "by": [0.0, 0.1, 0.0]},
    ]
    stated = parse_stated(content(stages, robot=ROBOT | {"base": base}, frames=[BIN | {"name": "cell"}]))
    (cell,) = stated.frames
    times = []
    for position, quaternion in (([0.0, 0.0, 0.0], None), ([2.0, -1.0, 0.5], (0.1, 0.0, float(np.sqrt(0.98)), 0.1))):
        moved = cell.replaced(position=position, quaternion=quaternion)
        times.append(bound(stated.replaced(frames=[moved]).with_postures()).seconds)
    assert times[0] == pytest.approx(times[1], rel=1e-6) and times[0] > 0.5


def test_a_stated_scenario_is_read_again_and_moves_again_and_again(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text(FRAMED)
    (tmp_path / "way.csv").write_text("t,x,y,z\n0,0,0,0\n1,0.25,0,0\n")
    stated = stated_scenario(tmp_path / "cell.toml")
    again = parse_stated(stated.table())
    assert again.table() == stated.table() and table_of(stated, "frames", 0, "name") == "bin 2"
    assert table_of(stated, "task", "stages", 0, "goal", "frame") == "bin 2"
    assert (
        again.with_postures().table() == stated.with_postures().table() == read_scenario(tmp_path / "cell.toml").table()
    )
    for x in (0.5, 0.75, 0.5):
        found = stated.replaced(frames=[stated.frames[0].replaced(position=(x, 0.0, 0.0))]).with_postures()
        assert found.obstacles[0].build().center[0] == x - 0.25 and found.task.stages[0].goal.point[0] == x - 0.125
    with pytest.raises(
        ScenarioError, match=r"^frames: of a scenario as it is stated; with_postures\(\) resolves them$"
    ):
        stated.built()
    assert "'bin 2' is a name until" in line_of(lambda: stated.replaced(frames=[]).built())


FRAMED = """
[robot]
model = "ur5e"
[[frames]]
name = "bin 2"
position = [0.5, 0.25, 0.0]
quaternion = [0.0, 0.0, 1.0, 0.0]
[[obstacles]]
frame = "bin 2"
shape = "box"
center = [0.25, 0.0, 0.125]
size = [0.03125, 0.5, 0.25]
name = "side"
[task]
kind = "sequence"
start = { joints = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0] }
[[task.stages]]
kind = "move"
goal = { frame = "bin 2", position = [0.125, 0.0, 0.5], quaternion = [1.0, 0.0, 0.0, 0.0] }
[[task.stages]]
kind = "line"
frame = "bin 2"
by = [0.0, 0.125, -0.125]
"""
IN_WORLD = """
[robot]
model = "ur5e"
[[obstacles]]
shape = "box"
center = [0.25, 0.25, 0.125]
quaternion = [0.0, 0.0, 1.0, 0.0]
size = [0.03125, 0.5, 0.25]
name = "side"
[task]
kind = "sequence"
start = { joints = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0] }
[[task.stages]]
kind = "move"
goal = { position = [0.375, 0.25, 0.5], quaternion = [0.0, 1.0, 0.0, 0.0] }
[[task.stages]]
kind = "line"
by = [0.0, -0.125, -0.125]
"""


def test_the_command_plans_a_cell_with_a_frame_as_the_same_in_numbers(in_an_empty_folder: None) -> None:
    Path("framed.toml").write_text(FRAMED)
    Path("numbers.toml").write_text(IN_WORLD)
    for name in ("framed", "numbers"):
        assert status(solve, f"{name}.toml", "--quiet", "--no-plots", "--out", name) == 0
    one, two = result_of("framed"), result_of("numbers")
    assert one["scenario"] == two["scenario"] and "frames" not in one["scenario"]
    motions = [np.load(f"{name}/motion.npz") for name in ("framed", "numbers")]
    for key in motions[0]:
        np.testing.assert_array_equal(motions[0][key], motions[1][key])


def test_files_of_obstacles_of_a_call_are_read_before_they_are_moved(in_an_empty_folder: None) -> None:
    """A table of motion that a file holds turns along."""
    Path("way.csv").write_text("t,x,y,z\n0,0,0,0\n1,0.25,0,0\n")
    stated = parse_stated(content(task={"kind": "point-to-point", "start": {"joints": HOME}, "goal": {"joints": HOME}}))
    found = overridden(stated, around={"obstacles": [BOX | {"frame": "bin", "motion": "way.csv"}]})
    assert found.obstacles[0].motion_rows[1] == pytest.approx([1.0, 0.0, 0.25, 0.0])
    with_file = content(obstacles=[BOX | {"frame": "bin", "motion": "way.csv"}])
    assert parse_scenario(with_file, InputFolder(Path())).obstacles[0].motion_rows == found.obstacles[0].motion_rows


def wrong() -> Iterator[tuple[dict[str, Any], str]]:
    """Contents, and the line with which each is refused."""
    box, line = BOX | {"frame": "bin"}, {"kind": "line", "frame": "bin", "by": [0.1, 0.0, 0.0]}
    goal = {"frame": "bin", "position": [0.1, 0.2, 0.3]}
    yield (
        content(obstacles=[BOX | {"frame": "bn"}]),
        "obstacles.0.frame: no frame is called 'bn'; did you mean bin?; there",
    )
    yield content(frames=[], obstacles=[box]), "obstacles.0.frame: no frame is called 'bin'; none is stated"
    yield content(frames=[BIN, BIN]), "frames.1.name: 'bin' is there twice"
    yield content(frames=[BIN | {"frame": "bin"}]), "frames.0.frame: 'bin' is not stated before this one"
    later = [BIN | {"name": "slot", "frame": "bin"}, BIN]
    yield content(frames=later), "frames.0.frame: 'bin' is not stated before this one"
    yield content(frames=[BIN, BIN | {"name": "slot", "frame": "bim"}]), "frames.1.frame: no frame is called 'bim'; did"
    yield (
        content(frames=[BIN | {"quaternion": [0.0, 0.0, 0.0, 2.0]}]),
        "frames.0.quaternion: [0.0, 0.0, 0.0, 2.0] is not",
    )
    yield content(frames=[BIN | {"name": ""}]), "frames.0.name: "
    yield content(frames=[BIN | {"positon": [0, 0, 0]}]), "frames.0.positon: unknown key; did you mean position?"
    yield content(frames=[{"name": "bin"}]), "frames.0.position: missing key"
    yield content([move(**goal | {"frame": "bn"})]), "task.stages.0.goal.frame: no frame is called 'bn'; did you mean"
    yield content([move(frame="bin", joints=HOME)]), "task.stages.0.goal.frame: joints are the same in every frame"
    yield content([move(frame="bin", position=[0.1, 0.2])]), "task.stages.0.goal.frame: frames are of robots in space"
    yield content([line | {"frame": "bn"}]), "task.stages.0.frame: no frame is called 'bn'; did you mean bin?"
    yield content([line], frames=[]), "task.stages.0.frame: no frame is called 'bin'; none is stated"
    yield content([line | {"by": [0.1, 0.2]}]), "task.stages.0.by: frames are of robots in space: [x, y, z] is needed"
    long = goal | {"quaternion": [0.0, 0.0, 0.0, 2.0]}
    yield content([move(**long)]), "task.stages.0.goal.quaternion: [0.0, 0.0, 0.0, 2.0] is not of length 1"
    turned = {"frame": "bin", "quaternion": [0.0, 0.0, 0.0, 2.0]}
    yield content(robot=ROBOT | {"base": turned}), "robot.base.quaternion: [0.0, 0.0, 0.0, 2.0] is not of length 1"
    whole = {"kind": "line", "frame": "bin", "goal": goal}
    yield content([whole]), "task.stages.0.goal.frame: the whole line is stated in a frame; leave this one out"
    path = {"kind": "path", "frame": "bin", "points": [[0.1, 0.2]], "accuracy": 0.01}
    yield content([path]), "task.stages.0.points: frames are of robots in space"
    yield (
        content([{"kind": "attach", "name": "side", "frame": "bin"}, move(joints=HOME)]),
        "task.stages.0.frame: unknown key",
    )
    part = box | {"kind": "attach", "name": "part"}
    yield content([part, move(joints=HOME)]), "task.stages.0.frame: what is carried is stated in the tool's frame"
    yield content(carried=[box]), "carried.0.frame: what is carried is stated in the tool's frame; leave it out"
    oval = {"center": [0.8, 0.8], "semi_axes": [0.15, 0.25], "frame": "bin"}
    yield content(obstacles=[oval]), "obstacles.0.frame: 'ellipse' is no solid in space: state it without a frame"
    yield content(obstacles=[box | {"size": [0.1, -0.2, 0.1]}]), "obstacles.0.size"
    yield content(obstacles=[box | {"velocity": [0.1, 0.2]}]), "obstacles.0.velocity: frames are of robots in space"
    yield content(robot=ROBOT | {"base": {"frame": "floor"}}), "robot.base.frame: no frame is called 'floor'"
    yield content(robot=ROBOT | {"tool": {"frame": "bin"}}), "robot.tool.frame: unknown key"
    planar = {"arm": {"link_lengths": [0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}}
    task = {"kind": "point-to-point", "start": [0.9, 0.0], "goal": [0.0, 0.9]}
    yield planar | {"frames": [BIN], "task": task}, "frames: of robots in space alone"
    cell = {"robots": CELL, "frames": [BIN], "task": {"kind": "sequence"}}
    start = {"left": {"joints": HOME}, "right": {"joints": HOME}}
    of_arm = {"kind": "sequence", "start": start, "stages": [line | {"arm": "left", "frame": "bi"}]}
    yield (
        cell | {"task": of_arm},
        "task.stages.0.frame: no frame is called 'bi'; did you mean bin?; there are bin, left, ",
    )
    leaning = {"kind": "sequence", "start": start, "stages": [line | {"arm": "left", "frame": "right", "free": "z"}]}
    yield cell | {"task": leaning}, "task.stages.0.free: of ways that are stated in the world alone"
    same = [BIN, BIN | {"name": "right"}]
    yield cell | {"task": of_arm, "frames": same}, "frames.1.name: an arm is called 'right': rename the frame"
    lost = {"robots": CELL | {"right": {"model": "ur5e", "base": {"frame": "x", "position": [1, 0, 0]}}}}
    yield cell | lost | {"task": leaning}, "task.stages.0.free"
    told = {"kind": "sequence", "start": start, "stages": [{"kind": "move", "goal": {"left": {"joints": HOME}}}]}
    yield cell | lost | {"task": told}, "robots.right.base.frame: no frame is called 'x'; there are bin"


@pytest.mark.parametrize(("stated", "line"), list(wrong()))
def test_what_is_refused(stated: dict[str, Any], line: str) -> None:
    assert line_of(lambda: parse_scenario(stated).built()).startswith(line)


def test_the_command_refuses_an_unknown_frame(in_an_empty_folder: None, capsys: pytest.CaptureFixture[str]) -> None:
    Path("cell.toml").write_text(FRAMED.replace('frame = "bin 2"\nby', 'frame = "bin 1"\nby'))
    said = "cell.toml: task.stages.1.frame: no frame is called 'bin 1'; did you mean bin 2?; there are bin 2"
    assert refusal(capsys, solve, "cell.toml") == said


def test_frames_that_nothing_is_stated_in_change_nothing() -> None:
    assert parsed(frames=[BIN]).table() == parsed(frames=[]).table()
    assert isinstance(parse_stated(content()).frames[0], FrameSection)
