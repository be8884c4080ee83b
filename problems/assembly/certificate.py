"""What a certificate says of a motion: robot, obstacles and pieces in numbers, and what it does not speak of.

docs/reference/certificate.md describes the file; :mod:`problems.certify.check_certificate` checks one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from problems.assembly.criteria import Criteria
from problems.base import FloatArray, InvalidProblem
from problems.certify import FORMAT, TOLERANCE, VERSION, NoCertificateError, RefusedError, divided
from problems.core import RobotNumbers, drifts_of, known_robot, obstacle_numbers
from problems.limits import KINDS, Clearance, CoverClearance, CoverSelfClearance, Limit, SelfClearance, TorqueLimit
from problems.motions import Trajectory
from problems.robots import SpatialArm, moved_inertia
from problems.scene import Obstacle, Solid

FROM_OBSTACLES, FROM_EACH_OTHER = (Clearance, CoverClearance), (SelfClearance, CoverSelfClearance)
CLAIMED = {*KINDS, *FROM_OBSTACLES, *FROM_EACH_OTHER}  # kinds of limits; a class derived from one may state another
RATES = ("speed", "acceleration", "jerk", "torque")
LEAST_TOLERANCES = {"position": 2e-9, "speed": 2e-9, "acceleration": 2e-9}
SPARE = 2.0  # times the largest jump of a motion, where that is more


def certificate_of(criteria: Criteria, trajectory: Trajectory) -> dict[str, Any]:
    """The content of a certificate of a motion.

    Args:
        criteria: what it has to do and to keep.
        trajectory: the motion.

    Raises:
        InvalidProblem: there is no certificate of such robots or tasks yet, or what it has to claim is not proven.
    """
    robot = criteria.robot
    if type(robot) is not SpatialArm:
        raise InvalidProblem("certificate", "there are certificates of arms in space alone so far")
    if criteria.stages:
        raise InvalidProblem("certificate", "there are certificates of single motions alone so far, none of sequences")
    stated = _Statement(criteria, robot, trajectory)
    try:
        return {**stated.content, "proof": divided(stated.content)}
    except (RefusedError, NoCertificateError) as error:
        raise InvalidProblem("certificate", str(error)) from error


class _Statement:
    """What a certificate claims.

    Args:
        criteria: of the motion.
        robot: that moves.
        trajectory: the motion.
    """

    def __init__(self, criteria: Criteria, robot: SpatialArm, trajectory: Trajectory) -> None:
        self._criteria, self._robot, self._trajectory = criteria, robot, trajectory
        self._numbers = known_robot(robot)
        self._obstacles = {n: o for n, o in enumerate(criteria.obstacles, start=1) if _is_known(o)}
        self._limits = [limit for limit in criteria.judged_limits if type(limit) in CLAIMED]

    @property
    def content(self) -> dict[str, Any]:
        """All but the proof."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "robot": self._robot_content(),
            "obstacles": [obstacle_content(n, obstacle) for n, obstacle in self._obstacles.items()],
            "may_touch": self._may_touch(),
            "motion": _motion_content(self._trajectory),
            "ends": {"start": self._end(0), "goal": self._end(-1)},
            "tolerances": {"limits": TOLERANCE * (1.0 + 1e-3), **self._tolerances()},
            "not_covered": list(dict.fromkeys(self._not_covered())),
        }

    def _robot_content(self) -> dict[str, Any]:
        robot, own = self._robot, self._keeps(FROM_EACH_OTHER)
        return {
            "name": robot.chain.name,
            "base": {"rotation": _flat(robot.base_frame.rotation), "translation": _flat(robot.base_translation)},
            "joints": [self._joint(number) for number in range(robot.dof)],
            "tracking_error": [0.0] * robot.dof if robot.tracking is None else _flat(robot.tracking.constant),
            "margin": float(robot.margin),
            "own_margin": float(robot.self_margin if robot.is_covered else robot.margin),
            "links": _links(self._numbers),
            "own_pairs": _own_pairs(self._numbers) if own else [],
            "dynamics": self._dynamics() if self._keeps((TorqueLimit,)) else None,
        }

    def _joint(self, number: int) -> dict[str, Any]:
        robot, joint = self._robot, self._robot.chain.joints[number]
        names = {limit.name for limit in self._limits}
        ranged = robot.limits.position if "joint range" in names else None
        limits = {name: getattr(robot.limits, name) if name in names else None for name in RATES}
        return {
            "name": joint.name,
            "turns": joint.turns,
            "rotation": _flat(joint.rotation),
            "translation": _flat(joint.translation),
            "axis": _flat(joint.axis),
            "range": None if ranged is None else _flat(ranged[number]),
            **{name: None if values is None else values[number] for name, values in limits.items()},
        }

    def _dynamics(self) -> dict[str, Any]:
        """Masses as they are stated: joint, mass, centre and inertia about it, in the frame of the joint."""
        robot = self._robot
        carried = [] if robot.payload is None else [(robot.dof - 1, moved_inertia(robot.payload, robot.tool_frame))]
        bodies = [(n, joint.inertia) for n, joint in enumerate(robot.chain.joints) if joint.inertia is not None]
        return {
            "gravity": _flat(robot.gravity),
            "damping": [float(joint.damping) for joint in robot.chain.joints],
            "friction": [float(joint.friction) for joint in robot.chain.joints],
            "bodies": [
                [n, float(body.mass), *_flat(body.center), *_flat(body.matrix)] for n, body in (*bodies, *carried)
            ],
        }

    def _keeps(self, kinds: tuple[type[Limit], ...]) -> bool:
        return any(isinstance(limit, kinds) for limit in self._limits)

    def _may_touch(self) -> list[list[int]]:
        """Links and obstacles, by their places in the file, that need not keep clear."""
        robot, kept = self._robot, self._keeps(FROM_OBSTACLES)
        return [
            [link, place]
            for link, (name, _, moves) in enumerate(self._numbers.roots)
            for place, obstacle in enumerate(self._obstacles.values())
            if not (kept and moves) or robot.may_meet(name, obstacle.unmoved.name)
        ]

    def _end(self, place: int) -> dict[str, Any]:
        """What is to be there, where the task says that in joints, else what is."""
        task, trajectory = self._criteria.task, self._trajectory
        posture = self._given_postures()[place]
        reached = trajectory.at(trajectory.breakpoints[[place]])[0] if posture is None else posture
        return {
            "position": _flat(reached),
            "velocity": _flat(task.end_velocities[place]),
            "acceleration": _flat(task.end_accelerations[place]),
        }

    @property
    def _is_smooth(self) -> bool:
        return any(limit.order == 3 for limit in self._limits)

    def _given_postures(self) -> tuple[FloatArray | None, FloatArray | None]:
        task = self._criteria.task
        (end,) = self._trajectory.at(self._trajectory.breakpoints[-1:])
        return task.start_posture, task.goal_posture(end)

    def _tolerances(self) -> dict[str, float]:
        task = self._criteria.task
        outside = (None, task.end_velocities, task.end_accelerations)
        looked = range(3 if self._is_smooth else 2)
        jumps = {kind: self._trajectory.jump(n, outside[n]) for n, kind in zip(looked, LEAST_TOLERANCES, strict=False)}
        return {kind: max(least, SPARE * jumps.get(kind, 0.0)) for kind, least in LEAST_TOLERANCES.items()}

    def _not_covered(self) -> Iterator[str]:
        """A line of each thing that the verdicts of the motion speak of, or do not, and the file does not claim."""
        criteria = self._criteria
        yield from (f"limit: {limit.name}" for limit in criteria.judged_limits if type(limit) not in CLAIMED)
        for number, obstacle in enumerate(criteria.obstacles, start=1):
            if number not in self._obstacles:
                yield f"clearance from {obstacle.label(number)}, of a shape or motion that no certificate knows"
        tracking = self._robot.tracking
        if tracking is not None and any((*tracking.speed, *tracking.acceleration)):
            yield "the parts of the tracking error that grow with speeds and accelerations"
        if criteria.task.stay:
            yield f"that the robot stays clear for {criteria.task.stay:g} s after its arrival"
        if criteria.task.duration_bounds is not None:
            yield f"limit: {criteria.task.duration_bounds.name}"
        given = dict(zip(("start", "goal"), self._given_postures(), strict=True))
        covered = {"start velocity", "goal velocity", *(name for name, posture in given.items() if posture is not None)}
        for constraint, _ in criteria.task.conditions(self._trajectory):
            if constraint.name not in covered:
                yield f"condition: {constraint.name}"
        yield from criteria.not_judged


