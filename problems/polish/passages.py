"""Places that a motion passes on its way, at any time.

A motion misses a place by its least distance from it. Along the motion itself another time makes up for a miss, so that
a place is a condition on the sideways part alone: to first order in linear programs, and to rounding, by Newton steps,
when a motion is finished.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, as_array
from problems.core import WholeRows
from problems.motions import increasing_choice
from problems.polish.deviation import Deviations
from problems.polish.settings import DEFAULT_PASSAGES, PassageSettings
from problems.robots import Robot
from problems.tasks import Place

CACHED_PLACES = 64
ROUNDING = 1e-12  # m or rad


@dataclass(frozen=True, eq=False)
class Passage:
    """A motion where it comes nearest to a place.

    Attributes:
        u: the parameter.
        missed: by how much it misses the place, in m or rad, (m,).
        slopes: of the miss by the joints, (m, k).
        along: slope of the miss by u, (m,).
    """

    u: float
    missed: FloatArray
    slopes: FloatArray
    along: FloatArray

    @cached_property
    def distance(self) -> float:
        """The distance from the place, in m or rad."""
        return float(np.linalg.norm(self.missed))

    @cached_property
    def axes(self) -> FloatArray:
        """Orthonormal rows (m, m): along the motion, then sideways, the first of these towards the place."""
        first = np.column_stack([self.along, self.missed, np.eye(self.missed.size)])
        return np.asarray(np.linalg.qr(first)[0].T)

    def allowances(self, within: float, least_sideways: float) -> FloatArray:
        """The allowed distance from the place along each axis, (m,), so that the motion is nowhere much farther.

        Toward the place all that is allowed; to other sides what that leaves of a ball.

        Args:
            within: allowed distance from the place, m or rad.
            least_sideways: share of that distance that other sides have at least.
        """
        square = max(within**2 - float(self.missed @ self.missed), (least_sideways * within) ** 2) / self.missed.size
        allowances = np.full(self.missed.size, np.sqrt(square))
        allowances[:2] = within
        return allowances


@dataclass(frozen=True, eq=False)
class Passages:
    """Places that motions pass in their order.

    Args:
        motions: that pass them.
        robot: that moves.
        places: in their order.
        price: s/m or s/rad, what a program pays for missing a place.
        settings: of rows and corrections.
    """

    motions: Deviations
    robot: Robot
    places: tuple[Place, ...]
    price: float = PassageSettings.price
    settings: PassageSettings = DEFAULT_PASSAGES

    def nearest(self, padded: FloatArray) -> list[Passage]:
        """The passages of the motion of control points (n, k) at each place, in their order."""
        u = np.concatenate([[0.0], self.motions.parameters(), [1.0]])
        theta = self.motions.postures(u).values(padded)
        at, step = u[_nearest_of(theta, self.robot, self.places)], 1.0 / (u.size - 1)
        between = np.concatenate([[0.0], (at[:-1] + at[1:]) / 2.0, [1.0]])
        near = np.column_stack([at, np.maximum(between[:-1], at - step), np.minimum(between[1:], at + step)])
        best = self._passages(near[:, 0], padded)
        for _ in range(self.settings.nearest_steps):
            u = np.array([self._stepped(one, *row[1:]) for one, row in zip(best, near.tolist(), strict=True)])
            others = self._passages(u, padded)
            nearer = [other.distance < one.distance for one, other in zip(best, others, strict=True)]
            if not any(nearer):
                break
            best = [other if is_nearer else one for one, other, is_nearer in zip(best, others, nearer, strict=True)]
        return best

    @staticmethod
    def _stepped(passage: Passage, low: float, high: float) -> float:
        """The parameter of a Newton step from a passage towards its place, between two."""
        slope = float(passage.along @ passage.along)
        step = passage.missed @ passage.along / slope if slope else 0.0
        return float(np.clip(passage.u - step, low, high))

    @cached_property
    def _missed(self) -> ca.Function:
        """The function from a posture for each place, (k, places), to all misses, and to all their slopes."""
        theta = ca.MX.sym("theta", self.robot.dof, len(self.places))
        parts = [_missed(self.robot, place)(theta[:, i]) for i, place in enumerate(self.places)]
        return ca.Function("missed", [theta], [ca.vertcat(*column) for column in zip(*parts, strict=True)])

    @cached_property
    def _splits(self) -> NDArray[np.intp]:
        """The numbers of the first entries of misses among all, but for the first place, (places - 1,)."""
        return np.asarray(np.cumsum([_missed(self.robot, place).numel_out(0) for place in self.places])[:-1])

    def _passages(self, u: FloatArray, padded: FloatArray) -> list[Passage]:
        """The motion at a parameter for each place, (places,)."""
        theta, rates = (self.motions.postures(u, order).values(padded) for order in range(2))
        missed, slopes = (as_array(part).ravel() for part in self._missed(theta.T))
        split, wide = self._splits, self._splits * self.robot.dof
        parts = zip(u.tolist(), np.split(missed, split), np.split(slopes, wide), rates, strict=True)
        found = []
        for at, away, flat, rate in parts:
            by_joints = flat.reshape(away.size, rate.size, order="F")
            found.append(Passage(at, away, by_joints, by_joints @ rate))
        return found

    def missing(self, passages: Sequence[Passage]) -> float:
        """The sum of the misses of all places along their axes, as programs count them, m and rad."""
        return sum(
            float(np.maximum(np.abs(one.axes @ one.missed) - place.within, 0.0).sum())
            for one, place in zip(passages, self.places, strict=True)
        )

    def rows(self, passages: Sequence[Passage]) -> WholeRows:
        """Rows that keep the motion near the places, on both sides of each axis."""
        first, by_points, bounds = [], [], []
        for one, place in zip(passages, self.places, strict=True):
            weights, piece = self.motions.spline.weights(np.array([one.u]), 0)
            slopes, values = one.axes @ one.slopes, one.axes @ one.missed
            most = one.allowances(place.within, self.settings.least_sideways)
            most[0] += self.settings.most_later * float(np.linalg.norm(one.along))
            for sign in (1.0, -1.0):
                by_points.append(sign * weights[0][None, :, None] * slopes[:, None, :])
                bounds.append(most - sign * values)
                first.append(np.full(most.size, piece[0] - self.motions.fixed))
        bound = np.concatenate(bounds)
        return WholeRows(
            np.concatenate(first), np.concatenate(by_points), np.zeros(bound.size), bound,
            np.full(bound.size, self.price),
        )  # fmt: skip

    def left(self, rows: WholeRows, changed: FloatArray) -> float:
        """The sum of the misses that a change of all control points (n, k) leaves, to first order, m and rad."""
        return float(np.maximum(rows.moved(changed, self.motions.fixed) - rows.bound, 0.0).sum())

    def exact(self, x: FloatArray, duration: float | None = None) -> FloatArray | None:
        """Free control points near some (free, k) whose motion passes all places; None where none are found.

        A place that may be missed is passed as near as it has to be. Between moving ends the motion has one duration,
        s; the direct motion's where None.
        """
        inner = self.settings.inner_share
        for _ in range(self.settings.exact_steps):
            passages = self.nearest(self.motions.padded(x, duration))
            missing = [
                one.missed * max(0.0, 1.0 - inner * place.within / max(float(np.linalg.norm(one.missed)), ROUNDING))
                for one, place in zip(passages, self.places, strict=True)
            ]
            if max(float(np.linalg.norm(each)) for each in missing) < ROUNDING:
                return x
            rows = [self._by_control_points(one) for one in passages]
            matrix, wanted = np.concatenate(rows), np.concatenate(missing)
            x = x - np.linalg.lstsq(matrix, wanted, rcond=None)[0].reshape(x.shape)
        return None

    def _by_control_points(self, passage: Passage) -> FloatArray:
        """Slopes of the miss by the free control points, (m, free k)."""
        weights, piece = self.motions.spline.weights(np.array([passage.u]), 0)
        slopes = np.zeros((passage.missed.size, self.motions.free + 2 * self.motions.fixed, self.motions.dof))
        slopes[:, piece[0] : piece[0] + weights.shape[1]] = weights[0][None, :, None] * passage.slopes[:, None, :]
        return np.asarray(slopes[:, self.motions.fixed : -self.motions.fixed].reshape(passage.missed.size, -1))


def postures_on_the_way(
    robot: Robot,
    places: Sequence[Place],
    usual: FloatArray,
    start: FloatArray,
    goal: FloatArray,
    settings: PassageSettings = DEFAULT_PASSAGES,
) -> list[FloatArray]:
    """Postures at places that paths may lead through: those near the straight line of the joints, then usual ones.

    Args:
        robot: that moves.
        places: in their order; there may be none.
        usual: a posture at each, (places, k), rad.
        start: (k,), rad.
        goal: (k,), rad.
        settings: of the comparison.
    """
    if not places:
        return [usual]
    line = start + np.linspace(0.0, 1.0, settings.line_postures)[:, None] * (goal - start)
    nearest = _nearest_of(line, robot, places)
    postures = [place.near(robot, line[index]) for place, index in zip(places, nearest, strict=True)]
    near = np.array([theta for theta, _ in postures])
    return [usual] if not all(there for _, there in postures) or (near == usual).all() else [near, usual]


def _nearest_of(theta: FloatArray, robot: Robot, places: Sequence[Place]) -> list[int]:
    """Numbers of the postures (n, k) on a path that come nearest to places, in their order."""
    missed = [as_array(_missed(robot, place)(theta.T)[0]) for place in places]
    return increasing_choice(np.array([np.square(each).sum(axis=0) for each in missed]))


@lru_cache(maxsize=CACHED_PLACES)
def _missed(robot: Robot, place: Place) -> ca.Function:
    """The function from a posture (k, 1) to its miss of a place, (m, 1), and the slopes of the miss, (m k, 1)."""
    theta = ca.SX.sym("theta", robot.dof)
    missed = ca.densify(ca.SX(place.miss(robot, theta.T))).T
    slopes = ca.vec(ca.densify(ca.jacobian(missed, theta)))
    return ca.Function("missed", [theta], [missed, slopes], {"cse": True})
