"""Bodies in numbers: meshes and clouds of points, balls, convex parts and boxes that hold them, and trees of balls."""

from problems.geometry.cloud import boxes_around, read_cloud
from problems.geometry.convex import convex_parts
from problems.geometry.cover import Cover, cover_of
from problems.geometry.hull import Hull, enclosing
from problems.geometry.mesh import (
    Mesh,
    ball_corners,
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
    "Hull",
    "Mesh",
    "Triangles",
    "ball_corners",
    "box_corners",
    "boxes_around",
    "capsule_corners",
    "convex_parts",
    "cover_of",
    "cylinder_corners",
    "enclosing",
    "facing_out",
    "read_cloud",
    "read_mesh",
    "read_parts",
    "simplified",
    "unheld",
]
