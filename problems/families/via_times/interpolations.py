"""Interpolations of the literature through postures: what interval times make of velocities and accelerations.

[1] C.-S. Lin, P.-R. Chang, J. Luh, "Formulation and optimization of cubic polynomial joint trajectories for
    industrial robots", IEEE Trans. Automatic Control 28, 1983, 1066-1074, doi 10.1109/TAC.1983.1103181
[2] L. Biagiotti, C. Melchiorri, "Trajectory planning for automatic machines and robots", Springer 2008

All pieces are polynomials of degree 5 or less, so that the states where they meet say everything.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import pairwise
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix
from problems.families.via_times.motion import NodeStates
from problems.motions import QUINTIC_HERMITE, powers_at

VIRTUAL = 2  # knots of Lin's splines whose angles are not given


class Interpolation(ABC):
    """A rule that makes a motion from rest to rest of postures and interval times.

    Attributes:
        name: as in a scenario file.
        vias: how many postures on the way it passes; any number where None.
    """

    name: ClassVar[str]
    vias: ClassVar[int | None] = None

    def intervals(self, postures: int) -> int:
        """The number of intervals; from posture to posture by default."""
        return postures - 1

    def segment_of(self, postures: int) -> list[int]:
        """The number of the segment, from posture to posture, to which each interval belongs."""
        return list(range(postures - 1))

    @abstractmethod
    def states(self, postures: Matrix, times: Sequence[Matrix]) -> NodeStates:
        """The states where intervals meet.

        Args:
            postures: both ends included, (n, k), rad.
            times: of the intervals, scalars, s.
        """


class CubicSpline(Interpolation):
    """Cubic splines at rest without acceleration at both ends, by two knots whose angles are free [1].

    They are the second and the last but one. All accelerations are continuous; jerks are constant in each interval.
    """

    name: ClassVar[str] = "cubic"

    def intervals(self, postures: int) -> int:
        return postures - 1 + VIRTUAL

    def segment_of(self, postures: int) -> list[int]:
        return [0, *range(postures - 1), postures - 2]

    def states(self, postures: Matrix, times: Sequence[Matrix]) -> NodeStates:
        """The spline with the accelerations that solve (12) of [1].

        A virtual knot lies where the first interval leads, ``h^2 / 6`` of its acceleration from the end.
        """
        last, rows = len(times), [postures[i, :] for i in range(postures.shape[0])]
        known = [rows[0], rows[0], *rows[1:-1], rows[-1], rows[-1]]
        free: list[Matrix] = [ca.DM(0.0)] * (last + 1)
        free[1], free[-2] = times[0] ** 2 / 6.0, times[-1] ** 2 / 6.0
        slopes = [(after - before) / h for (before, after), h in zip(pairwise(known), times, strict=True)]
        bands, right = [], []
        for i in range(1, last):
            before, after = times[i - 1], times[i]
            diagonal = 2.0 * (before + after) + 6.0 * free[i] * (1.0 / before + 1.0 / after)
            bands.append([before - 6.0 * free[i - 1] / before, diagonal, after - 6.0 * free[i + 1] / after])
            right.append(6.0 * (slopes[i] - slopes[i - 1]))
        rest = ca.DM.zeros(1, postures.shape[1])
        bends = [rest, *solved_banded(bands, right), rest]
        angles = [angle + share * bend for angle, share, bend in zip(known, free, bends, strict=True)]
        speeds = [
            (angles[i + 1] - angles[i]) / h - h * (2.0 * bends[i] + bends[i + 1]) / 6.0 for i, h in enumerate(times)
        ]
        speeds[0] = rest
        return NodeStates.joined(angles, [*speeds, rest], bends, times)


class QuinticSpline(Interpolation):
    """Splines of degree 5 with four continuous derivatives, at rest without acceleration at both ends.

    They are the B-splines of degree 5 with the via points as knots, and of all motions through these points at these
    times with these ends those of the least integral of the squared jerk.
    """

    name: ClassVar[str] = "b-spline"

    def states(self, postures: Matrix, times: Sequence[Matrix]) -> NodeStates:
        """The spline whose velocities and accelerations make jerk and snap continuous.

        The rows are the derivatives of the integral of the squared jerk, so that their matrix is positive definite.
        """
        rows, inner = [postures[i, :] for i in range(postures.shape[0])], range(1, len(times))
        bands, right = [], []
        for i in inner:
            before, after = times[i - 1], times[i]
            gaps = rows[i] - rows[i - 1], rows[i + 1] - rows[i]
            for order, sign in ((4, -1.0), (3, 1.0)):
                ends = [END_DERIVATIVES[order, end] for end in (1, 0)]  # at the end of the one, the start of the other
                left, middle, far = [], [], []
                for column in (1, 2):
                    power = column - order
                    left.append(ends[0][column] * before**power)
                    middle.append(ends[0][column + 3] * before**power - ends[1][column] * after**power)
                    far.append(-ends[1][column + 3] * after**power)
                shift = 0 if order == 4 else 1
                row: list[Matrix] = [*left, *middle, *far]
                padded = [ca.DM(0.0)] * (1 - shift) + row + [ca.DM(0.0)] * shift
                bands.append([sign * each for each in padded])
                known = -ends[0][3] * gaps[0] * before**-order + ends[1][3] * gaps[1] * after**-order
                right.append(sign * known)
        found = solved_banded(bands, right)
        rest = ca.DM.zeros(1, postures.shape[1])
        return NodeStates.joined(rows, [rest, *found[::2], rest], [rest, *found[1::2], rest], times)


class ComputedVelocities(Interpolation):
    """Quintics from posture to posture without acceleration there, and with velocities by a rule [2].

    A joint has the mean of its mean velocities before and after a posture, and stands still where it turns back.
    """

    name: ClassVar[str] = "quintic"

    def states(self, postures: Matrix, times: Sequence[Matrix]) -> NodeStates:
        rows, rest = [postures[i, :] for i in range(postures.shape[0])], ca.DM.zeros(1, postures.shape[1])
        slopes = [(after - before) / h for (before, after), h in zip(pairwise(rows), times, strict=True)]
        means = [ca.if_else(one * other > 0.0, (one + other) / 2.0, 0.0) for one, other in pairwise(slopes)]
        return NodeStates.joined(rows, [rest, *means, rest], [rest] * len(rows), times)


class Polynomials353(Interpolation):
    """A cubic, a quintic and a cubic: past two postures, with continuous velocities and accelerations."""

    name: ClassVar[str] = "3-5-3"
    vias: ClassVar[int | None] = 2

    def states(self, postures: Matrix, times: Sequence[Matrix]) -> NodeStates:
        """The states of cubics at rest at one end, which are a distance times the cubed share of the time."""
        rows, rest = [postures[i, :] for i in range(postures.shape[0])], ca.DM.zeros(1, postures.shape[1])
        first, last = rows[1] - rows[0], rows[3] - rows[2]
        speeds = [rest, 3.0 * first / times[0], 3.0 * last / times[2], rest]
        bends = [rest, 6.0 * first / times[0] ** 2, -6.0 * last / times[2] ** 2, rest]
        return NodeStates.joined(rows, speeds, bends, times)


INTERPOLATIONS: dict[str, Interpolation] = {
    rule.name: rule for rule in (CubicSpline(), QuinticSpline(), ComputedVelocities(), Polynomials353())
}

# Of the columns of ``QUINTIC_HERMITE``: derivative 3 or 4 by tau at the start (0) or the end (1).
END_DERIVATIVES: dict[tuple[int, int], FloatArray] = {
    (order, end): (powers_at(6, np.array([float(end)]), order) @ QUINTIC_HERMITE)[0]
    for order in (3, 4)
    for end in (0, 1)
}


def solved_banded(bands: Sequence[Sequence[Matrix]], right: Sequence[Matrix]) -> list[Matrix]:
    """The solution of a banded system by elimination without pivots, for a matrix that needs none.

    Args:
        bands: of each row the entries around the diagonal, an odd number; those outside the matrix are not looked at.
        right: of each row the right-hand side, (1, k).
    """
    rows, reach = [list(row) for row in bands], len(bands[0]) // 2 if bands else 0
    found = list(right)
    for i in range(len(rows)):
        for j in range(i + 1, min(i + reach + 1, len(rows))):
            factor = rows[j][reach + i - j] / rows[i][reach]
            for column in range(i + 1, min(i + reach + 1, len(rows))):
                rows[j][reach + column - j] = rows[j][reach + column - j] - factor * rows[i][reach + column - i]
            found[j] = found[j] - factor * found[i]
    for i in range(len(rows) - 1, -1, -1):
        for j in range(i + 1, min(i + reach + 1, len(rows))):
            found[i] = found[i] - rows[i][reach + j - i] * found[j]
        found[i] = found[i] / rows[i][reach]
    return found
