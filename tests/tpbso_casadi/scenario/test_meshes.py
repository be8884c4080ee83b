"""Robots whose links are meshes: where these are looked for, what is refused, what a plan says and keeps."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.meshed import meshed_urdf, write_meshed

import tpbso_casadi as tp
from problems.certify import CertificateStatus, WorstIs, limit_verdicts
from problems.limits import cover_limits
from problems.motions import Trajectory
from problems.robots import SpatialArm
from problems.scene.solids import Box
from tpbso_casadi.animation.frames import judged_frames
from tpbso_casadi.animation.player_data import shared_data
from tpbso_casadi.figures.path import nearest_of
from tpbso_casadi.scenario import ScenarioError, parse_scenario

LIMITS: dict[str, Any] = {"max_acceleration": 5.0}


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_meshed(tmp_path_factory.mktemp("meshed"))


@pytest.fixture(scope="module")
def arm(urdf: Path) -> SpatialArm:
    model = tp.robot(urdf, **LIMITS).model
    assert isinstance(model, SpatialArm)
    return model


def test_the_cover_is_of_the_meshes_where_they_stand(arm: SpatialArm) -> None:
    assert arm.cover is not None
    assert [link.name for link in arm.cover.links] == ["lower", "middle", "upper"]
    for link in arm.cover.links:
        reach = np.abs(link.balls.centers - [0.0, 0.0, 0.17]) + link.balls.radii[:, None]
        np.testing.assert_allclose(reach.max(axis=0), [0.032, 0.032, 0.152], atol=2e-4)
        assert link.overhang < 0.005
    assert arm.cover.pairs == ((0, 2),)
    assert {sphere.name for sphere in arm.spheres} == {"lower", "middle", "upper"}
    assert all(sphere.inner is not None and sphere.inner < sphere.radius for sphere in arm.spheres)
    assert arm.left_out.contacts == ("own links that a joint connects: lower and middle, middle and upper",)
    assert arm.left_out.others == ("torques: no masses are stated for lower, middle, upper",)


SHOWN = '<link name="upper"><visual><geometry>{}</geometry></visual>'


def test_what_is_shown_of_links_is_their_geometry_if_that_is_wished(tmp_path: Path) -> None:
    """A link that shows a slim box is one; the others, of which nothing is shown, stay as they are."""
    urdf = write_meshed(tmp_path)
    urdf.write_text(meshed_urdf().replace('<link name="upper">', SHOWN.format('<box size="0.02 0.02 0.1"/>')))
    for geometry, across in (("visual", 0.012), ("collision", 0.032)):
        arm = tp.robot(urdf, geometry=geometry, **LIMITS).model
        assert isinstance(arm, SpatialArm) and arm.cover is not None
        widths = [float((np.abs(each.balls.centers[:, 0]) + each.balls.radii).max()) for each in arm.cover.links]
        np.testing.assert_allclose(widths, [0.032, 0.032, across], atol=2e-4)


def test_visual_geometry_that_cannot_be_is_refused(tmp_path: Path) -> None:
    urdf = write_meshed(tmp_path)
    urdf.write_text(meshed_urdf().replace('<link name="upper">', SHOWN.format('<cone radius="1"/>')))
    with pytest.raises(ScenarioError, match=r"urdf: link 'upper': its visual geometry is not read: .* a shape <cone>"):
        tp.robot(urdf, geometry="visual", **LIMITS)
    with pytest.raises(ScenarioError, match="geometry: a robot that is built in has its own"):
        _ = tp.robot("panda", geometry="visual").model
    with pytest.raises(ScenarioError, match="geometry: input should be 'collision' or 'visual'"):
        tp.robot(urdf, geometry="shown", **LIMITS)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ("missing", r"there is no such file in \S+/bars; packages = \{ bars = \"FOLDER\" \} says where"),
        ("broken", "it has no triangles"),
        ("huge", "it is 60 x 60 x 300 m, of at most 10: is it in mm, and scale is missing"),
        ("kind", "it ends with 'step'; stl, obj, dae are read"),
    ],
)
def test_what_cannot_be_read_is_refused_unless_it_is_ignored(change: str, reason: str, tmp_path: Path) -> None:
    urdf = write_meshed(tmp_path)
    mesh, text = tmp_path / "bars" / "meshes" / "upper.stl", meshed_urdf()
    if change == "missing":
        mesh.unlink()
    elif change == "broken":
        mesh.write_bytes(b"")
    elif change == "huge":
        before, _, after = text.rpartition(' scale="0.001 0.001 0.001"')
        urdf.write_text(before + after)
    else:
        mesh.rename(mesh.with_suffix(".step"))
        urdf.write_text(text.replace("upper.stl", "upper.step"))
    cure = r"; state spheres for it, or leave it out of every verdict: ignore_geometry = \['upper'\]$"
    with pytest.raises(ScenarioError, match=f"^urdf: link 'upper': its mesh package://.*: {reason}.*{cure}"):
        tp.robot(urdf, **LIMITS)
    model = tp.robot(urdf, ignore_geometry=["upper"], **LIMITS).model
    assert model.left_out.links == ("upper",)
    assert model.assumed == "without the geometry of upper"


def plan_past(urdf: Path, obstacles: list[dict[str, Any]], **options: Any) -> Any:
    return tp.plan(
        tp.robot(urdf, **LIMITS),
        start={"joints": [-0.8, 0.6, 1.2]},
        goal={"joints": [0.8, 0.6, 1.2]},
        obstacles=obstacles,
        evaluations=300,
        **options,
    )


PILLAR: dict[str, Any] = {"shape": "box", "center": [0.45, 0.0, 0.5], "size": [0.05, 0.05, 1.0]}


@pytest.fixture(scope="module")
def plan(urdf: Path) -> tp.Plan:
    return plan_past(urdf, [PILLAR])


def frames(theta: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rotations and origins of the three links."""
    c, s = np.cos(theta), np.sin(theta)
    turn = np.array([[c[0], -s[0], 0.0], [s[0], c[0], 0.0], [0.0, 0.0, 1.0]])
    place, found = np.array([0.0, 0.0, 0.1]), []
    for number in range(3):
        found.append((turn, place))
        if number < 2:
            place = place + turn @ [0.0, 0.0, 0.36]
            cos, sin = c[number + 1], s[number + 1]
            turn = turn @ np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    return found


