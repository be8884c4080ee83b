"""Obstacles that the robot has to keep clear of."""

from problems.scene.ellipse import Ellipse
from problems.scene.moving.constant_velocity import ConstantVelocity
from problems.scene.moving.moving_obstacle import MovingObstacle
from problems.scene.moving.tabulated import Tabulated
from problems.scene.obstacle import Obstacle
from problems.scene.polygon import Polygon
from problems.scene.rectangle import Rectangle
from problems.scene.solids.ball import Ball
from problems.scene.solids.box import Box
from problems.scene.solids.capsule import Capsule
from problems.scene.solids.cylinder import Cylinder
from problems.scene.solids.ellipsoid import Ellipsoid
from problems.scene.solids.half_space import HalfSpace

OBSTACLES: dict[str, type[Obstacle]] = {"ellipse": Ellipse, "box": Rectangle, "polygon": Polygon}

__all__ = [
    "OBSTACLES",
    "Ball",
    "Box",
    "Capsule",
    "ConstantVelocity",
    "Cylinder",
    "Ellipse",
    "Ellipsoid",
    "HalfSpace",
    "MovingObstacle",
    "Obstacle",
    "Polygon",
    "Rectangle",
    "Tabulated",
]
