"""Logs of a robot that follows plans: where its joints were to be, and where they were."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.scenario.input_files import InputFolder, numbers_of
from tpbso_casadi.scenario.validation import MOST_LINKS, ScenarioError

HEADER = "the header t,q1..qk,m1..mk is needed: commanded, then measured joints, rad or m"
COMMANDED = re.compile(r"q[1-9][0-9]*")
LEAST_ROWS, MOST_ROWS = 5, 1_000_000


@dataclass(frozen=True, eq=False)
class TrackingLog:
    """A log, its rows in the order of their times.

    Attributes:
        errors: how far joints were from where they were commanded, (n, k), rad or m.
        speed: commanded, from differences, (n, k).
        acceleration: likewise.
    """

    errors: FloatArray
    speed: FloatArray
    acceleration: FloatArray

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
        return cls(*(np.concatenate(part) for part in parts))


def read_tracking_log(folder: InputFolder, name: str) -> TrackingLog:
    """The log in a CSV file with the header ``t,q1..qk,m1..mk``: s, then rad or m; empty lines are skipped.

    Raises:
        ScenarioError: naming the file, the line and what is wrong with it.
    """
    lines = [(n, line) for n, line in enumerate(folder.read_text(name).splitlines(), start=1) if line.strip()]
    place = f"{folder.path / name}"
    if not lines:
        raise ScenarioError(f"{place}: is empty; {HEADER}")
    joints = _joints(f"{place} line {lines[0][0]}", lines[0][1])
    rows: list[list[float]] = []
    for number, line in lines[1:]:
        row = numbers_of(f"{place} line {number}", line, 1 + 2 * joints)
        if not np.isfinite(row).all():
            raise ScenarioError(f"{place} line {number}: a number is not finite")
        if rows and not row[0] > rows[-1][0]:
            raise ScenarioError(f"{place} line {number}: times have to increase")
        if len(rows) == MOST_ROWS:
            raise ScenarioError(f"{place} line {number}: more than {MOST_ROWS} rows")
        rows.append(row)
    if len(rows) < LEAST_ROWS:
        raise ScenarioError(f"{place}: {len(rows)} rows; {LEAST_ROWS} at least are needed")
    table = np.array(rows)
    with np.errstate(all="ignore"):
        log = TrackingLog.of(table[:, 0], table[:, 1 : 1 + joints], table[:, 1 + joints :])
    if not all(np.isfinite(part).all() for part in (log.errors, log.speed, log.acceleration)):
        raise ScenarioError(f"{place}: times are too close to each other, or numbers too large, for speeds")
    return log


def _joints(place: str, line: str) -> int:
    """How many joints the header names."""
    names = [cell.strip() for cell in line.split(",")]
    joints = sum(1 for name in names if COMMANDED.fullmatch(name))
    numbers = range(1, joints + 1)
    if not 1 <= joints <= MOST_LINKS or names != ["t", *(f"q{n}" for n in numbers), *(f"m{n}" for n in numbers)]:
        raise ScenarioError(f"{place}: {HEADER}")
    return joints
