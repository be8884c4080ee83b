"""Proofs on motions that are not the plan: within distances of it, and along straight lines of the joints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from problems import CertificateStatus, InvalidProblem, Limit, Obstacle, Robot, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray, rounded_up
from problems.certify import limit_verdicts
from problems.limits import complete_limits, depends_on_speed, limits_of
from tpbso_casadi.planning import JudgedMotion

WORST_FIRST = (CertificateStatus.VIOLATED, CertificateStatus.UNDECIDED)


def parts_of(motion: JudgedMotion) -> Iterator[tuple[Criteria, Trajectory]]:
    """The motion with its criteria, or each stage of it that moves."""
    if not motion.stages:
        yield motion.criteria, motion.trajectory
    for stage in motion.stages:
        if stage.criteria is not None:
            yield stage.criteria, stage.motion(motion.trajectory)


def has_moving_obstacles(parts: Iterable[tuple[Criteria, Trajectory]]) -> bool:
    """Whether any obstacle moves, so that it matters when the robot is where."""
    return any(obstacle.moves for criteria, _ in parts for obstacle in criteria.obstacles)


def clear_within(
    parts: Iterable[tuple[Criteria, Trajectory]], errors: FloatArray, at_planned_times: bool = True
) -> CertificateStatus:
    """Whether bodies keep clear of obstacles and of each other in all motions so near to given ones.

    Args:
        parts: motions, and by what they are judged.
        errors: distances of each joint at any time, (dof,), rad or m.
        at_planned_times: whether times are those of the motions; where not, obstacles that move are left out.
    """
    statuses = set()
    for criteria, trajectory in parts:
        try:
            robot = criteria.robot if at_planned_times else criteria.robot.at_any_speed
            robot = robot.within(tuple(errors.tolist()))
        except InvalidProblem:  # so far off that levers say nothing
            return CertificateStatus.UNDECIDED
        obstacles = [each for each in criteria.obstacles if at_planned_times or not each.moves]
        statuses |= _statuses(robot, obstacles, trajectory, clearances(robot, obstacles))
    return _worst(statuses)


def clear_along(parts: Iterable[tuple[Criteria, Trajectory]]) -> CertificateStatus:
    """Whether limits of postures hold along paths at whichever times, but for obstacles that move."""
    statuses = set()
    for criteria, path in parts:
        robot, obstacles = criteria.robot.at_any_speed, [each for each in criteria.obstacles if not each.moves]
        others = [limit for limit in criteria.limits if not is_clearance(limit) and is_of_postures(limit)]
        statuses |= _statuses(robot, obstacles, path, [*others, *clearances(robot, obstacles)])
    return _worst(statuses)


def clearances(robot: Robot, obstacles: Sequence[Obstacle]) -> list[Limit]:
    """The limits on what bodies keep from obstacles and from each other."""
    return [limit for limit in limits_of(robot, obstacles) if is_clearance(limit)]


def is_clearance(limit: Limit) -> bool:
    """Whether a limit is about distances of bodies."""
    return limit.within_tracking and limit.order is None


def is_of_postures(limit: Limit) -> bool:
    """Whether a limit says the same of a posture at whatever time and speed."""
    return not limit.scales_with_time and not depends_on_speed([limit])


def _statuses(
    robot: Robot, obstacles: Sequence[Obstacle], trajectory: Trajectory, limits: Sequence[Limit]
) -> set[CertificateStatus]:
    """The statuses of limits, of all bodies of the robot, over all t."""
    every = complete_limits(limits, robot, obstacles)
    return {verdict.status for verdict in limit_verdicts(every, trajectory)}


def _worst(statuses: set[CertificateStatus]) -> CertificateStatus:
    return next((status for status in WORST_FIRST if status in statuses), CertificateStatus.CERTIFIED)


def polyline(points: FloatArray) -> Trajectory:
    """A motion along straight lines of the joints from point to point (n, dof), at rest at each, a second a line."""
    start, way = points[:-1], np.diff(points, axis=0)
    return Trajectory(np.arange(float(len(points))), np.stack([-2.0 * way, 3.0 * way, 0.0 * way, start]))


def metres(robot: Robot, errors: FloatArray) -> float:
    """How far a point of a link can be from where it is planned if joints are off by errors (dof,), m."""
    bodies = robot.bodies
    if not bodies.each:
        return float(robot.reach()[1] * errors.sum())
    radii = np.array([[float(body.radius)] for body in bodies.each])
    return float(((np.abs(bodies.levers) + radii) @ (np.abs(bodies.turns) @ errors)).max())


def said(robot: Robot, errors: FloatArray) -> str:
    """Errors of joints (dof,) in words, as what they are and what they move."""
    return f"{rounded_up(errors.max()):g} rad, {rounded_up(1e3 * metres(robot, errors)):g} mm of a link"
