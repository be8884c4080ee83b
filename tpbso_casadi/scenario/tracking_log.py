"""Logs of a robot that follows plans: where its joints were to be, and where they were."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.scenario.columns import LOG
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.motion_files import read_recorded
from tpbso_casadi.scenario.recorded_rows import AS_IT_IS, Reading
from tpbso_casadi.scenario.validation import ScenarioError

LEAST_ROWS = 5


@dataclass(frozen=True, eq=False)
class TrackingLog:
    """A log, its rows in the order of their times.

    Attributes:
        errors: how far joints were from where they were commanded, (n, k), rad or m.
        speed: commanded, from differences, (n, k).
        acceleration: likewise.
        joint_names: of the columns, in their order; empty where they are numbered.
        notes: what was left out of it, a line each.
    """

    errors: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    joint_names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, times: FloatArray, commanded: FloatArray, measured: FloatArray) -> TrackingLog:
        """The log of times (n,), s, and joints (n, k) as commanded and as measured."""
        speed = np.gradient(commanded, times, axis=0, edge_order=2)
        acceleration = np.gradient(speed, times, axis=0, edge_order=2)
        return cls(measured - commanded, speed, acceleration)

    @classmethod
    def joined(cls, logs: Sequence[TrackingLog]) -> TrackingLog:
        """Several logs joined in one."""
        parts = ([log.errors for log in logs], [log.speed for log in logs], [log.acceleration for log in logs])
        errors, speed, acceleration = (np.concatenate(part) for part in parts)
        return cls(errors, speed, acceleration)


def read_tracking_log(
    folder: InputFolder, name: str, reading: Reading = AS_IT_IS, degrees: bool = False
) -> TrackingLog:
    """The log in a table with the header ``t,q1..qk,m1..mk``, or whose columns are mapped to these.

    Args:
        folder: that holds it.
        name: of the file.
        reading: how it is read.
        degrees: whether joints are in degrees; else in rad or m.

    Raises:
        ScenarioError: naming the file, the line and what is wrong with it.
    """
    rows, place = read_recorded(folder, name, reading, LOG), f"{folder.path / name}"
    if not rows.measured:
        raise ScenarioError(f"{place}: {LOG.header}")
    if len(rows.times) < LEAST_ROWS:
        raise ScenarioError(f"{place}: {len(rows.times)} rows; {LEAST_ROWS} at least are needed")
    late = np.flatnonzero(~(np.diff(rows.times) > 0.0))
    if late.size:
        raise ScenarioError(f"{place}: row {late[0] + 2}: times have to increase")
    states = [np.array(table) for table in (rows.positions, rows.measured)]
    with np.errstate(all="ignore"):
        log = TrackingLog.of(np.array(rows.times), *(np.radians(table) if degrees else table for table in states))
    if not all(np.isfinite(part).all() for part in (log.errors, log.speed, log.acceleration)):
        raise ScenarioError(f"{place}: times are too close to each other, or numbers too large, for speeds")
    return replace(log, joint_names=tuple(rows.joint_names), notes=tuple(rows.notes))
