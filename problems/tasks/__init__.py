"""Tasks: moves, paths to follow or trace, recorded motions, sequences."""

from problems.tasks.at_tips import AtTips
from problems.tasks.checks import (
    Surroundings,
    check_at_least,
    check_bodies,
    check_choice,
    check_length_one,
    check_obstacles,
    check_posture,
    least_clearances,
    overloaded,
    too_near,
)
from problems.tasks.following import Following
from problems.tasks.free_turns import FreeTurns
from problems.tasks.joint_path import JointFollowing
from problems.tasks.move import Move
from problems.tasks.path import Path, PathKnots, closed_curve, knots_of, pentagram
from problems.tasks.path_following import (
    KnotRedundancy,
    PathFollowing,
    PathTracing,
    SpaceTracing,
    ToolTracing,
    times_at,
)
from problems.tasks.place import (
    ANGLE_TOLERANCE,
    Choice,
    Elbow,
    Joints,
    Place,
    Position,
    Turns,
    elbow_signs,
    narrow_elbow,
)
from problems.tasks.point_to_point import PointToPoint
from problems.tasks.pose import Pose, are_rotations, checked_frames
from problems.tasks.recorded import RecordedMotion
from problems.tasks.seen_from import SeenFrom
from problems.tasks.sequence import Sequence
from problems.tasks.steady_speed import SteadySpeed
from problems.tasks.task import BoundedCurve, Marker, MarkerKind, Milestone, ProgressMeasure, Task
from problems.tasks.tool_path import Arc, Corners, StraightLine, ToolCurve, ToolPath
from problems.tasks.turns import ShortTurns

__all__ = [
    "ANGLE_TOLERANCE",
    "Arc",
    "AtTips",
    "BoundedCurve",
    "Choice",
    "Corners",
    "Elbow",
    "Following",
    "FreeTurns",
    "JointFollowing",
    "Joints",
    "KnotRedundancy",
    "Marker",
    "MarkerKind",
    "Milestone",
    "Move",
    "Path",
    "PathFollowing",
    "PathKnots",
    "PathTracing",
    "Place",
    "PointToPoint",
    "Pose",
    "Position",
    "ProgressMeasure",
    "RecordedMotion",
    "SeenFrom",
    "Sequence",
    "ShortTurns",
    "SpaceTracing",
    "SteadySpeed",
    "StraightLine",
    "Surroundings",
    "Task",
    "ToolCurve",
    "ToolPath",
    "ToolTracing",
    "Turns",
    "are_rotations",
    "check_at_least",
    "check_bodies",
    "check_choice",
    "check_length_one",
    "check_obstacles",
    "check_posture",
    "checked_frames",
    "closed_curve",
    "elbow_signs",
    "knots_of",
    "least_clearances",
    "narrow_elbow",
    "overloaded",
    "pentagram",
    "times_at",
    "too_near",
]
