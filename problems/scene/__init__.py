"""Obstacles that the robot has to keep clear of."""

from problems.scene.ellipse import Ellipse
from problems.scene.obstacle import Obstacle
from problems.scene.polygon import Polygon
from problems.scene.rectangle import Rectangle

OBSTACLES: dict[str, type[Obstacle]] = {"ellipse": Ellipse, "box": Rectangle, "polygon": Polygon}

__all__ = ["OBSTACLES", "Ellipse", "Obstacle", "Polygon", "Rectangle"]
