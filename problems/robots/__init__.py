"""Robots: kinematics and limits of the joints."""

from problems.robots.chain import ChainJoint
from problems.robots.description import RobotDescription, read_spheres
from problems.robots.dynamics import RigidChain, time_scales, time_scales_of_arrays
from problems.robots.inertia import MASSLESS, Payload, planar_payload
from problems.robots.inverse_kinematics import LONGEST_STEP, postures, project, tool_jacobian
from problems.robots.planar import PLANAR_GRAVITY, PlanarArm
from problems.robots.planar_links import wrap_to
from problems.robots.robot import Body, JointLimits, Robot
from problems.robots.spatial_arm import GRAVITY, POSTURES, SpatialArm, most_held
from problems.robots.spheres import Sphere
from problems.robots.transform import Orientations, Transform, angles_between, matrix_of, unit_quaternions
from problems.robots.urdf import BUILT_IN, built_in, read_srdf, read_urdf

ROBOTS: dict[str, type[Robot]] = {"planar": PlanarArm}

__all__ = [
    "BUILT_IN",
    "GRAVITY",
    "LONGEST_STEP",
    "MASSLESS",
    "PLANAR_GRAVITY",
    "POSTURES",
    "ROBOTS",
    "Body",
    "ChainJoint",
    "JointLimits",
    "Orientations",
    "Payload",
    "PlanarArm",
    "RigidChain",
    "Robot",
    "RobotDescription",
    "SpatialArm",
    "Sphere",
    "Transform",
    "angles_between",
    "built_in",
    "matrix_of",
    "most_held",
    "planar_payload",
    "postures",
    "project",
    "read_spheres",
    "read_srdf",
    "read_urdf",
    "time_scales",
    "time_scales_of_arrays",
    "tool_jacobian",
    "unit_quaternions",
    "wrap_to",
]
