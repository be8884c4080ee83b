"""A planar arm with masses, motors and friction, a lift in space, and a motion of each, for tests of torques."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from helpers.space import sliding_arm

from problems import PlanarArm, PointToPoint, point_to_point
from problems.base import FloatArray
from problems.families.splines import move
from problems.robots.inertia import Inertia
from problems.tasks import Joints, Move
from tpbso_casadi.planning import JudgedMotion, motion_of

LENGTHS, MASSES, DAMPING, FRICTION, G = (0.5, 0.4), (2.0, 1.5), (0.3, 0.2), (0.5, 0.4), 9.81


def massive_arm(**changes: Any) -> PlanarArm:
    """Two uniform rods with friction."""
    settings: dict[str, Any] = {
        "link_lengths": LENGTHS, "max_speed": (4.0, 4.0), "max_acceleration": (40.0, 40.0),
        "link_masses": MASSES, "max_torque": (30.0, 8.0), "viscous_friction": DAMPING, "coulomb_friction": FRICTION,
    }  # fmt: skip
    return PlanarArm(**(settings | changes))


@cache
def massive_motion() -> JudgedMotion:
    """A move that nothing was searched for."""
    task = PointToPoint(massive_arm(), (0.6, -0.3), (0.3, 0.6))
    problem = point_to_point(task, "time", "reduced", 50)
    lower, upper = problem.bounds
    return motion_of(problem, (lower + upper) / 2.0)


def by_lagrange(q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """Torques (n, 2) of the arm from the textbook's equations of two rods; all (n, 2)."""
    (l1, l2), (m1, m2) = LENGTHS, MASSES
    c1, c2, i1, i2 = l1 / 2.0, l2 / 2.0, m1 * l1**2 / 12.0, m2 * l2**2 / 12.0
    cross, sine = m2 * l1 * c2 * np.cos(q[:, 1]), m2 * l1 * c2 * np.sin(q[:, 1])
    m22 = np.full(len(q), i2 + m2 * c2**2)
    m12 = m22 + cross
    m11 = i1 + m1 * c1**2 + m2 * l1**2 + m22 + 2.0 * cross
    swing = m2 * G * c2 * np.cos(q[:, 0] + q[:, 1])
    first = m11 * a[:, 0] + m12 * a[:, 1] - sine * (2.0 * v[:, 0] * v[:, 1] + v[:, 1] ** 2)
    second = m12 * a[:, 0] + m22 * a[:, 1] + sine * v[:, 0] ** 2
    held = (m1 * c1 + m2 * l1) * G * np.cos(q[:, 0]) + swing
    moving = np.where(np.abs(v) > 1e-9 * np.abs(v).max(axis=0), np.sign(v), 0.0)
    return np.column_stack([first + held, second + swing]) + v * DAMPING + moving * FRICTION


@cache
def lifted_motion(limited: bool = True) -> JudgedMotion:
    """A lift with three joints on it turns and rises; 2 kg each, with limits of force and torque or without."""
    robot = sliding_arm()
    body = Inertia(mass=2.0, center=(0.2, 0.0, 0.0))
    joints = tuple(replace(joint, inertia=body) for joint in robot.chain.joints)
    limits = (120.0, 40.0, 20.0, 10.0) if limited else None
    heavy = replace(robot, chain=replace(robot.chain, joints=joints), max_torque=limits)
    goal = Joints((0.3, 0.9, -0.4, 0.5))
    problem = move(Move(heavy, Joints((0.1, 0.0, 0.3, -0.2)), (goal,)), "time", samples=20, pieces=3)
    return motion_of(problem, np.zeros(len(problem.variables)))
