"""Bodies in numbers: meshes, balls that are proven to hold them, and trees of balls."""

from problems.geometry.cover import Cover, cover_of
from problems.geometry.mesh import (
    Mesh,
    box_corners,
    capsule_corners,
    cylinder_corners,
    facing_out,
    read_mesh,
    read_parts,
)
from problems.geometry.proof import Balls, unheld
from problems.geometry.tree import BallTree
from problems.geometry.triangles import Triangles, simplified

__all__ = [
    "BallTree",
    "Balls",
    "Cover",
    "Mesh",
    "Triangles",
    "box_corners",
    "capsule_corners",
    "cover_of",
    "cylinder_corners",
    "facing_out",
    "read_mesh",
    "read_parts",
    "simplified",
    "unheld",
]
