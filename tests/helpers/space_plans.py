"""A motion in space for tests of what is drawn and written: nothing is searched for, and so limits may be broken."""

from functools import cache

import numpy as np
from helpers.space import small_arm

from problems import Ball, Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Polytope
from problems.families.splines import move
from problems.geometry import Triangles, box_corners, facing_out
from problems.robots import LinkAppearance, Sphere
from problems.tasks import Joints, Move
from tpbso_casadi.planning import PlannedMotion, motion_of

SOLIDS = (
    Box(center=(0.6, 0.1, 0.3), size=(0.1, 0.2, 0.6)),
    Ball(center=(0.0, 0.6, 0.8), radius=0.1),
    Capsule(center=(-0.6, 0.0, 0.5), radius=0.06, length=0.3, quaternion=(0.5, 0.5, 0.5, 0.5)),
    Cylinder(center=(0.0, -0.7, 0.3), radius=0.1, length=0.6),
    HalfSpace(center=(0.0, 0.0, -0.2)),
    Ellipsoid(center=(0.5, 0.5, 0.75), semi_axes=(0.1, 0.15, 0.2)),
    Polytope(center=(-0.6, 0.5, 0.2), points=((0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.3))),
)
SPHERES = (
    Sphere(0, (0.0, 0.0, 0.05), 0.08, "foot"),
    Sphere(1, (0.0, 0.0, 0.1), 0.07, "link_1"),
    Sphere(3, (0.0, 0.0, 0.1), 0.06, "link_3"),
    Sphere(4, (0.0, 0.0, 0.15), 0.05, "link_4"),
)


BAR = Triangles.of(facing_out(box_corners((0.06, 0.06, 0.2))))
LOOKS = (LinkAppearance("link_1", 1, "#cc0000", BAR), LinkAppearance("link_3", 3, "", BAR))  # foot and link_4 have none


@cache
def space_plan(obstacles: bool = True, spheres: bool = True, appearances: bool = False) -> PlannedMotion:
    """A small arm turns and bends between solids of every kind."""
    balls = {"spheres": SPHERES, "kept_pairs": ((0, 3),), "self_collision": True} if spheres else {}
    robot = small_arm(4, max_jerk=(100.0,) * 4, appearances=LOOKS if appearances else (), **balls)
    start, goal = (0.0, 0.3, 0.2, 0.8), (1.2, 0.9, -0.4, 1.1)
    task = Move(robot, Joints(start), (Joints(goal),), obstacles=SOLIDS if obstacles else ())
    problem = move(task, "time", samples=20, pieces=3)
    return PlannedMotion(scenario=None, motion=motion_of(problem, np.zeros(len(problem.variables))))  # type: ignore[arg-type]
