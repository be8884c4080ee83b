"""Places that a motion passes on its way, whenever it likes.

A motion misses a place by what it is away from it where it comes nearest. Along the motion itself that is made up for
by another time, so that a place is a condition on what is sideways alone: to first order, in linear programs; and
undone to rounding, by Newton steps, where a motion is finished.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from problems.base import FloatArray, as_array
from problems.core import WholeRows
from problems.motions import increasing_choice
from problems.polish.deviation import Deviations
from problems.polish.spline import AT_REST
from problems.robots import Robot
from problems.tasks import Place

KEPT = 64  # places
LOOKS = 101  # at a straight line of the joints
LATER = 0.02  # of the duration: so much a step may change when a place is passed
LEAST_ROOM = 0.3  # of what a place may be missed by: so much, at least, to sides to which it is not
NEWTON = 8  # steps to where a motion comes nearest
INSIDE = 1.0 - 1e-6  # of what a place may be missed by: what is kept
STEPS, THERE = 30, 1e-12  # of the last correction; m or rad
PASSAGE_PRICE = 30.0  # s/m or s/rad


@dataclass(frozen=True, eq=False)
class Passage:
    """A motion where it comes nearest to a place.

    Attributes:
        u: the parameter.
        missed: by how much it misses the place, in m or rad, (m,).
        slopes: how that changes with the joints, (m, k).
        along: and with u, (m,).
    """

    u: float
    missed: FloatArray
    slopes: FloatArray
    along: FloatArray

    @cached_property
    def axes(self) -> FloatArray:
        """Orthonormal rows (m, m): along the motion, and sideways, the first of these towards the place."""
        first = np.column_stack([self.along, self.missed, np.eye(self.missed.size)])
        return np.asarray(np.linalg.qr(first)[0].T)

    def room(self, within: float) -> FloatArray:
        """How far the motion may be from the place along each axis, (m,), so that it is nowhere much farther from it.

        Toward the place all that is allowed; to other sides what that leaves of a ball.
        """
        beside = max(within**2 - float(self.missed @ self.missed), (LEAST_ROOM * within) ** 2) / self.missed.size
        room = np.full(self.missed.size, np.sqrt(beside))
        room[:2] = within
        return room


@dataclass(frozen=True, eq=False)
class Passages:
    """Places on the way.

    Args:
        motions: that pass them.
        robot: that moves.
        places: in their order.
        price: s/m or s/rad: what a program pays for what is missed.
    """

    motions: Deviations
    robot: Robot
    places: tuple[Place, ...]
    price: float = PASSAGE_PRICE

    def nearest(self, padded: FloatArray) -> list[Passage]:
        """Where the motion of control points (n, k) comes nearest to each place, in their order."""
        u = np.concatenate([[0.0], self.motions.parameters(), [1.0]])
        theta = self.motions.postures(u).values(padded)
        at, step = u[_nearest_of(theta, self.robot, self.places)], 1.0 / (u.size - 1)
        between = np.concatenate([[0.0], (at[:-1] + at[1:]) / 2.0, [1.0]])
        near = np.column_stack([at, np.maximum(between[:-1], at - step), np.minimum(between[1:], at + step)])
        return [self._refined(padded, place, *row) for place, row in zip(self.places, near.tolist(), strict=True)]

    def _refined(self, padded: FloatArray, place: Place, u: float, low: float, high: float) -> Passage:
        best = self._passage(place, u, padded)
        for _ in range(NEWTON):
            slope = float(best.along @ best.along)
            if slope == 0.0:
                break
            u = float(np.clip(best.u - best.missed @ best.along / slope, low, high))
            other = self._passage(place, u, padded)
            if not np.linalg.norm(other.missed) < np.linalg.norm(best.missed):
                break
            best = other
        return best

    def _passage(self, place: Place, u: float, padded: FloatArray) -> Passage:
        at = np.array([u])
        theta, rate = (self.motions.postures(at, order).values(padded)[0] for order in range(2))
        missed, slopes = (as_array(part) for part in _missed(self.robot, place)(theta))
        slopes = slopes.reshape(missed.size, theta.size, order="F")
        return Passage(u, missed.ravel(), slopes, slopes @ rate)

    def missing(self, passages: Sequence[Passage]) -> float:
        """By how much places are missed, together, m and rad: in programs' terms, of each axis."""
        return sum(
            float(np.maximum(np.abs(one.axes @ one.missed) - place.within, 0.0).sum())
            for one, place in zip(passages, self.places, strict=True)
        )

    def rows(self, passages: Sequence[Passage]) -> WholeRows:
        """What control points keep of the places: on both sides of each axis."""
        first, by_points, bounds = [], [], []
        for one, place in zip(passages, self.places, strict=True):
            own, piece = self.motions.spline.weights(np.array([one.u]), 0)
            slopes, values = one.axes @ one.slopes, one.axes @ one.missed
            most = one.room(place.within)
            most[0] += LATER * float(np.linalg.norm(one.along))
            for sign in (1.0, -1.0):
                by_points.append(sign * own[0][None, :, None] * slopes[:, None, :])
                bounds.append(most - sign * values)
                first.append(np.full(most.size, piece[0] - AT_REST))
        bound = np.concatenate(bounds)
        return WholeRows(
            np.concatenate(first), np.concatenate(by_points), np.zeros(bound.size), bound,
            np.full(bound.size, self.price),
        )  # fmt: skip

    def left(self, rows: WholeRows, changed: FloatArray) -> float:
        """What a change of all control points (n, k) leaves of what is missed, to first order, m and rad."""
        points = changed[rows.first[:, None] + AT_REST + np.arange(rows.weights.shape[1])]
        return float(np.maximum(np.einsum("mak,mak->m", rows.weights, points) - rows.bound, 0.0).sum())

    def exact(self, x: FloatArray, duration: float | None = None) -> FloatArray | None:
        """Free control points near some (free, k) whose motion passes all places; None where none are found.

        Of one that may be missed, as near as it has to be. Between moving ends that is a motion of one duration, s; the
        direct motion's where None.
        """
        for _ in range(STEPS):
            passages = self.nearest(self.motions.padded(x, duration))
            missing = [
                one.missed * max(0.0, 1.0 - INSIDE * place.within / max(float(np.linalg.norm(one.missed)), THERE))
                for one, place in zip(passages, self.places, strict=True)
            ]
            if max(float(np.linalg.norm(each)) for each in missing) < THERE:
                return x
            rows = [self._by_control_points(one) for one in passages]
            matrix, wanted = np.concatenate(rows), np.concatenate(missing)
            x = x - np.linalg.lstsq(matrix, wanted, rcond=None)[0].reshape(x.shape)
        return None

    def _by_control_points(self, passage: Passage) -> FloatArray:
        """How what is missed changes with the free control points, (m, free k)."""
        own, piece = self.motions.spline.weights(np.array([passage.u]), 0)
        found = np.zeros((passage.missed.size, self.motions.free + 2 * AT_REST, self.motions.dof))
        found[:, piece[0] : piece[0] + own.shape[1]] = own[0][None, :, None] * passage.slopes[:, None, :]
        return np.asarray(found[:, AT_REST:-AT_REST].reshape(passage.missed.size, -1))


