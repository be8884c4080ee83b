"""MJCF files by their paths: includes, meshes beside them, keyframes as places, and a certified plan."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

import tpbso_casadi as tp
from tpbso_casadi.scenario import ScenarioError

ARM = """
<mujoco model="small">
  <compiler angle="radian" meshdir="meshes"/>
  <include file="assets.xml"/>
  <worldbody>
    <body name="base"><geom type="mesh" mesh="block" pos="0 0 -0.1"/><include file="links.xml"/></body>
  </worldbody>
  <keyframe><key name="home" qpos="0 0.4"/><key name="away" qpos="1 -0.4"/></keyframe>
</mujoco>
"""
ASSETS = '<mujoco><asset><mesh name="block" file="block.stl"/></asset></mujoco>'
LINKS = """
<mujoco>
  <body name="upper" pos="0 0 0.3">
    <joint name="shoulder" axis="0 0 1" range="-2 2"/><geom type="box" size="0.03 0.03 0.05" pos="0.2 0 0"/>
    <body name="lower" pos="0.4 0 0">
      <joint name="elbow" axis="0 1 0" range="-2 2"/><geom type="capsule" size="0.03" fromto="0 0 0 0.2 0 0"/>
      <site name="tool" pos="0.3 0 0"/>
    </body>
  </body>
</mujoco>
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box([0.1] * 3).export(tmp_path / "meshes" / "block.stl")
    for name, text in (("arm.xml", ARM), ("assets.xml", ASSETS), ("links.xml", LINKS)):
        (tmp_path / name).write_text(text)
    return tmp_path


def test_an_arm_of_several_files_moves_between_keyframes(folder: Path) -> None:
    robot = tp.robot(folder / "arm.xml", max_speed=2.0, max_acceleration=8.0)
    assert list(robot.cover) == ["base", "upper"] and robot.table.description().chain.tip_link == "tool"
    plan = tp.plan(robot, start="home", goal="away", evaluations=200)
    assert plan.certified and plan.audit().certified
    stated = robot.tables["robot"].table()
    assert stated["urdf"].endswith("arm.xml") and "<include" not in stated["urdf_text"]


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("links.xml", '<mujoco><include file="arm.xml"/></mujoco>', "it is included twice"),
        ("links.xml", "<mujoco>", "no XML"),
        ("arm.xml", '<mujoco><include file="none.xml"/></mujoco>', "none.xml"),
        ("arm.xml", "<mujoco><include/></mujoco>", "is a folder"),
    ],
)
def test_an_include_that_cannot_be_read_is_named(folder: Path, name: str, text: str, reason: str) -> None:
    (folder / name).write_text(text)
    with pytest.raises(ScenarioError) as caught:
        tp.robot(folder / "arm.xml", max_speed=2.0, max_acceleration=8.0)
    assert str(caught.value).startswith("urdf: ") and reason in str(caught.value) and "\n" not in str(caught.value)
