"""What the player is given, in the plane and in space; the closest two of every moment among it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import casadi as ca
import numpy as np

from problems.assembly import Criteria, MotionStage
from problems.base import FloatArray, Matrix, as_array
from problems.limits import CoverClearance, CoverLimit, Pair, Proximity, clearances
from problems.robots import LinkAppearance
from problems.scene import standing
from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.appearance import written_shades
from tpbso_casadi.figures.palette import line_of
from tpbso_casadi.figures.scene import Course
from tpbso_casadi.figures.space_scene import Polyhedron, ground
from tpbso_casadi.planning import alternatives, shares_of_limits, torques_of


def nearest(start: FloatArray, end: FloatArray, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The nearest points of n segments, and those of n lines that they are nearest to.

    Args:
        start: of the segments, (n, 2), m.
        end: likewise.
        corners: of the lines, (n, m, 2), m; a closed line ends where it starts.

    Returns:
        Both (n, 2), m; where a segment and its line cross, both are there.
    """
    first, last = corners[:, :-1], corners[:, 1:]
    ends = [np.broadcast_to(point[:, None], first.shape) for point in (start, end)]
    on_segment = [*ends, _foot(corners, *(np.broadcast_to(point[:, None], corners.shape) for point in (start, end)))]
    on_line = [*(_foot(point, first, last) for point in ends), corners]
    crossing = _crossing(ends[0], ends[1], first, last)
    near, far = (np.concatenate([*points, crossing], axis=1) for points in (on_segment, on_line))
    gaps = np.linalg.norm(far - near, axis=2)
    rows = np.arange(len(start)), np.nanargmin(gaps, axis=1)
    return near[rows], far[rows]


