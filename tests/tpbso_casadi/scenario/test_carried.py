"""[[carried]] and may_touch: kept clear, weighed, stored and named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from helpers.meshed import write_meshed

import tpbso_casadi as tp
from problems.certify import limit_verdicts
from problems.limits import Clearance, CoverClearance, cover_limits
from problems.motions import Trajectory
from problems.robots import SpatialArm
from tpbso_casadi.scenario import InputFolder, Scenario, ScenarioError, parse_scenario

START, GOAL = [0.0, -0.8, 0.0, -2.2, 0.0, 1.5, 0.8], [0.9, -0.8, 0.0, -2.0, 0.0, 1.5, 0.8]
ENDS = {"start": {"joints": START}, "goal": {"joints": GOAL}}
BOX = {"shape": "box", "center": [0.0, 0.0, 0.1], "size": [0.06, 0.06, 0.2], "mass": 0.5, "name": "part"}
BIN = {"shape": "sphere", "center": [0.0, 0.9, 0.9], "radius": 0.1, "name": "bin"}
REST = Trajectory.standing(np.zeros(7), 1.0)
TABLE = {"shape": "box", "center": [0.45, 0.2, 0.2], "size": [0.5, 0.8, 0.1], "name": "table"}


def scenario(folder: Path | None = None, **keys: Any) -> Scenario:
    content = {"robot": {"model": "panda"}, "task": {"kind": "point-to-point", **ENDS}, **keys}
    found = parse_scenario(content, None if folder is None else InputFolder(folder))
    assert parse_scenario(found.table()) == found
    return found


def arm_of(found: Scenario) -> SpatialArm:
    robot = found.criteria().robot
    assert isinstance(robot, SpatialArm)
    return robot


def test_it_is_kept_clear_and_weighed() -> None:
    bare, holding = arm_of(scenario()), arm_of(scenario(carried=[BOX]))
    new = holding.spheres[len(bare.spheres) :]
    assert {sphere.name for sphere in new} == {"part"} and {sphere.link for sphere in new} == {7}
    assert holding.payload is not None and bare.payload is None
    assert (holding.payload.mass, holding.payload.center) == (0.5, (0.0, 0.0, 0.1))
    theta = np.array([START])
    still = np.zeros_like(theta)
    heavier = holding.dynamics.torques(theta, still, still) - bare.dynamics.torques(theta, still, still)
    assert float(np.abs(np.array(heavier)).max()) > 1.0  # N m


def test_a_payload_that_is_stated_is_carried_too() -> None:
    robot = {"model": "panda", "payload": {"mass": 1.0, "center": [0.0, 0.0, 0.05]}}
    payload = arm_of(scenario(robot=robot, carried=[BOX])).payload
    assert payload is not None and payload.mass == 1.5
    assert payload.center[2] == pytest.approx((0.05 + 0.5 * 0.1) / 1.5)


def test_it_does_not_pass_through_anything() -> None:
    high = TABLE | {"center": [0.45, 0.2, 0.33]}
    with pytest.raises(ScenarioError, match=r"task\.start: part, table: clearance"):
        scenario(carried=[BOX], obstacles=[high]).problem()
    arm = arm_of(scenario(carried=[BOX], obstacles=[high], may_touch=[["table", "part"]]))
    assert arm.may_touch == (("part", "table"),)
    assert "contact of part and table, which may touch" in arm.unjudged


def test_how_many_bodies_of_one_name_may_be_touched_is_said() -> None:
    other = TABLE | {"center": [0.45, -0.9, 0.2]}
    contacts: dict[str, Any] = {"carried": [BOX], "may_touch": [["part", "table"], ["panda_link7", "table"]]}
    several = "contact with any of the 2 bodies that are called table, which may be touched"
    lines = scenario(obstacles=[TABLE, other, BIN], **contacts).criteria().not_judged(REST)
    assert lines.count(several) == 1 and "contact of part and table, which may touch" in lines
    alone = scenario(obstacles=[TABLE, other | {"name": "rack"}, BIN], **contacts).criteria().not_judged(REST)
    assert [line for line in lines if line not in alone] == [several]


SHAPES: list[dict[str, Any]] = [
    {"shape": "sphere", "center": [0, 0, 0.1], "radius": 0.05},
    {"shape": "cylinder", "center": [0, 0, 0.1], "radius": 0.05, "length": 0.1},
    {"shape": "capsule", "center": [0, 0, 0.1], "radius": 0.03, "length": 0.1},
    {"shape": "ellipsoid", "center": [0, 0, 0.1], "semi_axes": [0.05, 0.03, 0.08]},
    {"shape": "polytope", "points": [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]},
    {"shape": "mesh", "file": "part.stl", "scale": 0.001, "center": [0, 0, 0.1]},
    {"shape": "points", "file": "part.npy", "radius": 0.01, "center": [0, 0, 0.1]},
]


def test_any_shape_is_carried(tmp_path: Path) -> None:
    trimesh.creation.icosphere(2, 50.0).export(tmp_path / "part.stl")
    np.save(tmp_path / "part.npy", np.random.default_rng(0).uniform(-0.03, 0.03, (50, 3)))
    parts = [shape | {"mass": 0.2, "name": f"a {shape['shape']}"} for shape in SHAPES]
    arm = arm_of(scenario(tmp_path, carried=parts))
    assert arm.payload is not None and arm.payload.mass == pytest.approx(0.2 * len(parts))
    for part in parts:
        own = [sphere for sphere in arm.spheres if sphere.name == part["name"]]
        assert own and max(np.linalg.norm(np.array(sphere.center)) + sphere.radius for sphere in own) < 0.5


def test_a_mass_that_is_not_stated_is_said() -> None:
    part = {key: value for key, value in BOX.items() if key != "mass"}
    arm = arm_of(scenario(carried=[part]))
    assert arm.payload is None and "the weight of part: no mass is stated" in arm.unjudged


def test_a_link_in_the_plane_may_touch_an_obstacle() -> None:
    content: dict[str, Any] = tp.builtin("obstacle-3").table()
    content["obstacles"][0]["name"] = "post"
    (before,) = (limit for limit in parse_scenario(content).problem().criteria.limits if isinstance(limit, Clearance))
    problem = parse_scenario(content | {"may_touch": [["link 2", "post"]]}).problem()
    (limit,) = (limit for limit in problem.criteria.limits if isinstance(limit, Clearance))
    seen = {(pair.body.name, pair.number) for pair in limit.pairs}
    assert {(pair.body.name, pair.number) for pair in before.pairs} - seen == {("link 2", 1)}
    assert any("post" in str(pair) for pair in limit.pairs)


def test_a_mesh_without_a_name_is_called_by_its_number(tmp_path: Path) -> None:
    blocks = [trimesh.creation.box([0.1] * 3, trimesh.transformations.translation_matrix([x, 0, 0])) for x in (0, 0.3)]
    (tmp_path / "two.stl").write_bytes(trimesh.util.concatenate(blocks).export(file_type="stl"))
    two = {"shape": "mesh", "file": "two.stl", "center": [0.5, 0.5, 0.8]}
    arm = arm_of(scenario(tmp_path, obstacles=[two], may_touch=[["obstacle 1", "panda_hand"]]))
    assert arm.may_touch == (("panda_hand", "obstacle 1"),)


def test_own_links_may_touch() -> None:
    keys: dict[str, Any] = {"carried": [BOX], "may_touch": [["part", "panda_link0"]]}
    arm, before = arm_of(scenario(**keys)), arm_of(scenario(carried=[BOX]))

    def together(robot: SpatialArm) -> set[frozenset[str]]:
        pairs = (*robot.kept_pairs, *robot.proven_pairs)
        return {frozenset((robot.spheres[a].name, robot.spheres[b].name)) for a, b in pairs}

    assert together(before) - together(arm) == {frozenset(("part", "panda_link0"))}
    assert any("part and panda_link0" in line or "panda_link0 and part" in line for line in arm.unjudged)


def test_an_arm_with_meshes_holds_a_cover_of_it(tmp_path: Path) -> None:
    robot = {"urdf": str(write_meshed(tmp_path)), "max_acceleration": 5.0}
    content: dict[str, Any] = {
        "robot": robot,
        "task": {"kind": "point-to-point", "start": {"joints": [0.0, 0.0, 0.0]}, "goal": {"joints": [0.4, 0.3, 0.2]}},
        "carried": [BOX | {"mass": 0.1}],
        "obstacles": [{"shape": "box", "center": [0.0, 0.0, 1.5], "size": [0.1, 0.1, 0.1], "name": "lamp"}],
    }
    found = parse_scenario(content, InputFolder(Path(), outside_allowed=True))
    arm = arm_of(found)
    assert arm.cover is not None
    link = next(link for link in arm.cover.links if link.name == "part")
    assert link.body == arm.dof and link.overhang < 0.005
    names = {frozenset((arm.cover.links[a].name, arm.cover.links[b].name)) for a, b in arm.cover.pairs}
    assert {frozenset(("lower", "part")), frozenset(("middle", "part"))} <= names
    limit = next(limit for limit in cover_limits(arm, found.criteria().obstacles) if isinstance(limit, CoverClearance))
    still = Trajectory(np.array([0.0, 1.0]), np.zeros((1, 1, arm.dof)))
    (verdict,) = limit_verdicts([limit], still)
    assert verdict.where.startswith("part, lamp")
    others = replace(limit, robot=replace(arm, may_touch=(("part", "lamp"),)))
    (verdict,) = limit_verdicts([others], still)
    assert not verdict.where.startswith("part")


def test_from_python() -> None:
    part = tp.Box(center=(0.0, 0.0, 0.1), size=(0.06, 0.06, 0.2), name="part")
    found = tp.scenario_of("panda", **ENDS, obstacles=[TABLE], carried=[part], may_touch=[("part", "table")])
    assert arm_of(found).may_touch == (("part", "table"),)
    assert tp.scenario_of(found, carried=[]).carried == []
    with pytest.raises(ScenarioError, match="carried: a list is needed"):
        tp.scenario_of("panda", **ENDS, carried=5)
