"""Where packages of ROS and the files in them are looked for, and what is said of those that are nowhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from problems import InvalidProblem
from problems.robots import MeshShape
from problems.robots.transform import UNMOVED
from tpbso_casadi import ScenarioError
from tpbso_casadi.scenario import InputFolder, RobotFiles

MESH = "package://arm_description/meshes/a.stl"
PLACES = {  # of the package by what names its folder; in a folder of its name, or with a manifest
    "its folder": "arm_description",
    "beside its folder": "src/arm_description",
    "a manifest": "src/robot/package.xml",
    "packages": "away/elsewhere",
    "ROS_PACKAGE_PATH": "away/arm_description",
    "ROS_PACKAGE_PATH, deep": "away/repository/robots/arm/package.xml",
    "ROS_PACKAGE_PATH, itself": "away/package.xml",
    "AMENT_PREFIX_PATH": "away/share/arm_description",
    "AMENT_PREFIX_PATH, manifest": "away/share/arm/package.xml",
}


@pytest.fixture(autouse=True)
def no_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)


def package_at(path: Path) -> Path:
    """A package with a mesh, in a folder, or in that of a manifest; its folder."""
    folder = path.parent if path.name == "package.xml" else path
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "a.stl").write_bytes(b"solid")
    if path.name == "package.xml":
        path.write_text("<package><name> arm_description </name></package>")
    return folder


def files(folder: Path, outside_allowed: bool = False, **packages: str) -> RobotFiles:
    (folder / "src" / "config").mkdir(parents=True, exist_ok=True)
    return RobotFiles(InputFolder(folder, outside_allowed), packages, near="src/config")


def content(found: RobotFiles, name: str) -> bytes:
    """The content of a mesh that a URDF names."""
    return found.meshes("src/config/arm.urdf")(MeshShape(UNMOVED, file=name))


@pytest.mark.parametrize("where", PLACES)
def test_packages_are_found(where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decoy = tmp_path / "src" / "decoy"
    decoy.mkdir(parents=True)
    (decoy / "package.xml").write_text("<package><name>arm</name></package>")
    place = package_at(tmp_path / PLACES[where])
    if where.endswith("PATH") or ", " in where:
        monkeypatch.setenv(where.partition(",")[0], f"/nowhere:{tmp_path / 'away'}")
    stated = {"arm_description": "away/elsewhere"} if where == "packages" else {}
    found = files(tmp_path, **stated)
    assert found.package("arm_description", tmp_path) == place
    assert found.path(MESH) == place / "meshes" / "a.stl"
    assert content(found, MESH) == b"solid"


@pytest.mark.parametrize("name", ["package:///meshes/a.stl", "../meshes/a.stl", "file://{}/src/meshes/a.stl"])
def test_files_beside_the_urdf_are_found(name: str, tmp_path: Path) -> None:
    package_at(tmp_path / "src")
    assert content(files(tmp_path), name.format(tmp_path)) == b"solid"


def test_what_is_nowhere_is_said_with_what_was_searched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_PACKAGE_PATH", "/nowhere")
    beside = re.escape(str(tmp_path / "src" / "config"))
    searched = r"neither in ROS_PACKAGE_PATH \(/nowhere\), AMENT_PREFIX_PATH \(not set\), nor in or above (\S+ or )?"
    cure = r"; packages = \{ arm_description = \"FOLDER\" \} says where$"
    line = f"package 'arm_description' is {searched}{beside}{cure}"
    with pytest.raises(ScenarioError, match=f"^{line}"):
        files(tmp_path).path(MESH)
    with pytest.raises(InvalidProblem, match=f"^mesh: {line}"):
        content(files(tmp_path), MESH)
    with pytest.raises(InvalidProblem, match=f"^mesh: there is no such file in {beside}$"):
        content(files(tmp_path), "package:///a.stl")
    with pytest.raises(ScenarioError, match=r"^there is no such file in \S+/gone$"):
        files(tmp_path, arm_description="gone").path(MESH)
    with pytest.raises(ScenarioError, match=r"^package 'arm_description': there is no folder gone$"):
        files(tmp_path, arm_description="gone").package("arm_description", tmp_path)
    (package_at(tmp_path / "arm_description") / "meshes" / "a.stl").unlink()
    with pytest.raises(InvalidProblem, match=rf"^mesh: there is no such file in \S+/arm_description{cure}"):
        content(files(tmp_path), MESH)
    (tmp_path / "src" / "arm_description").mkdir()
    (tmp_path / "src" / "arm_description" / "package.xml").write_bytes(b"\xff<name>\xff</name>")
    assert files(tmp_path).package("arm_description", tmp_path) == tmp_path / "arm_description"


def test_packages_outside_the_scenarios_folder_need_leave_unless_the_environment_names_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = package_at(tmp_path / "arm_description")
    inner = tmp_path / "scenario"
    inner.mkdir()
    with pytest.raises(ScenarioError, match="lies outside the scenario's folder; --allow-outside-files"):
        files(inner).path(MESH)
    with pytest.raises(ScenarioError, match="lies outside the scenario's folder; --allow-outside-files"):
        files(inner).package("arm_description", tmp_path)
    assert files(inner, outside_allowed=True).package("arm_description", tmp_path) == place
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert files(inner).path(MESH) == place / "meshes" / "a.stl"


def test_a_path_that_leaves_the_packages_of_the_environment_needs_leave(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package_at(tmp_path / "packages" / "arm_description")
    (tmp_path / "secret").write_text("none of theirs")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "packages"))
    found = files(tmp_path / "scenario")
    assert found.path("package://arm_description/../arm_description/meshes/a.stl").exists()
    with pytest.raises(ScenarioError, match="lies outside the scenario's folder; --allow-outside-files"):
        found.path("package://arm_description/../../secret")
