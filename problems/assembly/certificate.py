"""What a certificate says of a motion: robot, obstacles and pieces in numbers, and what it does not speak of.

docs/reference/certificate.md describes the file; :mod:`problems.certify.check_certificate` checks one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import sin
from typing import Any

import numpy as np

from problems.assembly.criteria import Criteria
from problems.base import FloatArray, InvalidProblem
from problems.certify import FORMAT, TOLERANCE, VERSION, RefusedError, check, divided
from problems.core import RobotNumbers, drift_of, known_robot, moves_straight, obstacle_numbers
from problems.limits import KINDS, Clearance, CoverClearance, CoverSelfClearance, Limit, SelfClearance
from problems.motions import Trajectory
from problems.robots import PlanarArm, Robot, SpatialArm, moved_inertia
from problems.scene import Obstacle, Solid
from problems.tasks import Place, Pose, Position

FROM_OBSTACLES, FROM_EACH_OTHER = (Clearance, CoverClearance), (SelfClearance, CoverSelfClearance)
CLAIMED = {*KINDS, *FROM_OBSTACLES, *FROM_EACH_OTHER}  # kinds of limits; a class derived from one may state another
RATES = ("speed", "acceleration", "jerk", "torque")
LEAST_TOLERANCE = 2e-9  # of positions, speeds and accelerations
EXACT = 2e-15  # how far a rotation in a file may be off
SPARE = 2.0  # times the sum of the jumps of a motion, where that is more
ROUNDING = 1e-11  # of the largest value, that a checker adds to each of them, at most
NEAR = 1e-6  # how far the tool, and points 1 m along its axes, may be from where a position or pose has them, m
LEVERS = 4.0  # times reach and 1 m, that a joint's tolerance moves them by at most; bounds included


def certificate_of(criteria: Criteria, trajectory: Trajectory) -> dict[str, Any]:
    """The content of a certificate of a motion.

    Args:
        criteria: what it has to do and to keep.
        trajectory: the motion.

    Raises:
        InvalidProblem: there is no certificate of such robots or tasks yet, or what it has to claim is not proven.
    """
    check_certifiable(criteria)
    stated = [statement.content for statement in _statements(criteria, trajectory)]
    for before, stage in pairwise(stated):
        stage["start"] = before["goal"]
    try:
        stages = [{**stage, **divided(stage)} for stage in stated]
        content = {"format": FORMAT, "version": VERSION, "robot": _name_of(criteria.robot), "stages": stages}
        if len(stages) > 1:
            check(content)  # whether each begins where the one before ended
    except (RefusedError, ValueError) as error:
        raise InvalidProblem("certificate", str(error)) from error
    return content


def check_certifiable(criteria: Criteria) -> None:
    """Make sure, before any work, that there are certificates of such motions.

    Raises:
        InvalidProblem: there are none.
    """
    for own in (criteria, *(stage.criteria for stage in criteria.stages if stage.criteria is not None)):
        if type(own.robot) not in (SpatialArm, PlanarArm):
            raise InvalidProblem("certificate", f"there are none of robots of the kind {type(own.robot).__name__}")


def _name_of(robot: Robot) -> str:
    return robot.chain.name if isinstance(robot, SpatialArm) else "planar arm"


def _statements(criteria: Criteria, trajectory: Trajectory) -> Iterator[_StageClaim]:
    """A statement for each stage that moves, with the time at rest after it."""
    if not criteria.stages:
        yield _StageClaim("motion", criteria, trajectory, 0.0)
        return
    moving = [stage for stage in criteria.stages if stage.criteria is not None]
    if not moving:
        raise InvalidProblem("certificate", "nothing moves")
    starts = [stage.start for stage in moving[1:]] + [trajectory.duration]
    for stage, following in zip(moving, starts, strict=True):
        assert stage.criteria is not None
        yield _StageClaim(stage.label, stage.criteria, stage.motion(trajectory), max(0.0, following - stage.end))


class _StageClaim:
    """The claims of a certificate on one stage.

    Args:
        name: of the stage.
        criteria: of the motion.
        trajectory: the motion.
        pause: how long the arm stands after it, s.
    """

    def __init__(self, name: str, criteria: Criteria, trajectory: Trajectory, pause: float) -> None:
        self._name, self._criteria, self._trajectory, self._pause = name, criteria, trajectory, pause
        numbered = enumerate(criteria.obstacles, start=1)
        self._obstacles = [(n, obstacle, solid) for n, obstacle in numbered for solid in _solids(obstacle)]
        self._limits = [limit for limit in criteria.judged_limits if type(limit) in CLAIMED]

    @property
    def content(self) -> dict[str, Any]:
        """All but the proof."""
        robot, trajectory = self._criteria.robot, self._trajectory
        labels = _told_apart([obstacle.label(n) for n, obstacle, _ in self._obstacles])
        own = robot.self_margin if isinstance(robot, SpatialArm) and robot.cover is not None else robot.margin
        return {
            "name": self._name,
            "robot": self._robot_content(),
            "obstacles": [
                obstacle_content(label, obstacle, solid)
                for label, (_, obstacle, solid) in zip(labels, self._obstacles, strict=True)
            ],
            "margins": _flat([robot.margin, own]),
            "may_touch": self._may_touch(),
            "breakpoints": trajectory.breakpoints.tolist(),
            "pause": float(self._pause),
            "coefficients": trajectory.coefficients[::-1].transpose(1, 2, 0).tolist(),
            "start": self._end(0),
            "goal": self._end(-1),
            "tolerances": [TOLERANCE * (1.0 + 1e-3), *self._tolerances()],
            "places": list(self._places()),
            "not_covered": list(dict.fromkeys(self._not_covered())),
        }

    def _robot_content(self) -> dict[str, Any]:
        robot = self._criteria.robot
        assert isinstance(robot, (PlanarArm, SpatialArm))
        names, limits = {limit.name for limit in self._limits}, robot.limits
        ranges = (
            robot.joint_limits if isinstance(robot, PlanarArm) else robot.position_limits
        )  # which joints have to keep, not their plan
        ranges = ranges if "joint range" in names else None
        rates = [getattr(limits, name) if name in names else None for name in RATES]
        tracking = None if isinstance(robot, PlanarArm) else robot.tracking
        chain = _planar_chain(robot) if isinstance(robot, PlanarArm) else _spatial_chain(robot)
        if "torque" not in names:
            chain |= {"masses": [], "carriers": []}
        return chain | {
            "ranges": [[None, None]] * robot.dof if ranges is None else [_flat(each) for each in ranges],
            "limits": np.transpose([[None] * robot.dof if each is None else each for each in rates]).tolist(),
            "tracking_error": np.zeros((3, robot.dof)).tolist() if tracking is None else tracking.numbers.tolist(),
            **self._bodies(),
        }

    def _bodies(self) -> dict[str, Any]:
        """Links and their balls, and which keep apart."""
        robot, apart = self._criteria.robot, self._keeps(FROM_EACH_OTHER)
        if isinstance(robot, PlanarArm):
            return _planar_bodies(robot, apart)
        assert isinstance(robot, SpatialArm)
        numbers = known_robot(robot)
        nodes = np.array(numbers.nodes).reshape(-1, 4)
        body, first, count = np.array(numbers.counts[len(numbers.counts) - 3 * len(nodes) :]).reshape(-1, 3).T
        parents = np.arange(len(nodes))
        for number in np.flatnonzero(count):
            parents[first[number] : first[number] + count[number]] = number
        starts = [start for _, start, _ in numbers.roots]
        return {
            "links": _told_apart([name for name, _, _ in numbers.roots]),
            "link_bodies": [int(body[start]) for start in starts],
            "balls": nodes.tolist(),
            "ball_parents": parents.tolist(),
            "long_balls": [],
            "far_ends": [],
            "own_pairs": _own_pairs(numbers) if apart else [],
        }

    def _keeps(self, kinds: tuple[type[Limit], ...]) -> bool:
        return any(isinstance(limit, kinds) for limit in self._limits)

    def _may_touch(self) -> dict[str, list[int]]:
        """Links and obstacles, by their places in the file, that need not keep clear.

        Of links that no joint moves these are all that are not proven to.
        """
        robot, kept = self._criteria.robot, self._keeps(FROM_OBSTACLES)
        links = (
            [(name, moves) for name, _, moves in known_robot(robot).roots]
            if isinstance(robot, SpatialArm)
            else [(body.name, True) for body in robot.bodies.each]
        )
        near = {(contact.link, contact.place + 1) for contact in self._criteria.fixed_contacts(self._trajectory)}
        pairs = [
            (link, place)
            for link, (name, moves) in enumerate(links)
            for place, (number, obstacle, _) in enumerate(self._obstacles)
            if not kept or (name, obstacle.unmoved.name) in robot.may_touch or (not moves and (name, number) in near)
        ]
        return {"links": [link for link, _ in pairs], "obstacles": [place for _, place in pairs]}

    def _end(self, place: int) -> list[list[float]]:
        """The state that is asked for at an end, where the task gives it in joints, else the state that is there."""
        task, trajectory = self._criteria.task, self._trajectory
        posture = self._given_postures()[place]
        reached = trajectory.at(trajectory.breakpoints[[place]])[0] if posture is None else posture
        return [_flat(reached), _flat(task.end_velocities[place]), _flat(task.end_accelerations[place])]

    @property
    def _is_smooth(self) -> bool:
        return any(limit.order == 3 for limit in self._limits)

    def _given_postures(self) -> tuple[FloatArray | None, FloatArray | None]:
        task = self._criteria.task
        (end,) = self._trajectory.at(self._trajectory.breakpoints[-1:])
        return task.start_posture, task.goal_posture(end)

    def _tolerances(self) -> list[float]:
        """Tolerances of positions, speeds and accelerations."""
        task = self._criteria.task
        outside = (None, task.end_velocities, task.end_accelerations)
        trajectory, edges = self._trajectory, self._trajectory.breakpoints
        jumps = [trajectory.jump_sum(n, outside[n]) if n < 2 or self._is_smooth else 0.0 for n in range(3)]
        sizes = [ROUNDING * edges.size * (1.0 + np.abs(trajectory.at(edges, n)).max()) for n in range(3)]
        return [max(LEAST_TOLERANCE, SPARE * jump) + float(size) for jump, size in zip(jumps, sizes, strict=True)]

    def _end_places(self) -> tuple[Place, ...]:
        """The places of the task at which the motion starts and ends."""
        return self._criteria.task.end_places(self._trajectory.at(self._trajectory.breakpoints[-1:])[0])

    def _places(self) -> Iterator[dict[str, Any]]:
        """The tool's start and end, where the task gives them as positions or poses."""
        robot, postures = self._criteria.robot, self._given_postures()
        within = max(NEAR, LEVERS * robot.dof * (robot.reach()[1] + 1.0) * self._tolerances()[0])
        for at_goal, place in enumerate(self._end_places()):
            for tool, one in place.by_tool(robot) if postures[at_goal] is None else ():
                if isinstance(one, Position | Pose):
                    yield from _tool_places(tool, one, at_goal, within)

    def _not_covered(self) -> Iterator[str]:
        """A line of each thing that the verdicts of the motion speak of, or do not, and the file does not claim."""
        criteria = self._criteria
        yield from (f"limit: {limit.name}" for limit in criteria.judged_limits if type(limit) not in CLAIMED)
        for number, obstacle in enumerate(criteria.obstacles, start=1):
            if not _solids(obstacle):
                yield f"clearance from {obstacle.label(number)}, of a shape or motion that no certificate knows"
        if criteria.task.stay:
            yield f"that the robot stays clear for {criteria.task.stay:g} s after its arrival"
        if criteria.task.duration_bounds is not None:
            yield f"limit: {criteria.task.duration_bounds.name}"
        given = dict(zip(("start", "goal"), self._given_postures(), strict=True))
        covered = {f"{end} {rate}" for end in given for rate in ("velocity", "acceleration")[: 1 + self._is_smooth]}
        covered |= {name for name, posture in given.items() if posture is not None}
        covered |= {
            name for name, place in zip(given, self._end_places(), strict=False) if _is_of_tools(place, criteria.robot)
        }
        for constraint, _ in criteria.task.conditions(self._trajectory):
            if constraint.name not in covered:
                yield f"condition: {constraint.name}"
        yield from criteria.not_judged(self._trajectory)


