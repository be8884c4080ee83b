"""A small robot, its spheres, and a problem between two boxes and a cylinder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.motion_bench_maker.setting import Setting

URDF = """<robot name="small">
<link name="foot"/><link name="upper"/><link name="lower"/><link name="wrist"/><link name="tool0"/><link name="finger"/>
<joint name="turn" type="revolute"><parent link="foot"/><child link="upper"/><origin xyz="0 0 0.5"/>
 <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="2" effort="10"/></joint>
<joint name="lift" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="1 0 0" rpy="1.5707963267948966 0 0"/>
 <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="3" effort="10"/></joint>
<joint name="roll" type="revolute"><parent link="lower"/><child link="wrist"/><origin xyz="1 0 0"/>
 <axis xyz="1 0 0"/><limit lower="-2" upper="2" velocity="3" effort="10"/></joint>
<joint name="grip" type="fixed"><parent link="wrist"/><child link="tool0"/><origin xyz="0.5 0 0"/></joint>
<joint name="close" type="prismatic"><parent link="tool0"/><child link="finger"/><origin xyz="0 0.1 0"/>
 <axis xyz="0 1 0"/><limit lower="0" upper="0.1" velocity="1" effort="1"/></joint>
</robot>
"""  # noqa: E501
MASS = """<inertial><origin xyz="0.5 0 0"/><mass value="{}"/>
 <inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>"""
MASSES = {"upper": 1.0, "lower": 1.0, "wrist": 1e-6}  # kg, halfway along the links
SPHERES = """[[spheres]]
link = "foot"
center = [0.0, 0.0, 0.1]
radius = 0.4
[[spheres]]
link = "tool0"
center = [0.0, 0.0, 0.0]
radius = 0.05
[[spheres]]
link = "finger"
center = [0.0, 0.0, 0.2]
radius = 0.02
"""
PROBLEM: dict[str, Any] = {
    "name": "table_small-0001",
    "robot": "small",
    "start": [0.0, 0.0, 0.0],
    "goal": [1.0, 0.5, 0.0],
    "obstacles": [
        {"name": "b", "shape": "box", "position": [0, 0, 3], "quaternion": [0, 0, 0, 1], "size": [1, 1, 1]},
        {
            "name": "c",
            "shape": "cylinder",
            "position": [0, -2, 0.5],
            "quaternion": [0, 0, 0, 1],
            "length": 1.0,
            "radius": 0.5,
        },
    ],
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With the robot's files and one of problems."""
    (tmp_path / "small.urdf").write_text(URDF)
    massive = URDF
    for link, mass in MASSES.items():
        massive = massive.replace(f'<link name="{link}"/>', f'<link name="{link}">{MASS.format(mass)}</link>')
    (tmp_path / "massive.urdf").write_text(massive)
    (tmp_path / "small.toml").write_text(SPHERES)
    (tmp_path / "small.jsonl").write_text(json.dumps(PROBLEM) + "\n")
    return tmp_path


@pytest.fixture
def setting(folder: Path) -> Setting:
    """The small robot with limits."""
    return Setting(folder / "small.urdf", folder / "small.toml", (5.0,), (50.0,))
