"""Obstacles that the robot has to keep clear of."""

from problems.scene.box import Box
from problems.scene.ellipse import Ellipse
from problems.scene.obstacle import Obstacle
from problems.scene.polygon import Polygon

OBSTACLES: dict[str, type[Obstacle]] = {"ellipse": Ellipse, "box": Box, "polygon": Polygon}

__all__ = ["OBSTACLES", "Box", "Ellipse", "Obstacle", "Polygon"]
