"""Obstacles that the robot has to keep clear of."""

from problems.scene.ellipse import Ellipse
from problems.scene.moving import ConstantVelocity, MovingObstacle, ObstacleMotion
from problems.scene.obstacle import Frames, Obstacle, standing
from problems.scene.polygon import Polygon, Rectangle, crossing_clearance
from problems.scene.polytope import Polytope
from problems.scene.solids import Ball, Box, Capsule, Cylinder, Ellipsoid, HalfSpace, PlainSolid, Shape, Solid
from problems.scene.tabulated import LEAST_STEP, Tabulated, first_fault

# by the names that scenarios have for them; one of the plane may have a namesake in space
OBSTACLES: dict[str, type[Obstacle]] = {"ellipse": Ellipse, "box": Rectangle, "polygon": Polygon}
SOLIDS: dict[str, type[Obstacle]] = {
    "box": Box,
    "sphere": Ball,
    "capsule": Capsule,
    "cylinder": Cylinder,
    "half-space": HalfSpace,
    "ellipsoid": Ellipsoid,
    "polytope": Polytope,
}

__all__ = [
    "LEAST_STEP",
    "OBSTACLES",
    "SOLIDS",
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
    "PlainSolid",
    "Polygon",
    "Polytope",
    "Rectangle",
    "Shape",
    "Solid",
    "Tabulated",
    "crossing_clearance",
    "first_fault",
    "standing",
]
