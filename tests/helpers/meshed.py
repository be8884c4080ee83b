"""An arm whose links are meshes: three joints, boxes of 6 cm x 6 cm x 30 cm in STL files, in mm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from problems.geometry import box_corners, cover_of
from problems.robots import LinkCover, SpatialArm, complete_arm, read_urdf

NAMES = ("lower", "middle", "upper")

LINK = """<link name="{name}"><collision><origin xyz="0 0 0.17"/>
<geometry><mesh filename="{file}" scale="0.001 0.001 0.001"/></geometry></collision></link>
"""
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="0 0 {height}"/><axis xyz="{axis}"/><limit lower="-3" upper="3" velocity="2" effort="50"/></joint>
"""
FILE = "package://bars/meshes/{name}.stl"


def meshed_urdf(file: str = FILE) -> str:
    """An arm that stands on a foot; ``file`` names the mesh of each link."""
    links = "".join(LINK.format(name=name, file=file.format(name=name)) for name in NAMES)
    joints = "".join(
        JOINT.format(name=f"j{number}", parent=parent, child=child, height=height, axis=axis)
        for number, (parent, child, height, axis) in enumerate(
            (("foot", "lower", 0.1, "0 0 1"), ("lower", "middle", 0.36, "0 1 0"), ("middle", "upper", 0.36, "0 1 0")),
            start=1,
        )
    )
    flange = (
        '<joint name="end" type="fixed"><parent link="upper"/><child link="tool0"/><origin xyz="0 0 0.34"/></joint>'
    )
    return f'<robot name="bars"><link name="foot"/><link name="tool0"/>{links}{joints}{flange}</robot>'


def write_meshed(folder: Path, file: str = FILE) -> Path:
    """The URDF in a folder, with its meshes in a package beside it; returns the file's path."""
    meshes = folder / "bars" / "meshes"
    meshes.mkdir(parents=True)
    for name in NAMES:
        (meshes / f"{name}.stl").write_bytes(trimesh.creation.box((60.0, 60.0, 300.0)).export(file_type="stl"))
    urdf = folder / "bars" / "urdf" / "arm.urdf"
    urdf.parent.mkdir()
    urdf.write_text(meshed_urdf(file))
    return urdf


def covered_arm() -> SpatialArm:
    """The same arm with covers of 20 mm and of 4 mm, whose links keep apart."""
    corners = box_corners((0.06, 0.06, 0.3)) + np.array([0.0, 0.0, 0.17])
    coarse, fine = cover_of(corners, 0.02), cover_of(corners, 0.004)
    description = read_urdf(meshed_urdf()).with_covers({name: LinkCover(name, 0.02, coarse, fine) for name in NAMES})
    arm = complete_arm(description, description.arm(max_speed=2.0, max_acceleration=5.0))
    return replace(arm, self_collision=True)
