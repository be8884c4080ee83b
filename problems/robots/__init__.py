"""What moves: robots by their kinematics and their limits."""

from problems.robots.planar import PlanarArm
from problems.robots.robot import Robot

ROBOTS: dict[str, type[Robot]] = {"planar": PlanarArm}

__all__ = ["ROBOTS", "PlanarArm", "Robot"]
