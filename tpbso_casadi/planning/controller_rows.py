"""Rows of a motion for a controller, so that what it makes of them is proven too.

A joint trajectory controller joins rows by quintics where they state accelerations, by cubics where they state
velocities alone. Where rows stand where the pieces of a motion meet, and these are of no higher degree, that is the
motion again, but for rounding: times are whole nanoseconds, which counts in pieces of microseconds. So what is too
short joins its neighbour. Of the rows that are left, as few are taken as keep the controller's motion within an
accuracy of the plan and its rates within their limits; a piece of a high degree is cut in parts for that. The motion is
slowed by the least factor with which its limits hold as the controller runs it, and judged like any other. An end that
moves is as fast as planned: what a slower motion misses there is added, and fades away over all of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from problems import Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray, rounded_up
from problems.certify import exact_time_scale
from problems.motions import MotionRows, RowChoice, apart
from tpbso_casadi.planning.motion import JudgedMotion, alternatives

NANOSECOND = 1e-9  # s, in which messages count
SHORTEST = (2e-6, 1e-5, 5e-5, 2e-4)  # s: what is shorter joins its neighbour
AS_FAST = 1.00001  # factor that is good enough; else the best of these is taken
PARTS = (1, 4, 16)  # of each piece, until rows between them are near enough
ACCURACY = 1e-6  # rad or m, of what a controller makes of rows
RATE_SLACK = 1e-6  # share by which rates between rows may exceed their limits, before the motion is slowed
TRIES, MORE = 8, 2  # to find the factor: slower rows are other rows, so that each time more is added
ROUNDING = 1e-9  # of the factor


@dataclass(frozen=True, eq=False)
class ControllerRows:
    """Rows of a motion, and the motion that a controller makes of them.

    Args:
        source: of which they are.
        times: of the rows in it, (n,), s.
        accelerations: whether they are stated; the rows are joined by quintics then, else by cubics.
        time_scale: how much slower the source is than the motion that was planned.
    """

    source: JudgedMotion
    times: FloatArray
    accelerations: bool = True
    time_scale: float = 1.0

    @classmethod
    def of(cls, motion: JudgedMotion, accuracy: float = ACCURACY) -> ControllerRows:
        """Rows from which a controller makes a motion that is proven, where any are found, else the fastest.

        Args:
            motion: that is to be run.
            accuracy: how far the controller's motion may be from it where no other limit needs more, rad or m.
        """
        found: list[ControllerRows] = []
        for rows in _slowed_rows(motion, accuracy):
            if rows.time_scale < AS_FAST and rows.joined.feasible:
                return rows
            found.append(rows)
        found.sort(key=lambda rows: rows.time_scale)
        return next((rows for rows in found if rows.joined.feasible), found[0])

    @property
    def stamps(self) -> FloatArray:
        """The times that a message states, whole nanoseconds, (n,), s."""
        return _whole_nanoseconds(self.times)

    @cached_property
    def states(self) -> tuple[FloatArray, ...]:
        """Positions, velocities and, where they are stated, accelerations, each (n, dof)."""
        parts, orders = (self.source.trajectory, self._missed_at_ends), range(3 if self.accelerations else 2)
        return tuple(np.sum([part.at(self.times, order) for part in parts], axis=0) for order in orders)

    @property
    def _missed_at_ends(self) -> Trajectory:
        """The correction with which ends that move do so as planned: nothing where both are at rest."""
        ends, planned = self.source.trajectory.breakpoints[[0, -1]], self.source.criteria.task.end_accelerations
        position, velocity, acceleration = (self.source.trajectory.at(ends, order) for order in range(3))
        lost = np.where(planned != 0.0, (self.time_scale**2 - 1.0) * acceleration, 0.0)
        return MotionRows(ends, np.zeros_like(position), (self.time_scale - 1.0) * velocity, lost).trajectory

    @cached_property
    def joined(self) -> JudgedMotion:
        """The motion that a controller makes of them, judged as that which was planned."""
        position, velocity, *others = self.states
        trajectory = MotionRows(self.stamps, position, velocity, others[0] if others else None).trajectory
        return self.source.timed_anew(trajectory)

    @cached_property
    def off(self) -> FloatArray:
        """The largest distances of joints between what a controller makes and the source, for all t, (dof,)."""
        return apart(self.joined.trajectory, self.source.trajectory)

    @property
    def described(self) -> str:
        """The rows in words, without whether they are proven."""
        pieces, slower = "quintics" if self.accelerations else "cubics", self.time_scale - 1.0
        slowed = f", {100.0 * slower:.2g} % slower than planned" if slower else ""
        off, unit = rounded_up(self.off.max()), alternatives(self.source.criteria.robot.joints.units)
        return f"{len(self.times)} rows, joined by {pieces}, {off:g} {unit} from the plan at most{slowed}"

    @property
    def said(self) -> str:
        """The rows described in words, and whether they are proven."""
        return f"{self.described}: {self.joined.status_in_words}"


def _whole_nanoseconds(times: FloatArray) -> FloatArray:
    """Times in s as they are read from whole seconds and nanoseconds, to the last bit: short pieces hang on it."""
    seconds, nanoseconds = np.divmod(np.round(times / NANOSECOND), round(1.0 / NANOSECOND))
    return np.asarray(seconds + NANOSECOND * nanoseconds)


def _slowed_rows(motion: JudgedMotion, accuracy: float) -> Iterator[ControllerRows]:
    """Rows at places of several kinds, each as fast as they may be; what breaks limits by itself stays as it is."""
    smooth = motion.trajectory.jumps_below(3) is None
    places = (times for least in SHORTEST for times in _places(motion, least, 3 if smooth else 2, accuracy))
    tried = set[bytes]()
    for edges in places:
        if edges.tobytes() in tried:
            continue
        tried.add(edges.tobytes())
        scale = 1.0
        for attempt in range(TRIES):
            rows = _rows(motion, edges, scale, smooth)
            needed = _time_scale(rows.joined.criteria, rows.joined.trajectory)
            if needed <= 1.0 or not motion.feasible:
                break
            scale *= 1.0 + MORE**attempt * (needed - 1.0) + ROUNDING
        yield rows


def _places(motion: JudgedMotion, least: float, states: int, accuracy: float) -> tuple[FloatArray, FloatArray]:
    """The times of as few rows as an accuracy needs, and of all of which they were chosen, s.

    A row stands where a stage begins or ends, and at what the motion passes.
    """
    most = [bound * (1.0 + RATE_SLACK) for bound in motion.criteria.robot.limits.by_order]
    stops = [time for stage in motion.stages for time in (stage.start, stage.end)]
    stops += [milestone.time for milestone in motion.criteria.milestones(motion.trajectory)]
    kept = np.unique(np.clip(stops, 0.0, motion.trajectory.duration))
    for parts in PARTS:
        candidates = _with_times(_knots(motion.trajectory.breakpoints, least, parts), kept, least)
        choice = RowChoice(motion.trajectory, candidates, states, most, accuracy)
        chosen = choice.fewest(kept)
        if choice.off(chosen) <= accuracy:
            break
    return chosen, candidates


def _with_times(edges: FloatArray, times: FloatArray, least: float) -> FloatArray:
    """Edges with further times, s, each in the place of an edge that is nearer than ``least``."""
    inner = edges[1:-1]
    far = (np.abs(inner[:, None] - times) >= least).all(axis=1)
    further = times[(times - edges[0] >= least) & (edges[-1] - times >= least)]
    return np.union1d(np.concatenate([edges[:1], inner[far], edges[-1:]]), further)


def _knots(breakpoints: FloatArray, least: float, parts: int) -> FloatArray:
    """Breakpoints, s, without those that are nearer than ``least`` to the one before, and equal parts between them."""
    kept = [breakpoints[0]]
    for edge in breakpoints[1:-1]:
        if edge - kept[-1] >= least and breakpoints[-1] - edge >= least:
            kept.append(edge)
    edges = np.array([*kept, breakpoints[-1]])
    return np.asarray(np.interp(np.arange(parts * (len(edges) - 1) + 1) / parts, np.arange(len(edges)), edges))


def _rows(motion: JudgedMotion, edges: FloatArray, scale: float, smooth: bool) -> ControllerRows:
    """The rows at edges, s, of a motion that is slowed, up to its end."""

    def clock(times: FloatArray) -> FloatArray:
        return _whole_nanoseconds(times * scale)

    slower = motion.trajectory.time_scaled(scale) if scale > 1.0 else motion.trajectory
    source = replace(motion, trajectory=slower, criteria=motion.criteria.with_clock(clock))
    times = np.minimum(clock(edges), slower.duration)
    times[-1] = slower.duration
    return ControllerRows(source, times, smooth, scale)


def _time_scale(criteria: Criteria, trajectory: Trajectory) -> float:
    """How much slower a motion would have to be for its limits to hold; of one of several stages, each of these."""
    parts = [(stage.criteria, stage.motion(trajectory)) for stage in criteria.stages if stage.criteria is not None]
    return max(exact_time_scale(own.judged_limits, part) for own, part in parts or [(criteria, trajectory)])
