"""A given path of the joints: lines with rounded corners."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import factorial
from typing import Self

import numpy as np
from scipy.interpolate import PPoly, make_interp_spline

from problems.base import FloatArray, InvalidProblem
from problems.motions.trajectory import Trajectory

SPLINE_DEGREE, BLEND_DEGREE = 5, 4
SPLINE_NEEDS = 3  # waypoints; two are a line
SAME_WAYPOINT = 1e-9  # of the whole length
BLEND_REACH = 6.0 / 32.0  # how far the middle of a blend is from its corner, for a unit of half length and of turn


@dataclass(frozen=True)
class JointPath:
    """Joint angles over a path parameter u.

    Args:
        breakpoints: p + 1 increasing values of u.
        coefficients: (order, p, k), rad; highest power first, each piece in its own u from 0, as SciPy's PPoly.
    """

    breakpoints: FloatArray
    coefficients: FloatArray

    @classmethod
    def of(cls, trajectory: Trajectory) -> Self:
        """The path of a motion, with the time as its parameter."""
        return cls(trajectory.breakpoints, trajectory.coefficients)

    @classmethod
    def through(cls, waypoints: FloatArray) -> Self:
        """The spline of degree 5 through waypoints, over the length of their chords: four continuous derivatives.

        Its third and fourth derivatives are zero at both ends, which bends it least.

        Args:
            waypoints: (n, k), rad.

        Raises:
            InvalidProblem: fewer than two, or two in a row that are the same, or a number that is none.
        """
        lengths = _chords(waypoints)
        u = np.concatenate([[0.0], np.cumsum(lengths)])
        if u.size < SPLINE_NEEDS:
            return cls(u, np.stack([np.diff(waypoints, axis=0) / lengths[:, None], waypoints[:-1]]))
        free = [(order, np.zeros(waypoints.shape[1])) for order in (3, 4)]
        spline = make_interp_spline(u, waypoints, SPLINE_DEGREE, bc_type=(free, free))  # type: ignore[arg-type]
        return cls(u, np.stack([spline(u[:-1], n) / factorial(n) for n in range(SPLINE_DEGREE, -1, -1)]))

    @classmethod
    def blended(cls, waypoints: FloatArray, tolerance: float) -> Self:
        """Straight lines between waypoints, their corners rounded by polynomials: two continuous derivatives.

        A blend is as wide as the tolerance allows, half of a line between two corners at most. It leaves its corner
        out; the first and the last waypoint are reached.

        Args:
            waypoints: (n, k), rad.
            tolerance: how far any joint may be from the lines, rad; with 0 the corners stay.

        Raises:
            InvalidProblem: as :meth:`through`, or a negative tolerance.
        """
        if not 0.0 <= tolerance < np.inf:
            raise InvalidProblem("tolerance", f"{tolerance:g} is not a number from 0 on, in rad")
        lengths = _chords(waypoints)
        ways = np.diff(waypoints, axis=0) / lengths[:, None]
        turn = np.abs(np.diff(ways, axis=0)).max(axis=1, initial=0.0)
        room = np.where(np.isin(np.arange(lengths.size), [0, lengths.size - 1]), 1.0, 0.5) * lengths
        with np.errstate(divide="ignore", invalid="ignore"):
            widest = np.where(turn > 0.0, tolerance / (BLEND_REACH * turn), 0.0)
        half = np.concatenate([[0.0], np.minimum(widest, np.minimum(room[:-1], room[1:])), [0.0]])
        pieces = []
        for i, length in enumerate(lengths):
            straight = length - half[i] - half[i + 1]
            if straight > SAME_WAYPOINT * length:
                pieces.append((straight, _line(waypoints[i] + half[i] * ways[i], ways[i])))
            if half[i + 1] > 0.0:
                pieces.append((2.0 * half[i + 1], _blend(waypoints[i + 1], ways[i], ways[i + 1], half[i + 1])))
        u = np.cumsum([0.0, *(extent for extent, _ in pieces)])
        return cls(u, np.stack([coefficients for _, coefficients in pieces], axis=1))

    @cached_property
    def curve(self) -> PPoly:
        """The piecewise polynomial."""
        return PPoly(self.coefficients, self.breakpoints)

    def at(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """Angles or a derivative of them, (n, k), at parameters (n,)."""
        return np.asarray(self.curve(u, derivative))


def _chords(waypoints: FloatArray) -> FloatArray:
    """Lengths of the lines between waypoints (n, k), (n - 1,), rad."""
    if waypoints.ndim != 2 or len(waypoints) < 2 or not waypoints.shape[1]:
        raise InvalidProblem("waypoints", "a path needs two waypoints at least")
    wrong = np.flatnonzero(~np.isfinite(waypoints).all(axis=1))
    if wrong.size:
        raise InvalidProblem("waypoints", f"number {wrong[0] + 1} has a joint angle that is no number")
    lengths = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    same = np.flatnonzero(lengths <= SAME_WAYPOINT * lengths.sum())
    if same.size:
        raise InvalidProblem("waypoints", f"numbers {same[0] + 1} and {same[0] + 2} are the same")
    return np.asarray(lengths)


def _line(start: FloatArray, way: FloatArray) -> FloatArray:
    """Coefficients (BLEND_DEGREE + 1, k) of a line."""
    return np.concatenate([np.zeros((BLEND_DEGREE - 1, start.size)), [way, start]])


def _blend(corner: FloatArray, before: FloatArray, after: FloatArray, half: float) -> FloatArray:
    """Coefficients (BLEND_DEGREE + 1, k) from one line to the next: of their slopes at its ends, without curvature.

    With w from 0 to 1: corner - half (1 - 2 w) before + half (2 w^3 - w^4) (after - before).
    """
    lowest_first = [corner - half * before, 2.0 * half * before, 0.0 * corner]
    lowest_first += [2.0 * half * (after - before), -half * (after - before)]
    return np.asarray((np.array(lowest_first) / (2.0 * half) ** np.arange(BLEND_DEGREE + 1)[:, None])[::-1])