def _is_known(obstacle: Obstacle) -> bool:
    return obstacle_numbers(obstacle.unmoved) is not None and drifts_of([obstacle]) is not None


def _links(numbers: RobotNumbers) -> list[dict[str, Any]]:
    """Balls of each link with the number of their children, breadth first."""
    nodes = np.array(numbers.nodes).reshape(-1, 4)
    body, _, children = np.array(numbers.counts[len(numbers.counts) - 3 * len(nodes) :]).reshape(-1, 3).T
    firsts = [first for _, first, _ in numbers.roots]
    balls = [[*row, int(count)] for row, count in zip(nodes.tolist(), children, strict=True)]
    return [
        {"name": name, "body": int(body[first]), "balls": balls[first:end]}
        for (name, first, _), end in zip(numbers.roots, [*firsts, len(nodes)][1:], strict=True)
    ]


def _own_pairs(numbers: RobotNumbers) -> list[list[int]]:
    """Balls, or all balls in two nodes, that keep apart."""
    found: list[Sequence[int]] = []
    for one, two, begin, end in numbers.groups:
        found += numbers.pairs[begin:end] if begin < end else [(one, two)]
    return [list(pair) for pair in found]


def obstacle_content(number: int, obstacle: Obstacle) -> dict[str, Any]:
    """An obstacle of a shape and motion that the core knows, in numbers; of that number, for its name."""
    plain, solid = obstacle_numbers(obstacle.unmoved), obstacle.unmoved
    drifts = drifts_of([obstacle])
    assert plain is not None and drifts is not None and isinstance(solid, Solid)
    (drift,) = drifts
    corners, triangles = solid.own_surface() if len(plain.faces) else (np.empty((0, 3)), [])
    edges = {tuple(sorted(edge)) for a, b, c in triangles for edge in ((a, b), (b, c), (c, a))}
    return {
        "name": obstacle.label(number),
        "shape": plain.shape.name.lower().replace("_", "-"),
        "sizes": _flat(plain.sizes),
        "rotation": _flat(solid.axes),
        "center": _flat(np.array(solid.center) + drift[:3]),
        "velocity": _flat(drift[3:6]),
        "growth": float(drift[6]),
        "points": corners.tolist(),
        "normals": plain.faces[:, :3].tolist(),
        "edges": [list(edge) for edge in sorted(edges)],
    }


def _motion_content(trajectory: Trajectory) -> dict[str, Any]:
    return {
        "breakpoints": trajectory.breakpoints.tolist(),
        "coefficients": trajectory.coefficients[::-1].transpose(1, 2, 0).tolist(),
    }


def _flat(values: Any) -> list[float]:
    return np.asarray(values, dtype=np.float64).ravel().tolist()
