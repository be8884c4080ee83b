"""Rows of a table of motion: times, positions, turns, and what is wrong with the first that cannot be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.base.ranges import ANGLES, COORDINATES, TIMES, check_within, is_of_length_one

LEAST_STEP = 1e-6  # s, from one row to the next
LEAST_COSINE = 0.7  # between the quaternions of two rows: a turn of 90 degrees; farther, a spline of them is no turn


def first_fault(times: Sequence[float], positions: FloatArray, turns: FloatArray | None) -> tuple[int, str] | None:
    """The number of the first row that cannot be, from 0, and why; None where all can.

    Args:
        times: s, (n,).
        positions: (n, dim), m.
        turns: (n, 1), rad, in the plane, (n, 4), x, y, z, w, in space; None where nothing turns.
    """
    for number, time in enumerate(times):
        if not abs(time) <= TIMES[1]:
            return number, f"t = {time:g} s is not within {-TIMES[1]:g} and {TIMES[1]:g} s"
        if number and not time - times[number - 1] >= LEAST_STEP:
            return number, f"times have to increase, by {LEAST_STEP:g} s at least"
        reason = _outside(positions[number], COORDINATES, "m")
        if not reason and turns is not None:
            reason = _turn_fault(turns, number)
        if reason:
            return number, reason
    return None


def _outside(values: FloatArray, bounds: tuple[float, float], unit: str) -> str:
    try:
        check_within("", values.tolist(), bounds, unit)
    except InvalidProblem as error:
        return error.reason
    return ""


def _turn_fault(turns: FloatArray, number: int) -> str:
    """What is wrong with the turn of a row, if anything."""
    turn = turns[number]
    if turn.size == 1:
        return _outside(turn, ANGLES, "rad")
    if not is_of_length_one(turn):
        return f"quaternion of length {np.linalg.norm(turn):.6g}, not 1"
    if number and abs(float(_unit(turn) @ _unit(turns[number - 1]))) < LEAST_COSINE:
        return "turned by more than 90 degrees from the row before; more rows are needed"
    return ""


def _unit(quaternion: FloatArray) -> FloatArray:
    return np.asarray(quaternion / np.linalg.norm(quaternion))


def as_numbers(turns: FloatArray) -> FloatArray:
    """The numbers through which a spline runs: angles, or quaternions of length 1, each near the one before."""
    if turns.shape[1] == 1:
        return turns
    units = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    cosines = (units[1:] * units[:-1]).sum(axis=1)
    return np.asarray(units * np.cumprod(np.append(1.0, np.where(cosines < 0.0, -1.0, 1.0)))[:, None])
