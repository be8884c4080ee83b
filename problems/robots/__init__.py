"""Robots: kinematics and limits of the joints."""

from problems.robots.planar import PlanarArm
from problems.robots.robot import Robot

ROBOTS: dict[str, type[Robot]] = {"planar": PlanarArm}

__all__ = ["ROBOTS", "PlanarArm", "Robot"]