def _is_of_tools(place: Place, robot: Robot) -> bool:
    """Whether a place is a position or a pose of each tool."""
    return all(isinstance(one, Position | Pose) for _, one in place.by_tool(robot))


def _tool_places(robot: Robot, place: Position | Pose, at_goal: int, within: float) -> Iterator[dict[str, Any]]:
    """A tool's place, as a certificate states it."""
    point, frame = np.append(place.position(robot), np.zeros(3 - robot.dim)), _tool_frame(robot)
    for points, away, farther in _stated_points(place):
        yield {
            "at_goal": at_goal,
            "carrier": (robot.chain.carrier if isinstance(robot, SpatialArm) else robot.dof) - 1,
            "points": frame[points].tolist(),
            "places": (point + away).tolist(),
            "within": float(within + farther),
        }


def _stated_points(place: Position | Pose) -> Iterator[tuple[list[int], FloatArray, float]]:
    """Points of the tool, 0 and of its axes 1 to 3, where they are from its place, (n, 3), and how far off, m."""
    turned = place.rotation if isinstance(place, Pose) else None
    if turned is None:
        yield [0], np.zeros((1, 3)), 0.0
        return
    assert isinstance(place, Pose)
    if place.freedom is None:
        yield [0, 1, 2, 3], np.vstack([np.zeros(3), turned.T]), 0.0
        return
    yield [0], np.zeros((1, 3)), 0.0
    for bound in place.freedom.bounds:
        yield [1 + bound.axis], (turned @ np.array(bound.wanted))[None], 2.0 * sin(bound.angle / 2.0)


