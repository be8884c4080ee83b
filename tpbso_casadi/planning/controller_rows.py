"""Rows of a motion for a controller, so that what it makes of them is proven too.

A joint trajectory controller joins rows by quintics where they state accelerations, by cubics where they state
velocities alone. Where rows stand where the pieces of a motion meet, and these are of no higher degree, that is the
motion again, but for rounding: times are whole nanoseconds, which counts in pieces of microseconds. So what is too
short joins its neighbour, what is of a higher degree is cut in parts, and the motion is slowed by the least factor with
which its limits hold as the controller runs it; that motion is judged like any other. An end that moves is as fast as
planned: what a slower motion misses there is added, and fades away over all of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from problems import Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from problems.certify import exact_time_scale
from problems.motions import MotionRows
from tpbso_casadi.planning.motion import JudgedMotion

NANOSECOND = 1e-9  # s, in which messages count
SHORTEST = (2e-6, 1e-5, 5e-5, 2e-4)  # s: what is shorter joins its neighbour
AS_FAST = 1.00001  # factor that is good enough; else the best of these is taken
PARTS, OFF = (1, 4, 16), 1e-6  # of pieces of a high degree, until what joins them is no farther from them, rad or m
LOOKS = np.array([0.2, 0.5, 0.7])  # where between two rows; not only where what is symmetric meets
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
    def of(cls, motion: JudgedMotion) -> ControllerRows:
        """Rows from which a controller makes a motion that is proven, where any are found, else the fastest.

        Args:
            motion: that is to be run.
        """
        found: list[ControllerRows] = []
        for rows in _slowed_rows(motion):
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

    @property
    def said(self) -> str:
        """The rows described in words."""
        pieces, slower = "quintics" if self.accelerations else "cubics", self.time_scale - 1.0
        slowed = f", {100.0 * slower:.2g} % slower than planned" if slower else ""
        return f"{len(self.times)} rows, joined by {pieces}: {self.joined.status_in_words}{slowed}"


def _whole_nanoseconds(times: FloatArray) -> FloatArray:
    return np.asarray(np.round(times / NANOSECOND) * NANOSECOND)


def _slowed_rows(motion: JudgedMotion) -> Iterator[ControllerRows]:
    """Rows at places of several kinds, each as fast as they may be; what breaks limits by itself stays as it is."""
    smooth = motion.trajectory.jumps_below(3) is None
    near = (
        n for n in PARTS if _departure(_rows(motion, _knots(motion.trajectory.breakpoints, 0.0, n), 1.0, smooth)) < OFF
    )
    parts = next(near, PARTS[-1])
    places = [_knots(motion.trajectory.breakpoints, least, parts) for least in SHORTEST]
    for edges in {each.tobytes(): each for each in places}.values():
        scale = 1.0
        for attempt in range(TRIES):
            rows = _rows(motion, edges, scale, smooth)
            needed = _time_scale(rows.joined.criteria, rows.joined.trajectory)
            if needed <= 1.0 or not motion.feasible:
                break
            scale *= 1.0 + MORE**attempt * (needed - 1.0) + ROUNDING
        yield rows


def _departure(rows: ControllerRows) -> float:
    """How far what joins rows is from the motion at a few times between them, rad or m."""
    between = rows.times[:-1, None] + np.diff(rows.times)[:, None] * LOOKS
    return float(max(np.abs(rows.joined.trajectory.at(t) - rows.source.trajectory.at(t)).max() for t in between.T))


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
