"""A steady speed of the tool along a way: what is kept, where it may be left, and what stands against it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from typing import Self

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, as_array
from problems.limits import StatedExpression
from problems.motions import MotionView, Trajectory
from problems.robots import Robot
from problems.tasks.tool_path import ToolPath, stated_limit

AT_LIMIT = 0.9  # share of a limit from which on a joint is said to be there
INTERVALS = 4_000  # of a motion, in which the mean speed of the tool is measured
UNSAID = 0.1  # of the way: the largest distance from an end within which the tool is slower where none is stated
ROUNDING = 1.002  # times the least speed, below which a mean speed counts as slower
BESIDE = 3.0  # times as far from a corner as the way begins to round it, the tool is at the corner: joints round more
SPARE = 1.02, 1e-6  # times as far from an end as the tool was seen slower, and as many m, are stated


@dataclass(frozen=True)
class SteadySpeed:
    """The tool is as fast as stated all along a way, but next to ends and corners.

    Args:
        speed: of the tool, m/s.
        tolerance: share of it by which the tool may be slower or faster.
        at_ends: distance from either end within which it may be slower, m; None where that is as far as limits need,
            a tenth of the way at most.
        at_corners: the same of corners between lines.
    """

    speed: float
    tolerance: float
    at_ends: float | None = None
    at_corners: float | None = None

    @property
    def least(self) -> float:
        """The least speed where the tool may not be slower, m/s."""
        return self.speed * (1.0 - self.tolerance)

    @property
    def note(self) -> str:
        """A line on what is kept, and where."""
        places = (("from the ends", self.at_ends), ("from corners", self.at_corners))
        farther = " and ".join(f"{within:.3g} m {place}" for place, within in places if within)
        where = f"where it is more than {farther}" if farther else "everywhere"
        return f"the tool keeps {self.speed:g} m/s within {100.0 * self.tolerance:.3g} % {where}"

    def limits(self, path: ToolPath, robot: Robot) -> list[StatedExpression]:
        """The limits of the tool's speed at every time: the largest, and the least where it is kept.

        Next to an end the value is larger than the speed: it grows with the distance that is left to where the speed
        has to be kept.
        """

        def kept(moment: MotionView) -> ca.SX:
            values = [ca.norm_2(moment.tool_velocity)]
            ends, corners = path.way.points(np.array([0.0, 1.0])), [corner for corner, _ in path.way.corners]
            for points, within in ((ends, self.at_ends), (corners, self.at_corners)):
                if within:
                    away = [ca.norm_2(moment.tool - ca.DM(point)) for point in points]
                    values += [self.least * (2.0 - distance / within) for distance in away]
            return reduce(ca.fmax, values)

        return [
            path.speed_limit(robot, self.speed * (1.0 + self.tolerance)),
            stated_limit("steady tool speed", "m/s", kept, robot, (self.least,), None),
        ]

    def where_kept(self, path: ToolPath, robot: Robot, motion: Trajectory) -> tuple[Self, str | None]:
        """The statement with the distances that a motion needs, and where and why the motion breaks it, if it does."""
        times = np.linspace(0.0, motion.duration, INTERVALS + 1)
        tool = as_array(robot.tool.position(ca.DM(motion.at(times))))
        steps = np.linalg.norm(np.diff(tool, axis=0), axis=1)
        slow = steps < self.least * ROUNDING * np.diff(times)
        if slow.all():
            most = float((steps / np.diff(times)).max())
            return self, f"the way is too short or a limit too low: the tool comes to {most:.4g} m/s at most"
        marks, needed = self._marks(path, tool), {"at_ends": 0.0, "at_corners": 0.0}
        for first, last in _runs(slow):
            near = [mark for mark in marks if first <= mark[1] and mark[0] <= last]
            if not near:
                slowest = first + int(steps[first:last].argmin())
                speed, along = steps[slowest] / times[1], float(steps[:slowest].sum())
                why = _at_its_limit(robot, motion, float(times[slowest]))
                return self, f"the tool comes down to {speed:.4g} m/s, {along:.3g} m along the way{why}"
            part = tool[max(first - 1, 0) : last + 2]  # as mean speeds next to a slow one hide slow moments
            away = np.array([np.linalg.norm(part - point, axis=1) for _, _, point, _ in near])
            nearest = away.argmin(axis=0)
            for number, (_, _, _, key) in enumerate(near):
                far = float(away[number, nearest == number].max(initial=0.0)) * SPARE[0] + SPARE[1]
                needed[key] = max(needed[key], far)
        for key, far in needed.items():
            stated, most = getattr(self, key), UNSAID * path.way.length
            allowed = most if stated is None else stated
            if far > allowed:
                why = f"{key} = {allowed:.3g} m, " + (
                    "a tenth of the way where it is not stated, " if stated is None else ""
                )
                return self, f"{why}and the limits need {far:.3g} m to come to the speed"
        return replace(self, **{key: far for key, far in needed.items() if getattr(self, key) is None}), None

    def _marks(self, path: ToolPath, tool: FloatArray) -> list[tuple[int, int, FloatArray, str]]:
        """Places next to which the tool may be slower: when it is there, from sample to sample, the place, its key."""
        ends = path.way.points(np.array([0.0, 1.0]))
        marks = [(0, 0, ends[0], "at_ends"), (INTERVALS, INTERVALS, ends[1], "at_ends")]
        for corner, back in path.way.corners:
            away = np.linalg.norm(tool - corner, axis=1)
            near = np.flatnonzero(away <= max(BESIDE * back, float(away.min())))
            marks.append((int(near[0]), int(near[-1]), corner, "at_corners"))
        return marks


def _runs(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """The first and the last node of each run of chosen intervals."""
    padded = np.concatenate([[False], chosen, [False]])
    changes = np.flatnonzero(padded[1:] != padded[:-1])
    return [(int(first), int(last)) for first, last in changes.reshape(-1, 2)]


def _at_its_limit(robot: Robot, motion: Trajectory, time: float) -> str:
    """A clause on the joint that is nearest to a limit at a time, s; empty where none is near."""
    at, named = np.array([time]), ("speed", "acceleration", "jerk")
    shares = {
        name: np.abs(motion.at(at, order)[0]) / bound
        for order, (name, bound) in enumerate(zip(named, robot.limits.by_order, strict=False), start=1)
    }
    if robot.rigid_chain is not None and robot.limits.torque is not None:
        state = (ca.DM(motion.at(at, order)) for order in range(3))
        shares["torque"] = np.abs(as_array(robot.rigid_chain.torques(*state))[0]) / np.array(robot.limits.torque)
    name = max(shares, key=lambda each: float(shares[each].max()))
    joint = int(shares[name].argmax())
    if shares[name][joint] < AT_LIMIT:
        return ""
    return f", where {robot.joints.names[joint]} is at its limit of {name}"