def _solids(obstacle: Obstacle) -> tuple[Obstacle, ...]:
    """Solids as certificates know an obstacle that stands still; none where they do not, as of derived classes."""
    still = obstacle.unmoved
    solids = still.in_space if "in_space" in vars(type(still)) else (still,)
    known = all(obstacle_numbers(solid) is not None for solid in solids) and moves_straight(obstacle)
    return solids if known else ()


def _tool_frame(robot: Robot) -> FloatArray:
    """The tool, and points 1 m along its axes, in the frame of the body that carries it, (4, 3), m."""
    if isinstance(robot, PlanarArm):
        along, left = robot.tool_offset
        place, axes = [float(robot.link_lengths[-1]) + along, float(left), 0.0], np.eye(3)
    else:
        assert isinstance(robot, SpatialArm)
        place, axes = _flat(robot.tool.frame.translation), np.transpose(_rotation(robot.tool.frame.rotation))
    return np.asarray(np.array(place) + np.vstack([np.zeros(3), axes]))


def _spatial_chain(robot: SpatialArm) -> dict[str, Any]:
    """Joints, and masses as they are stated: mass, centre and inertia about it, in the frame of a joint."""
    joints, base = robot.chain.joints, robot.base_frame
    carrier = robot.chain.carrier - 1
    carried = [] if robot.payload is None else [(carrier, moved_inertia(robot.payload, robot.tool.frame))]
    bodies = [(n, joint.inertia) for n, joint in enumerate(joints) if joint.inertia is not None] + carried
    return {
        "joints": [joint.name for joint in joints],
        "parents": list(robot.chain.parents),
        "base_rotation": _rotation(base.rotation),
        "base_translation": _flat(base.translation),
        "turns": [int(joint.turns) for joint in joints],
        "rotations": [_rotation(joint.pose.rotation) for joint in joints],
        "translations": [_flat(joint.pose.translation) for joint in joints],
        "axes": [_flat(np.array(joint.axis) / np.linalg.norm(joint.axis)) for joint in joints],
        "gravity": _flat(robot.gravity),
        "friction": [[float(getattr(joint, kind)) for joint in joints] for kind in ("damping", "friction")],
        "masses": [[float(body.mass), *_flat(body.center), *_flat(body.matrix)] for _, body in bodies],
        "carriers": [n for n, _ in bodies],
    }