def test_a_plan_past_a_pillar_is_certified_and_clear(plan: tp.Plan) -> None:
    """By points all over the boxes themselves, at 500 times."""
    assert plan.certified
    verdict = next(verdict for verdict in plan.motion.verdicts if verdict.name == "clearance")
    shares = np.linspace(-1.0, 1.0, 7)
    grid = np.stack(np.meshgrid(shares, shares, shares, indexing="ij"), axis=-1).reshape(-1, 3)
    points = grid[np.abs(grid).max(axis=1) == 1.0] * [0.03, 0.03, 0.15] + [0.0, 0.0, 0.17]
    least = np.inf
    for theta in plan.motion.trajectory.at(np.linspace(0.0, plan.motion.trajectory.duration, 500)):
        for turn, shift in frames(theta):
            away = np.maximum(np.abs(points @ turn.T + shift - PILLAR["center"]) - np.array(PILLAR["size"]) / 2.0, 0.0)
            least = min(least, float(np.linalg.norm(away, axis=1).min()))
    assert 0.0 < verdict.worst <= least


def test_a_motion_through_the_pillar_is_violated(arm: SpatialArm) -> None:
    """The joints turn from one side to the other: a few spheres of the links' ends would not notice."""
    motion = Trajectory(np.array([0.0, 1.0]), np.array([[[1.6, 0.0, 0.0]], [[-0.8, 0.6, 1.2]]]))
    box = Box(center=tuple(PILLAR["center"]), size=tuple(PILLAR["size"]))
    (verdict,) = limit_verdicts(cover_limits(arm, [box]), motion)
    assert (verdict.name, verdict.status) == ("clearance", CertificateStatus.VIOLATED)
    assert verdict.worst < -0.01
    assert verdict.where.startswith(("middle, obstacle 1, t = ", "upper, obstacle 1, t = "))


def test_start_and_goal_are_judged_by_the_meshes(urdf: Path) -> None:
    """A box 8 mm from the upper link: nearer than the spheres for searches stick out."""
    top = {"shape": "box", "center": [0.0, 0.0, 1.14 + 0.008 + 0.05], "size": [0.1, 0.1, 0.1]}
    still = {"joints": [0.0, 0.0, 0.0]}
    keys: dict[str, Any] = {"obstacles": [top], "evaluations": 300, "start": still}
    plan = tp.plan(tp.robot(urdf, **LIMITS), goal={"joints": [0.5, 0.5, 0.5]}, **keys)
    assert plan.certified
    with pytest.raises(ScenarioError, match=r"^start: upper, obstacle 1, Box at|^start: upper, obstacle 1: clearance"):
        tp.plan(tp.robot(urdf, **LIMITS), goal={"joints": [0.5, 0.5, 0.5]}, margin=0.01, **keys)


def test_a_run_is_complete_without_the_meshes(plan: tp.Plan, arm: SpatialArm, tmp_path: Path) -> None:
    plan.save(tmp_path / "run", figures=())
    stored = json.loads((tmp_path / "run" / "result.json").read_text())["scenario"]
    assert len(stored["robot"]["covers_text"]) < 100_000
    robot = parse_scenario(stored).robot.build()
    assert isinstance(robot, SpatialArm)
    assert robot.cover == arm.cover
    assert robot.spheres == arm.spheres


def test_one_clearance_is_said_one_way(plan: tp.Plan) -> None:
    """The proven bound is rounded down, what is found is no less; figures and players use the same words."""
    verdict = next(verdict for verdict in plan.motion.verdicts if verdict.name == "clearance")
    closest = plan.motion.closest_approach
    assert closest is not None and verdict.worst_is is WorstIs.BOUND
    words = plan.motion.clearance_in_words
    said = re.fullmatch(r"clearance at least (\d+\.\d) mm, proven; (\d+\.\d) mm found at (\S+) s", words)
    assert said is not None
    proven, found, time = map(float, said.groups())
    assert verdict.worst - 1e-4 < proven / 1e3 <= verdict.worst <= closest.distance
    assert found / 1e3 == pytest.approx(closest.distance, abs=5.1e-5)
    frames = judged_frames(plan.motion)
    data = shared_data(frames)
    assert data["clearance"] == words
    seen = data["closest"]
    assert all("obstacle 1" in name for name in seen["names"])
    gaps = seen["distances"]
    assert closest.distance - 1e-5 <= min(gaps) < closest.distance + 1e-3  # the player's is that of the cover, too
    nearest = nearest_of(plan.motion)
    assert nearest is not None and nearest.label == f"{found} mm found at {time:g} s"
    assert np.linalg.norm(np.subtract(*nearest.points)) == pytest.approx(closest.distance, abs=1e-6)
