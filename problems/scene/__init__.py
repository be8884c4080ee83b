"""Obstacles that the robot has to keep clear of."""

from problems.scene.ellipse import Ellipse
from problems.scene.moving import ConstantVelocity, MovingObstacle, ObstacleMotion
from problems.scene.obstacle import Frames, Obstacle, standing
from problems.scene.polygon import MAX_CORNERS, Polygon, Rectangle, crossing_clearance
from problems.scene.solids import Ball, Box, Capsule, Cylinder, Ellipsoid, HalfSpace
from problems.scene.tabulated import Tabulated, first_fault

OBSTACLES: dict[str, type[Obstacle]] = {"ellipse": Ellipse, "box": Rectangle, "polygon": Polygon}

__all__ = [
    "MAX_CORNERS",
    "OBSTACLES",
    "Ball",
    "Box",
    "Capsule",
    "ConstantVelocity",
    "Cylinder",
    "Ellipse",
    "Ellipsoid",
    "Frames",
    "HalfSpace",
    "MovingObstacle",
    "Obstacle",
    "ObstacleMotion",
    "Polygon",
    "Rectangle",
    "Tabulated",
    "crossing_clearance",
    "first_fault",
    "standing",
]