def _planar_chain(robot: PlanarArm) -> dict[str, Any]:
    """The chain of an arm that turns about z; masses with their inertia about their centres."""
    names, chain = [f"joint {n}" for n in range(1, robot.dof + 1)], robot.rigid_chain
    moments = [] if chain is None else [joint.moments for joint in chain.joints]
    c, s = float(np.cos(robot.base_angle)), float(np.sin(robot.base_angle))
    return {
        "joints": names,
        "parents": list(range(robot.dof)),
        "base_rotation": [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
        "base_translation": [*_flat(robot.base_point), 0.0],
        "turns": [1] * robot.dof,
        "rotations": [np.eye(3).tolist()] * robot.dof,
        "translations": [[length, 0.0, 0.0] for length in (0.0, *_flat(robot.link_lengths)[:-1])],
        "axes": [[0.0, 0.0, 1.0]] * robot.dof,
        "gravity": [*_flat(robot.gravity), 0.0],
        "friction": [
            _flat(each) if each is not None else [0.0] * robot.dof
            for each in (robot.viscous_friction, robot.coulomb_friction)
        ],
        "masses": [_about_center(each) for each in moments],
        "carriers": list(range(len(moments))),
    }


def _planar_bodies(robot: PlanarArm, apart: bool) -> dict[str, Any]:
    """The links as long balls, and the tool where it is elsewhere, a part of the last one."""
    bodies, numbers = robot.bodies.each, range(len(robot.bodies.each))
    ends = [[length, 0.0, 0.0] for length in _flat(robot.link_lengths)]
    tool = [ends[-1][0] + robot.tool_offset[0], float(robot.tool_offset[1]), 0.0]
    starts = [[0.0] * 3] * robot.dof + ends[-1:]
    return {
        "links": [body.name for body in bodies],
        "link_bodies": [min(number + 1, robot.dof) for number in numbers],
        "balls": [[*start, float(body.radius)] for start, body in zip(starts, bodies, strict=False)],
        "ball_parents": list(numbers),
        "long_balls": list(numbers),
        "far_ends": [*ends, tool][: len(bodies)],
        "own_pairs": [[bodies.index(far), bodies.index(near)] for near, far in robot.bodies.pairs if apart],
    }


def _own_pairs(numbers: RobotNumbers) -> list[list[int]]:
    """Balls, or all balls in two nodes, that keep apart."""
    found: list[Sequence[int]] = []
    for one, two, begin, end in numbers.groups:
        found += numbers.pairs[begin:end] if begin < end else [(one, two)]
    return [list(pair) for pair in found]


def _told_apart(names: Sequence[str]) -> list[str]:
    """Names with a number where there are several of one."""
    counts = Counter(names)
    numbers = [names[: place + 1].count(name) for place, name in enumerate(names)]
    return [f"{name} ({n})" if counts[name] > 1 else name for name, n in zip(names, numbers, strict=True)]


def obstacle_content(name: str, obstacle: Obstacle, solid: Obstacle) -> dict[str, Any]:
    """A solid of a shape that the core knows in numbers, which moves as an obstacle does."""
    plain, drift = obstacle_numbers(solid), drift_of(obstacle)
    assert plain is not None and isinstance(solid, Solid)
    corners = solid.local_surface()[0] if len(plain.faces) else np.empty((0, 3))
    return {
        "name": name,
        "shape": plain.shape.name.lower().replace("_", "-"),
        "sizes": _flat(plain.sizes),
        "rotation": _rotation(solid.axes),
        "center": _flat(np.array(solid.center) + drift[:3]),
        "velocity": _flat(drift[3:6]),
        "growth": float(drift[6]),
        "points": corners.tolist(),
    }


def _about_center(moments: Any) -> list[float]:
    """Mass, centre, and inertia about it."""
    mass, first, second = float(moments.mass), np.array(moments.first, float), np.array(moments.second, float)
    center = first / mass if mass > 0.0 else first
    second = second - mass * np.outer(center, center)
    return [mass, *_flat(center), *_flat(np.trace(second) * np.eye(3) - second)]


def _rotation(matrix: Any) -> list[list[float]]:
    """The nearest rotation to a matrix that is one to a few digits."""
    rows = np.array([[float(part) for part in row] for row in matrix])
    if np.linalg.norm(rows.T @ rows - np.eye(3)) > EXACT:
        left, _, right = np.linalg.svd(rows)
        rows = left @ right
    found: list[list[float]] = rows.tolist()
    return found


def _flat(values: Any) -> list[float]:
    return np.asarray(values, dtype=np.float64).ravel().tolist()
