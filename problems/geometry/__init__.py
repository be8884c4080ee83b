"""Bodies in numbers: meshes and clouds of points, balls, convex parts and boxes that hold them, and trees of balls."""

from problems.geometry.cloud import boxes_around, read_cloud
from problems.geometry.convex import convex_parts
from problems.geometry.cover import Cover, cover_of
from problems.geometry.hull import Hull, enclosing
from problems.geometry.mesh import Mesh, ball_corners, box_corners, cylinder_corners, read_mesh
from problems.geometry.proof import Balls, unheld
from problems.geometry.tree import BallTree

__all__ = [
    "BallTree",
    "Balls",
    "Cover",
    "Hull",
    "Mesh",
    "ball_corners",
    "box_corners",
    "boxes_around",
    "convex_parts",
    "cover_of",
    "cylinder_corners",
    "enclosing",
    "read_cloud",
    "read_mesh",
    "unheld",
]
