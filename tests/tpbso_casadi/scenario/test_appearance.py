"""What a URDF shows, in scenarios and runs: stored with a plan, told where it is missing, and never in the way."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Any

import pytest
import trimesh
from helpers.meshed import meshed_urdf, write_meshed

import tpbso_casadi as tp
from problems.robots import SpatialArm
from tpbso_casadi.animation.frames import frames_of
from tpbso_casadi.animation.player_data import space_data
from tpbso_casadi.judging.run import Run
from tpbso_casadi.scenario import ScenarioError, parse_scenario

LIMITS: dict[str, Any] = {"max_acceleration": 5.0}
VISUAL = """<visual><origin xyz="0 0 0.17"/><geometry><mesh filename="{file}" scale="0.001 0.001 0.001"/></geometry>
<material name="blue"><color rgba="0 0 1 1"/></material></visual>"""


def shown_urdf(folder: Path, file: str) -> Path:
    """The arm of bars; its upper link is shown by a file of its own."""
    urdf = write_meshed(folder)
    upper = '<link name="upper">'
    urdf.write_text(meshed_urdf().replace(upper, upper + VISUAL.format(file=file)))
    return urdf


def built(urdf: Path) -> SpatialArm:
    model = tp.robot(urdf, **LIMITS).model
    assert isinstance(model, SpatialArm)
    return model


def colours(arm: SpatialArm) -> dict[str, str]:
    return {look.link: look.colour for look in arm.appearances}


def test_visual_meshes_are_shown_and_collision_meshes_of_what_has_none(tmp_path: Path) -> None:
    urdf = shown_urdf(tmp_path, "../meshes/round.stl")
    ball = trimesh.creation.icosphere(subdivisions=4, radius=100.0)
    (urdf.parent.parent / "meshes" / "round.stl").write_bytes(ball.export(file_type="stl"))
    arm = built(urdf)
    assert colours(arm) == {"lower": "", "middle": "", "upper": "#0000ff"}
    triangles = {look.link: look.triangles for look in arm.appearances}
    assert len(triangles["lower"].faces) == 12 and 300 < len(triangles["upper"].faces) < 3_000
    assert triangles["upper"].vertices[:, 2].max() == pytest.approx(0.27, abs=0.005)
    assert arm.cover is not None and arm.cover.links[2].balls.radii.max() < 0.05  # that is of the bar still


def test_what_cannot_be_shown_is_told_in_one_note_and_stops_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    urdf = shown_urdf(tmp_path, "../meshes/missing.stl")
    with caplog.at_level(logging.WARNING):
        arm = built(urdf)
    [record] = caplog.records
    said = "robot.urdf: not all links are drawn as the URDF shows them: 'upper': mesh ../meshes/missing.stl: "
    assert record.getMessage() == said + "there is no such file"
    assert colours(arm) == {"lower": "", "middle": "", "upper": ""}


def test_a_visual_outside_the_folder_is_not_read(tmp_path: Path) -> None:
    urdf = shown_urdf(tmp_path / "inside", "../../../secret.stl")
    (tmp_path / "secret.stl").write_bytes(trimesh.creation.icosphere(radius=100.0).export(file_type="stl"))
    scenario = tmp_path / "inside" / "move.toml"
    scenario.write_text(
        f'[robot]\nurdf = "{urdf.relative_to(scenario.parent)}"\nmax_acceleration = 5.0\n'
        "[task]\nkind = 'point-to-point'\nstart = { joints = [0.0, 0.5, 0.5] }\ngoal = { joints = [0.5, 0.5, 0.5] }\n"
    )
    inside, outside = (tp.read_scenario(scenario, outside_allowed=allowed).robot for allowed in (False, True))
    assert inside is not None and outside is not None
    assert colours(inside.build())["upper"] == "" and colours(outside.build())["upper"] == "#0000ff"


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> tp.Plan:
    urdf = shown_urdf(tmp_path_factory.mktemp("shown"), "../meshes/lower.stl")
    ends: dict[str, Any] = {"start": {"joints": [-0.5, 0.6, 1.2]}, "goal": {"joints": [0.5, 0.6, 1.2]}}
    return tp.plan(tp.robot(urdf, **LIMITS), evaluations=200, **ends)


def test_a_run_shows_the_robot_without_the_urdf(plan: tp.Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / "run", figures=())
    stored = json.loads((tmp_path / "run" / "result.json").read_text())["scenario"]
    assert 0 < len(stored["robot"]["looks_text"]) < 2_000
    replayed = tp.read_run(tmp_path / "run")
    data = space_data(frames_of(replayed.motion, 5))
    assert [(look["body"], len(look["faces"])) for look in data["looks"]] == [(1, 12), (2, 12), (3, 12)]
    assert data["bare"] == [] and len(data["bodies"]) == 5


def test_looks_change_neither_key_nor_motion(plan: tp.Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / "run", figures=())
    stored = json.loads((tmp_path / "run" / "result.json").read_text())["scenario"]
    with_looks, without = parse_scenario(stored), parse_scenario({**stored, "robot": dict(stored["robot"])})
    assert without.robot is not None
    without = without.replaced(robot=without.robot.replaced(looks_text=None))
    assert with_looks.robot is not None and with_looks.robot.build() == without.robot.build()
    assert with_looks.robot.build().appearances and not without.robot.build().appearances
    assert Run("case", "solver", with_looks).key == Run("case", "solver", without).key


def test_looks_that_are_none_are_refused_in_one_line(plan: tp.Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / "run", figures=())
    stored = json.loads((tmp_path / "run" / "result.json").read_text())["scenario"]
    stored["robot"]["looks_text"] = "{}x"
    with pytest.raises(ScenarioError, match=r"^robot\.looks: no looks of links: [^\n]*$"):
        parse_scenario(stored).problem()
