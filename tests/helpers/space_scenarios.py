"""Scenarios of a small robot in space, complete without files."""

from typing import Any

URDF = """<robot name="short">
<link name="foot"/><link name="shoulder"/><link name="upper"/><link name="lower"/><link name="hand"/>
<joint name="turn" type="revolute"><parent link="foot"/><child link="shoulder"/><origin xyz="0 0 0.3"/>
 <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="2" effort="10"/></joint>
<joint name="lift" type="revolute"><parent link="shoulder"/><child link="upper"/>
 <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
<joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.4"/>
 <axis xyz="0 1 0"/><limit lower="-2.8" upper="2.8" velocity="2" effort="10"/></joint>
<joint name="grip" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0 0 0.4"/></joint>
</robot>
"""
SPHERES = '[[spheres]]\nlink = "hand"\ncenter = [0.0, 0.0, 0.0]\nradius = 0.04\n'
BOX = {"shape": "box", "center": [0.45, 0.25, 0.55], "size": [0.1, 0.1, 0.1]}
GOAL = {"position": [0.3, 0.45, 0.6]}  # reached with the elbow up or down


def space_scenario(**tables: Any) -> dict[str, Any]:
    """A move to a position behind a box; the tables given are added to, key by key, or take the place of a list."""
    content: dict[str, Any] = {
        "robot": {"urdf": "short.urdf", "urdf_text": URDF, "spheres_text": SPHERES, "max_acceleration": 8.0},
        "task": {"kind": "point-to-point", "start": {"joints": [-0.5, 0.8, 0.6]}, "goal": GOAL},
        "obstacles": [BOX],
        "model": {"samples": 30, "self_collision": False},
        "solver": {"name": "lshade", "evaluations": 1500},
    }
    for name, table in tables.items():
        content[name] = table if isinstance(table, list) else content[name] | table
    return content