def _foot(points: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """The points of segments that are nearest to given points; all (n, m, 2)."""
    along = last - first
    length = np.maximum((along**2).sum(axis=2), np.finfo(float).tiny)
    share = np.clip(((points - first) * along).sum(axis=2) / length, 0.0, 1.0)
    return np.asarray(first + share[..., None] * along)


def _crossing(start: FloatArray, end: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """The points where segments cross, (n, m, 2); not a number where they do not."""
    one, two, between = end - start, last - first, first - start
    turn = _cross(one, two)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = [_cross(between, two) / turn, _cross(between, one) / turn]
    crosses = np.all([(share >= 0.0) & (share <= 1.0) for share in shares], axis=0)
    share = np.where(crosses, shares[0], np.nan)
    return np.asarray(start + share[..., None] * one)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


@dataclass(frozen=True)
class Closest:
    """The closest two of all that have to keep a distance, at n times.

    Attributes:
        pairs: those that are the closest at any time, or what they are called.
        numbers: of the closest, (n,).
        distances: (n,), m; negative where the two meet.
        points: on both surfaces, (n, 2, dim), m.
    """

    pairs: tuple[Pair, ...] | tuple[str, ...]
    numbers: np.ndarray
    distances: FloatArray
    points: FloatArray


def closest_of(criteria: Criteria, theta: FloatArray, times: FloatArray) -> Closest | None:
    """The closest two in n postures (n, dof), rad, at times (n,) in s; None where nothing ever has to keep apart."""
    found = [
        (rows, closest)
        for part, rows in criteria.at_times(times)
        if (closest := _closest_in(part, theta[rows], times[rows])) is not None
    ]
    if sum(len(rows) for rows, _ in found) < times.size:
        return None
    every = list(dict.fromkeys(pair for _, closest in found for pair in closest.pairs))
    numbers, distances = np.empty(times.size, dtype=int), np.empty(times.size)
    points = np.empty((times.size, 2, criteria.robot.dim))
    for rows, closest in found:
        numbers[rows] = np.array([every.index(pair) for pair in closest.pairs])[closest.numbers]
        distances[rows], points[rows] = closest.distances, closest.points
    return Closest(tuple(every), numbers, distances, points)  # type: ignore[arg-type]


def _closest_in(criteria: Criteria, theta: FloatArray, times: FloatArray) -> Closest | None:
    """The nearest pair of criteria that hold at all these times.

    How far they are apart is what the limits say of balls, and of lines that meet; lines that do not are measured as
    they are drawn, because some limits know only a lower bound. Of a robot with a cover they are those of the verdict
    on clearance; where there are no obstacles, of that on its own links. None where nothing has to keep apart.
    """
    limits = [limit for limit in criteria.limits if isinstance(limit, Proximity)]
    pairs = [pair.without_growth() for limit in limits for pair in limit.pairs]
    if criteria.robot.cover is not None:
        return _of_covers([limit for limit in criteria.judged_limits if isinstance(limit, CoverLimit)], theta, times)
    if not pairs:
        return None
    frames = criteria.robot.positions(ca.DM(theta))
    apart_of, points_of = MEASURES[criteria.robot.dim]
    apart = apart_of(pairs, frames, times)
    every, numbers = np.unique(apart.argmin(axis=1), return_inverse=True)
    distances = apart.min(axis=1)
    points = np.empty((len(theta), 2, criteria.robot.dim))
    for number, index in enumerate(every):
        rows = np.flatnonzero(numbers == number)
        seen = [frame[rows.tolist(), :] for frame in frames]
        points[rows] = points_of(pairs[index], seen, times[rows], distances[rows, None])
    return Closest(tuple(pairs[index] for index in every), numbers, distances, points)


def _of_covers(limits: Sequence[CoverLimit], theta: FloatArray, times: FloatArray) -> Closest | None:
    """The closest of covers and obstacles; else of covers of links that are near each other in every posture."""
    outside = [limit.without_growth() for limit in limits if isinstance(limit, CoverClearance)]
    limit = next(iter((*outside, *limits)), None)
    if limit is None:
        return None
    found, world = limit.closest(theta, times), limit.world
    names = ["" if pair is None else world.described(pair) for pair in found.pairs]
    every, numbers = np.unique(names, return_inverse=True)
    return Closest(tuple(every.tolist()), numbers, limit.margin + found.clearance_margins, found.points)


def _said_apart(pairs: Sequence[Pair], frames: Sequence[Matrix], times: FloatArray) -> FloatArray:
    """How far pairs are apart as verdicts have it, (n, pairs), m."""
    apart = as_array(clearances(pairs, frames, ca.DM(times)))
    for column, pair in enumerate(pairs):
        exact = _exactly(pair, [as_array(end) for end in pair.ends(frames)], times)
        if exact is not None:
            apart[:, column] = exact - float(pair.thickness)
    return apart


def _exactly(pair: Pair, ends: Sequence[FloatArray], times: FloatArray) -> FloatArray | None:
    """How far the middles of a pair are apart where that is more than its formula says, (n,), m."""
    view = pair.view(times)
    return pair.exactly_apart(*(ends if view is None else [view.seen(end) for end in ends]))


def _drawn_apart(pairs: Sequence[Pair], frames: Sequence[Matrix], times: FloatArray) -> FloatArray:
    """How far lines are apart as they are drawn, (n, pairs), m; what the limits say where they meet."""
    said, drawn = _said_apart(pairs, frames, times), [_between_lines(pair, frames, times) for pair in pairs]
    gaps = [np.linalg.norm(far - near, axis=1) for near, far in drawn]
    widths = [float(sum(pair.radii)) for pair in pairs]
    return np.where(said < 0.0, said, np.transpose(gaps) - widths)


def _between_lines(pair: Pair, frames: Sequence[Matrix], times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The nearest points of two middle lines in the plane, (n, 2), m, each."""
    start, end = (as_array(end) for end in pair.ends(frames)[:2])
    return nearest(start, end, pair.opposite(frames, times))


def _points_on_lines(pair: Pair, frames: Sequence[Matrix], times: FloatArray, distances: FloatArray) -> FloatArray:
    """The nearest points on the surfaces of two bodies in the plane, (n, 2, 2)."""
    near, far = _between_lines(pair, frames, times)
    toward = (far - near) / np.maximum(np.linalg.norm(far - near, axis=1, keepdims=True), np.finfo(float).tiny)
    first, *second = map(float, pair.radii)
    return np.stack([near + first * toward, far - sum(second) * toward], axis=1)


def _points_on_balls(pair: Pair, frames: Sequence[Matrix], times: FloatArray, distances: FloatArray) -> FloatArray:
    """The nearest points on the first ball of a pair and on the other thing, (n, 2, 3)."""
    ends = [as_array(end) for end in pair.ends(frames)]
    middle, radius = ends[0], float(pair.radii[0])
    toward = -_gradient(pair, ends, times)
    near = middle + radius * toward
    return np.stack([near, near + distances * toward], axis=1)


STEP = 1e-5  # m: of differences


def _gradient(pair: Pair, ends: list[FloatArray], times: FloatArray) -> FloatArray:
    """Unit vectors (n, 3) along which the first of a pair goes away from the other; 0 where there is no such way."""
    if _exactly(pair, ends, times) is None:
        symbols = [ca.SX.sym(f"end_{number}", *end.shape) for number, end in enumerate(ends)]
        gradient = ca.gradient(ca.sum1(pair.between(*symbols, times=ca.DM(times))), symbols[0])
        away = as_array(ca.Function("gradient", symbols, [gradient])(*ends))
    else:
        around = [[_exactly(pair, [ends[0] + sign * step], times) for sign in (1, -1)] for step in STEP * np.eye(3)]
        away = np.array(around)[:, 0].T - np.array(around)[:, 1].T
    return np.asarray(away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), np.finfo(float).tiny))


MEASURES = {2: (_drawn_apart, _points_on_lines), 3: (_said_apart, _points_on_balls)}  # by the robot's dimensions


DIGITS = 4  # of metres
FINE = 6  # of seconds, joints, and directions
PER_TIME = {"speed": "/s", "acceleration": "/s²", "jerk": "/s³"}  # of a joint's unit


def shared_data(frames: Frames) -> dict[str, Any]:
    """The data that every stage needs."""
    robot = frames.criteria.robot
    closest = closest_of(frames.criteria, frames.theta, frames.times)
    return {
        "times": rounded(frames.times, FINE),
        "joints": rounded(frames.joints),
        "strokes": [[*range(frames.joints.shape[1])[stroke]] for stroke in robot.strokes],
        "points": rounded(frames.task_points),
        "joint_names": list(robot.joints.names),
        "lines": [_line(joint) for joint in range(robot.dof)],
        "curves": _curves(frames),
        "closest": None if closest is None else _closest(closest),
        "clearance": frames.clearance,
        "notes": frames.notes,
        "seconds": frames.seconds,
        "stages": [_stage(stage) for stage in frames.criteria.stages],
        "broken": rounded(np.array([span for spans in frames.broken.values() for span in spans]), FINE),
    }


def _stage(stage: MotionStage) -> dict[str, Any]:
    """A stage: what it is called, from when to when it lasts, s, and what is told at its beginning."""
    start, end = rounded(np.array([stage.start, stage.end]), FINE)
    return {"name": stage.name, "label": stage.label, "start": start, "end": end, "signal": stage.signal_in_words}


def rounded(values: FloatArray, digits: int = DIGITS) -> list[Any]:
    """Nested lists of numbers that are short to write."""
    return list(np.asarray(values, dtype=float).round(digits).tolist())


def _line(joint: int) -> dict[str, Any]:
    """Colour and dashes of a joint's curve, the latter in widths of the line."""
    style = line_of(joint)
    return {"colour": style["color"], "dashes": [] if style["linestyle"] == "-" else list(style["linestyle"][1])}


def _curves(frames: Frames) -> list[dict[str, Any]]:
    """Positions of the joints; what is limited as shares of the limits; torques that nothing limits as they are."""
    robot, trajectory, times = frames.criteria.robot, frames.trajectory, frames.times
    units, torque_units = robot.joints.units, robot.joints.torque_units
    curves = [_curve(f"joint position [{alternatives(units)}]", frames.theta, units)]
    curves[0]["bounds"] = robot.limits.position
    for name, shares in shares_of_limits(frames.criteria, trajectory, times):
        own = [unit + PER_TIME[name] for unit in units] if name in PER_TIME else torque_units
        curves.append(_curve(f"joint {name} / limit", shares, own) | {"limits": list(getattr(robot.limits, name))})
    torques = torques_of(robot, trajectory, times) if robot.limits.torque is None else None
    if torques is not None:
        curves.append(_curve(f"joint torque [{alternatives(torque_units)}]", torques, torque_units))
    return curves


def _curve(label: str, values: FloatArray, units: Sequence[str]) -> dict[str, Any]:
    return {"label": label, "values": rounded(values, FINE), "units": list(units)}


def _closest(closest: Closest) -> dict[str, Any]:
    return {
        "names": [str(pair) for pair in closest.pairs],
        "numbers": closest.numbers.tolist(),
        "distances": rounded(closest.distances, FINE),
        "points": rounded(closest.points),
    }


def plane_data(frames: Frames) -> dict[str, Any]:
    """The arm and its surroundings in the plane, as a page draws them: lengths in m."""
    criteria = frames.criteria
    return {
        "extent": rounded(np.array(frames.extent)),
        "bodies": [[body.start, body.end, float(body.radius)] for body in criteria.robot.bodies.each if body.radius],
        "obstacles": [rounded(obstacle.outline()) for obstacle in standing(criteria.task.scenery)],
        "moving": [_moving_in_plane(course) for course in frames.courses],
    }


def _moving_in_plane(course: Course) -> dict[str, Any]:
    """An obstacle that moves: its outline as seen from its frame, and origin and first axis of that at each time."""
    return {
        "outline": rounded(course.obstacle.unmoved.outline()),
        "frames": rounded(course.frames[:, :2].reshape(-1, 4)),
        "way": rounded(course.middles),
    }


ROUND = 24  # faces: what has more is round
AXES = 0.15  # length of the axes at the base, of the picture's
LIGHT = np.array([-0.35, -0.45, 0.82])


def space_data(frames: Frames) -> dict[str, Any]:
    """The robot and its surroundings in space, and the view of them: lengths in m, angles in rad."""
    scene, robot = frames.scene, frames.criteria.robot
    bounds = scene.bounds(frames.theta)
    view = scene.view(frames.theta, bounds)
    x, y, z = view.axes[2]
    return {
        "centers": rounded(scene.centers(frames.theta)),
        "radii": rounded(scene.radii, FINE),
        "kinds": list(_kinds([body.name for body in scene.balls])),
        "looks": [_appearance(appearance) for appearance in scene.appearances],
        "bodies": _frames(scene.frames(frames.theta)),
        "bare": scene.bare.tolist(),
        "solids": [_solid(solid) for solid in scene.solids],
        "planes": [[a, b, face] for (a, b), face in scene.planes.items()],
        "moving": [_moving_in_space(course) for course in scene.courses],
        "ground": rounded(ground(bounds)),
        "axes": _axes(np.array(robot.base), AXES * float(np.ptp(bounds, axis=0).max())),
        "camera": {
            "center": rounded(view.center),
            "distance": view.distance,
            "azimuth": float(np.arctan2(y, x)),
            "elevation": float(np.arcsin(z)),
        },
    }


def _kinds(names: list[str]) -> Iterator[int]:
    """The number of each body, where balls of one name in a row are one."""
    for number, (_, group) in enumerate(groupby(names)):
        yield from (number for _ in group)


def _solid(solid: Polyhedron) -> dict[str, Any]:
    """The surface of a solid; of a round one, drawn as an outline, the sharp edges alone."""
    edges = [edge for edge in solid.edges if edge.sharp or len(solid.faces) <= ROUND]
    return {
        "vertices": rounded(solid.vertices, FINE),
        "faces": solid.faces,
        "normals": rounded(solid.normals, FINE),
        "offsets": rounded(solid.offsets, FINE),
        "center": rounded(solid.center),
        "shades": rounded(0.75 + 0.25 * np.abs(solid.normals @ LIGHT), 2),
        "edges": [[*edge.ends, edge.faces[0], edge.faces[-1], edge.sharp] for edge in edges],
    }


def _moving_in_space(course: Course) -> dict[str, Any]:
    """The number of an obstacle that moves, where its frame is at each time, and the way of its middle."""
    return {"number": course.number - 1, "frames": _frames(course.frames), "way": rounded(course.middles)}


def _frames(frames: FloatArray) -> list[Any]:
    """Frames (..., 4, 3): origins as lengths, axes as directions."""
    origins, axes = frames[..., :1, :].round(DIGITS), frames[..., 1:, :].round(FINE)
    return list(np.concatenate([origins, axes], axis=-2).tolist())


def _appearance(appearance: LinkAppearance) -> dict[str, Any]:
    """The appearance of a link: its body, the triangles there, and the shades of its colour."""
    triangles = appearance.triangles
    return {
        "body": appearance.body,
        "vertices": rounded(triangles.vertices),
        "faces": triangles.faces.tolist(),
        "shades": written_shades(appearance.colour),
    }


def _axes(base: FloatArray, length: float) -> list[Any]:
    """Name, start and end of the axes at the base."""
    return [[name, rounded(base), rounded(base + length * row)] for name, row in zip("xyz", np.eye(3), strict=True)]
