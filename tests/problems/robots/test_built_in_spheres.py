"""The spheres of the built-in robots are proven to hold the makers' meshes: triangle by triangle, as covers are.

Those of the Panda are in example-robot-data. It has none of a UR5e (a UR5 is another arm) and none of an iiwa: their
meshes are looked for in ``ur_description`` (Universal_Robots_ROS2_Description) and ``iiwa_description`` (iiwa_stack) in
the folders of ``ROS_PACKAGE_PATH``.
"""

from __future__ import annotations

import os
import tomllib
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import problems.robots
from benchmarks.off_the_shelf import ROBOTS
from problems.geometry import Balls, read_mesh, unheld

MODELS = Path(problems.robots.__file__).with_name("models")
OPENINGS, STEP = 81, 0.0005  # of a finger, m, from 0 to 40 mm
PANDA = [*(f"link{number}" for number in range(8)), "hand"]
UR5E = {
    "base": ("base_link", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "shoulder": ("shoulder_link", (0.0, 0.0, 0.0), (0.0, 0.0, 180.0)),
    "upperarm": ("upper_arm_link", (0.0, 0.0, 0.138), (90.0, 0.0, -90.0)),
    "forearm": ("forearm_link", (0.0, 0.0, 0.007), (90.0, 0.0, -90.0)),
    "wrist1": ("wrist_1_link", (0.0, 0.0, -0.127), (90.0, 0.0, 0.0)),
    "wrist2": ("wrist_2_link", (0.0, 0.0, -0.0997), (0.0, 0.0, 0.0)),
    "wrist3": ("wrist_3_link", (0.0, 0.0, -0.0989), (90.0, 0.0, 0.0)),
}
SPANNING = ("upperarm", "forearm")  # whose collision meshes are not the arm: they span the gaps beside its tubes


def balls_of(model: str, link: str) -> Balls:
    """The spheres that the file of a model states in the frame of a link."""
    stated = tomllib.loads((MODELS / f"{model}-spheres.toml").read_text())["spheres"]
    own = [sphere for sphere in stated if sphere["link"] == link]
    return Balls(np.array([sphere["center"] for sphere in own]), np.array([sphere["radius"] for sphere in own]))


def corners_of(path: Path) -> np.ndarray:
    return read_mesh(path.name, path.read_bytes()).corners


def package(name: str) -> Path:
    """The folder of a ROS package, where it is."""
    folders = [Path(folder) / name for folder in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if folder]
    found = next((folder for folder in folders if (folder / "meshes").is_dir()), None)
    if found is None:
        pytest.skip(f"example-robot-data has no meshes of it, and {name} is not in ROS_PACKAGE_PATH")
    return found


@pytest.fixture
def panda() -> Path:
    if not ROBOTS.exists():
        pytest.skip("example-robot-data is not installed")
    return ROBOTS / "panda_description" / "meshes"


@pytest.mark.parametrize(("folder", "kind"), [("collision", "stl"), ("visual", "dae")])
@pytest.mark.parametrize("name", PANDA)
def test_spheres_hold_a_link_of_the_panda(name: str, folder: str, kind: str, panda: Path) -> None:
    corners, balls = corners_of(panda / folder / f"{name}.{kind}"), balls_of("panda", f"panda_{name}")
    assert not len(unheld(corners, balls))
    assert len(unheld(corners, balls.shrunk(0.01)))


@pytest.mark.parametrize(("folder", "kind"), [("collision", "stl"), ("visual", "dae")])
def test_spheres_of_the_hand_hold_its_fingers_at_any_opening(folder: str, kind: str, panda: Path) -> None:
    """Spheres that are half a step smaller hold them at every step."""
    finger, balls = corners_of(panda / folder / f"finger.{kind}"), balls_of("panda", "panda_hand")
    for opening in STEP * np.arange(OPENINGS):
        left = finger + np.array([0.0, opening, 0.0584])
        both = np.concatenate([left, left * np.array([-1.0, -1.0, 1.0])])
        assert not len(unheld(both, balls.shrunk(STEP / 2.0)))


@pytest.mark.parametrize(
    ("name", "folder"),
    [pair for pair in product(UR5E, ("collision", "visual")) if pair not in product(SPANNING, ["collision"])],
)
def test_spheres_hold_a_link_of_the_ur5e(name: str, folder: str) -> None:
    link, place, angles = UR5E[name]
    kind = "stl" if folder == "collision" else "dae"
    corners = corners_of(package("ur_description") / "meshes" / "ur5e" / folder / f"{name}.{kind}")
    placed = corners @ Rotation.from_euler("xyz", angles, degrees=True).as_matrix().T + place
    assert not len(unheld(placed, balls_of("ur5e", link)))


@pytest.mark.parametrize("folder", ["collision", "visual"])
@pytest.mark.parametrize("number", range(8))
def test_spheres_hold_a_link_of_the_iiwa14(number: int, folder: str) -> None:
    corners = corners_of(package("iiwa_description") / "meshes" / "iiwa14" / folder / f"link_{number}.stl")
    assert not len(unheld(corners, balls_of("iiwa14", f"iiwa_link_{number}")))