def postures_on_the_way(
    robot: Robot, places: Sequence[Place], usual: FloatArray, start: FloatArray, goal: FloatArray
) -> list[FloatArray]:
    """What ways may lead through: at each place the posture near the straight line from start to goal; the usual ones.

    Args:
        robot: that moves.
        places: in their order; there may be none.
        usual: a posture at each, (places, k), rad.
        start: (k,), rad.
        goal: likewise.
    """
    if not places:
        return [usual]
    line = start + np.linspace(0.0, 1.0, LOOKS)[:, None] * (goal - start)
    nearest = _nearest_of(line, robot, places)
    found = [place.near(robot, line[index]) for place, index in zip(places, nearest, strict=True)]
    near = np.array([theta for theta, _ in found])
    return [usual] if not all(there for _, there in found) or (near == usual).all() else [near, usual]


def _nearest_of(theta: FloatArray, robot: Robot, places: Sequence[Place]) -> list[int]:
    """Numbers of the postures (n, k) on a way that come nearest to places, in their order."""
    missed = [as_array(_missed(robot, place)(theta.T)[0]) for place in places]
    return increasing_choice(np.array([np.square(each).sum(axis=0) for each in missed]))


@lru_cache(maxsize=KEPT)
def _missed(robot: Robot, place: Place) -> ca.Function:
    """From a posture (k, 1) to what it misses a place by, (m, 1), and how that changes with the joints, (m k, 1)."""
    theta = ca.SX.sym("theta", robot.dof)
    missed = ca.densify(ca.SX(place.miss(robot, theta.T))).T
    slopes = ca.vec(ca.densify(ca.jacobian(missed, theta)))
    return ca.Function("missed", [theta], [missed, slopes], {"cse": True})
