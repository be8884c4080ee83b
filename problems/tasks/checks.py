"""Checks that statements of tasks have in common."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import (
    COORDINATES,
    TIMES,
    FloatArray,
    InvalidProblem,
    as_array,
    check_within,
    is_of_length_one,
    shown,
)
from problems.core import CompiledWorld
from problems.limits import Proximity, can_hold, cover_limits, holding_torques, proximity_limits
from problems.motions import Samples
from problems.robots import Robot
from problems.scene import Obstacle


def check_choice(field: str, value: str, known: Collection[str]) -> None:
    """Check that the value is one of the known ones."""
    if value not in known:
        raise InvalidProblem(field, f"{value!r} is not one of {', '.join(known)}")


def check_range(field: str, bounds: tuple[float, float]) -> None:
    """Check that 0 < lower < upper, both durations in s that can be computed with."""
    lower, upper = bounds
    if not 0.0 < lower < upper < np.inf:
        raise InvalidProblem(field, f"0 < {shown(lower)} < {shown(upper)} does not hold, or is not finite")
    check_within(field, bounds, TIMES, "s")


def check_at_least(field: str, value: int | None, least: int, what: str = "") -> None:
    """Check that the value, if there is one, is a whole number of at least ``least``."""
    if value is not None and not isinstance(value, Integral):
        raise InvalidProblem(field, f"a whole number is needed, not {shown(value)}")
    if value is not None and value < least:
        raise InvalidProblem(field, f"{value} is fewer than {least}{what}")


def check_bodies(robot: Robot) -> None:
    """Check that a body of the robot moves, which obstacles could touch.

    Raises:
        InvalidProblem: ``obstacles`` could touch nothing of the robot.
    """
    if not robot.bodies.levers.any():
        reason = "no collision geometry of a link that moves is known, so that nothing could be kept clear of them"
        raise InvalidProblem("obstacles", f"{reason}; state spheres of the robot, or leave them out")


def check_obstacles(robot: Robot, obstacles: Sequence[Obstacle]) -> None:
    """Check that obstacles and robot are all in the plane or in space, and that a fixed base is clear.

    Where bodies are balls, contacts of the base are told beside the certificate.

    Raises:
        InvalidProblem: one is of another dimension, or encloses the base; or nothing of the robot could touch any.
    """
    if obstacles:
        check_bodies(robot)
    for number, obstacle in enumerate(obstacles, start=1):
        if obstacle.dim != robot.dim:
            name = f"obstacle {number}, {type(obstacle.unmoved).__name__} at {obstacle.place}"
            raise InvalidProblem("obstacles", f"{name}: it has {obstacle.dim} dimensions, the robot {robot.dim}")
    if not any(body.start == 0 for body in robot.bodies.each):
        return
    thickest = max((float(body.radius) for body in robot.bodies.each if body.start == 0), default=0.0)
    for obstacle in obstacles:
        if obstacle.contains(robot.base):
            raise InvalidProblem("obstacles", f"the base lies inside the obstacle at {obstacle.place}")
        short = _short_of(obstacle, robot.base, robot.margin + thickest)
        if short:
            raise InvalidProblem("obstacles", f"the base {short}")


def check_point(
    robot: Robot, obstacles: Sequence[Obstacle], field: str, point: tuple[float, ...], name: str = ""
) -> None:
    """Check that the tip can be at a point: within reach, not too close, clear of obstacles."""
    check_within(field, point, COORDINATES, "m")
    distance = float(np.hypot.reduce(np.array(point) - robot.base))
    inner, outer = robot.reach()
    place = f"{name}{point} is {distance:.6g} m from the base"
    if not distance <= outer:
        raise InvalidProblem(field, f"{place}, out of reach: the arm reaches {outer:.6g} m")
    if distance < inner:
        raise InvalidProblem(field, f"{place}, too close: the arm reaches from {inner:.6g} m on")
    for obstacle in obstacles:
        if obstacle.contains(point):
            raise InvalidProblem(field, f"{name}{point} lies inside the obstacle at {obstacle.place}")
        short = _short_of(obstacle, point, robot.margin + float(robot.bodies.each[-1].radius))
        if short:
            raise InvalidProblem(field, f"{name}{point} {short}")


def _short_of(obstacle: Obstacle, point: tuple[float, ...], kept: float) -> str:
    """A text of how a point is too near to an obstacle; empty where it is not."""
    distance = obstacle.distance_of(point, point) if kept > 0.0 else 0.0
    if distance >= kept:
        return ""
    return f"is {distance:.6g} m from the obstacle at {obstacle.place}; margin and link width take {kept:.6g} m"


def check_length_one(field: str, quaternion: tuple[float, ...], name: str = "") -> None:
    """Check that the squares of four numbers add up to 1, approximately."""
    if len(quaternion) != 4 or not is_of_length_one(quaternion):
        raise InvalidProblem(field, f"{name}{quaternion} is no quaternion x, y, z, w of length 1")


def check_posture(
    robot: Robot, obstacles: Sequence[Obstacle], field: str, theta: tuple[float, ...], name: str = ""
) -> None:
    """Check that a posture keeps its bodies clear of obstacles and, where it is asked for, of each other."""
    reason = too_near(robot, obstacles, np.array(theta))
    if reason:
        raise InvalidProblem(field, f"{name}{reason}")


def too_near(robot: Robot, obstacles: Sequence[Obstacle], theta: FloatArray) -> str:
    """A text of which bodies of a posture (dof,) at t = 0 are too near to what; empty where none is."""
    world = CompiledWorld.of(robot, obstacles)
    if world is not None and world.clear(theta[None])[0]:
        return ""
    for cover in cover_limits(robot, obstacles):
        found = cover.closest(theta[None], np.zeros(1))
        (closest,), (left,) = found.pairs, found.clearance_margins
        if closest is not None and left < 0.0:
            links = cover.world.described(closest)
            return f"{links}: {cover.name} {cover.margin + left:.6g} m, not {cover.margin:.6g} m"
    if robot.cover is not None:
        return ""
    samples = Samples(robot=robot, derivatives=(ca.DM(theta).T,), duration=ca.DM(1.0), times=ca.DM(0.0))
    for limit in proximity_limits(robot, obstacles):
        clearances = as_array(limit.clearances(samples)).ravel()
        nearest = int(np.argmin(clearances))
        if clearances[nearest] < robot.margin:
            clearance, pair = clearances[nearest], limit.pairs[nearest].description
            return f"{pair}: {limit.name} {clearance:.6g} m, not {robot.margin:.6g} m"
    return ""


def check_holding(robot: Robot, field: str, postures: FloatArray, name: str = "") -> None:
    """Check that the motors can hold at least one of all postures (n, dof) that there are."""
    if not can_hold(robot, postures).any():
        raise InvalidProblem(field, f"{name}{overloaded(robot, postures[0])}")


def overloaded(robot: Robot, theta: FloatArray) -> str:
    """A text of the motor that a posture (dof,) overloads most; empty where all can hold it."""
    torques, limits = holding_torques(robot, theta[None]), robot.limits.torque
    if torques is None or limits is None or can_hold(robot, theta[None])[0]:
        return ""
    joint = int(np.argmax(np.abs(torques[0]) / np.array(limits)))
    needed, most = shown(abs(torques[0, joint])), shown(limits[joint])
    unit = robot.joints.torque_units[joint]
    return f"{robot.joints.names[joint]} needs {needed} {unit} to hold the arm there, more than its {most} {unit}"


def least_clearances(robot: Robot, obstacles: Sequence[Obstacle], theta: FloatArray) -> FloatArray:
    """Clearances of postures (n, dof) at t = 0 from anything, (n,), m; infinite where there is nothing."""
    found = Surroundings(robot, tuple(obstacles)).clearances(theta, np.zeros(len(theta)))
    return np.asarray(np.min([np.full(len(theta), np.inf), *(clearances for _, clearances in found)], axis=0))


@dataclass(frozen=True)
class Surroundings:
    """A robot and everything that it keeps clear of, itself included.

    Args:
        robot: with its margins.
        obstacles: around it.
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...]

    @cached_property
    def world(self) -> CompiledWorld | None:
        """The core's world, where it knows robot and obstacles."""
        return CompiledWorld.of(self.robot, self.obstacles)

    @cached_property
    def _pairs(self) -> tuple[Proximity, ...]:
        return proximity_limits(self.robot, self.obstacles)

    def clearances(self, theta: FloatArray, times: FloatArray) -> list[tuple[float, FloatArray]]:
        """The margin of each limit, m, and the least clearance of postures (n, dof) at times (n,), s: (n,), m."""
        if self.world is not None:
            kept = self.world.margins.items()
            return [
                (margin, margin + self.world.clearance_margins(theta, which=which, times=times))
                for which, margin in kept
            ]
        samples = Samples(robot=self.robot, derivatives=(ca.DM(theta),), duration=ca.DM(1.0), times=ca.DM(times))
        return [(self.robot.margin, as_array(limit.clearances(samples)).min(axis=1)) for limit in self._pairs]

    def clear(self, theta: FloatArray, times: FloatArray) -> NDArray[np.bool_]:
        """Whether postures (n, dof) at times (n,), s, keep their margins, (n,)."""
        return (
            self.world.clear(theta, times=times)
            if self.world is not None
            else self.clearance_margin(theta, times) >= 0.0
        )

    def clearance_margin(self, theta: FloatArray, times: FloatArray) -> FloatArray:
        """The clearance beyond the margins, (n,), m; infinite where there is nothing."""
        found = self.clearances(theta, times)
        return np.asarray(np.min([np.full(len(theta), np.inf), *(each - margin for margin, each in found)], axis=0))
