"""Bodies in numbers: meshes, balls that are proven to hold them, and trees of balls."""

from problems.geometry.cover import Cover, cover_of
from problems.geometry.mesh import Mesh, box_corners, cylinder_corners, read_mesh
from problems.geometry.proof import Balls, unheld
from problems.geometry.tree import BallTree

__all__ = ["BallTree", "Balls", "Cover", "Mesh", "box_corners", "cover_of", "cylinder_corners", "read_mesh", "unheld"]
