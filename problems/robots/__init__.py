"""Robots: kinematics and limits of the joints."""

from problems.robots.appearance import LinkAppearance, appearance_text, read_appearances
from problems.robots.arm_cover import ArmCover, CoveredLink
from problems.robots.bodies import Bodies, Body, BodyPairs
from problems.robots.built_in import BUILT_IN, built_in
from problems.robots.carried import Carried, payload_of
from problems.robots.cell import BETWEEN, cell_of, own_name
from problems.robots.chain import Chain, ChainJoint, JointKind, Tip
from problems.robots.closed_form import ClosedForm
from problems.robots.completion import OwnContacts, complete_arm
from problems.robots.description import RobotDescription
from problems.robots.dynamics import RigidChain, RigidJoint, time_scales, time_scales_of_arrays
from problems.robots.inertia import MASSLESS, Payload, moved_inertia, planar_payload
from problems.robots.inverse_kinematics import (
    LONGEST_STEP,
    project,
    tool_jacobian,
)
from problems.robots.joints import JointLimits, Joints
from problems.robots.link_covers import LinkCover, MeshNote, ReadFile, covers_text, read_covers
from problems.robots.planar import PLANAR_GRAVITY, PlanarArm
from problems.robots.planar_links import wrap_to
from problems.robots.posture_search import (
    NEWTON,
    Bounds,
    FoundPostures,
    JointTurns,
    NewtonSteps,
    Poses,
    Steps,
    manipulability,
    postures,
    spread_shares,
)
from problems.robots.robot import Robot
from problems.robots.shapes import (
    BoxShape,
    CapsuleShape,
    CylinderShape,
    HullShape,
    MeshShape,
    Shape,
    SphereShape,
)
from problems.robots.spatial_arm import GRAVITY, RANDOM_POSTURES, SpatialArm, largest_holding_torques
from problems.robots.spheres import Ball, Sphere
from problems.robots.spheres_file import read_spheres, written_spheres
from problems.robots.srdf import read_srdf
from problems.robots.tool import ArmTool, Tool
from problems.robots.tracking import TrackingError, least_tracking_error
from problems.robots.transform import (
    FixedFrame,
    Orientations,
    Point3,
    Transform,
    angles_between,
    as_point,
    matrix_of,
    quaternion_product,
    quaternions_of,
    turn_of,
    turned_by,
    unit_quaternions,
)
from problems.robots.urdf import read_urdf
from problems.robots.urdf_elements import document

ROBOTS: dict[str, type[Robot]] = {"planar": PlanarArm}

__all__ = [
    "BETWEEN",
    "BUILT_IN",
    "GRAVITY",
    "LONGEST_STEP",
    "MASSLESS",
    "NEWTON",
    "PLANAR_GRAVITY",
    "RANDOM_POSTURES",
    "ROBOTS",
    "ArmCover",
    "ArmTool",
    "Ball",
    "Bodies",
    "Body",
    "BodyPairs",
    "Bounds",
    "BoxShape",
    "CapsuleShape",
    "Carried",
    "Chain",
    "ChainJoint",
    "ClosedForm",
    "CoveredLink",
    "CylinderShape",
    "FixedFrame",
    "FoundPostures",
    "HullShape",
    "JointKind",
    "JointLimits",
    "JointTurns",
    "Joints",
    "LinkAppearance",
    "LinkCover",
    "MeshNote",
    "MeshShape",
    "NewtonSteps",
    "Orientations",
    "OwnContacts",
    "Payload",
    "PlanarArm",
    "Point3",
    "Poses",
    "ReadFile",
    "RigidChain",
    "RigidJoint",
    "Robot",
    "RobotDescription",
    "Shape",
    "SpatialArm",
    "Sphere",
    "SphereShape",
    "Steps",
    "Tip",
    "Tool",
    "TrackingError",
    "Transform",
    "angles_between",
    "appearance_text",
    "as_point",
    "built_in",
    "cell_of",
    "complete_arm",
    "covers_text",
    "document",
    "largest_holding_torques",
    "least_tracking_error",
    "manipulability",
    "matrix_of",
    "moved_inertia",
    "own_name",
    "payload_of",
    "planar_payload",
    "postures",
    "project",
    "quaternion_product",
    "quaternions_of",
    "read_appearances",
    "read_covers",
    "read_spheres",
    "read_srdf",
    "read_urdf",
    "spread_shares",
    "time_scales",
    "time_scales_of_arrays",
    "tool_jacobian",
    "turn_of",
    "turned_by",
    "unit_quaternions",
    "wrap_to",
    "written_spheres",
]
