"""A robot and its surroundings by the formulas of pairs: links that are lines, and shapes that users make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.certify import ClearanceProof, prove_clearance
from problems.core import CONNECT, Nearby, PathSearch, Proof, Schedule, Separation, World, found_core, pace_of
from problems.evaluation import RowFunction
from problems.limits import BodyPair, CollisionPair, Limit, Pair, Proximity, clearances
from problems.motions import Trajectory
from problems.robots import Robot

ROWS = 32  # postures that are computed at once


@dataclass(frozen=True)
class PairWorld(World):
    """A robot among obstacles, by the formulas of pairs of bodies and obstacles.

    Args:
        robot: with its margin.
        limits: on the pairs that have to keep a distance.
    """

    robot: Robot
    limits: tuple[Proximity, ...]

    @classmethod
    def of(cls, robot: Robot, limits: Sequence[Limit]) -> PairWorld:
        """The world of the limits on distances among some."""
        return cls(robot, tuple(limit for limit in limits if isinstance(limit, Proximity)))

    @property
    def dof(self) -> int:
        return self.robot.dof

    @property
    def margins(self) -> dict[Separation, float]:
        return dict.fromkeys((Separation.FROM_OBSTACLES, Separation.FROM_EACH_OTHER), float(self.robot.margin))

    @cached_property
    def fastest(self) -> float:
        """The largest pace at which an obstacle comes nearer, m/s."""
        around = float(self.robot.reach()[1] + np.linalg.norm(self.robot.base))
        moving = (pair.obstacle for pair in self._pairs if isinstance(pair, CollisionPair) and pair.is_time_dependent)
        return max((pace_of(obstacle, around) for obstacle in moving), default=0.0)

    @cached_property
    def _pairs(self) -> tuple[Pair, ...]:
        return tuple(pair for limit in self.limits for pair in limit.pairs)

    @cached_property
    def _is_own(self) -> NDArray[np.bool_]:
        """Whether a pair is of two bodies of the robot, (pairs,)."""
        return np.array([isinstance(pair, BodyPair) for pair in self._pairs], dtype=bool)

    @cached_property
    def _state(self) -> ca.SX:
        """A posture and the time, (dof + 1,)."""
        return ca.SX.sym("state", self.dof + 1)

    @cached_property
    def _symbolic_margins(self) -> ca.SX:
        """The clearance margins of all pairs, (pairs, 1), m."""
        if not self._pairs:
            return ca.SX(0, 1)
        positions = self.robot.positions(self._state[:-1].T)
        return ca.densify(clearances(self._pairs, positions, self._state[-1]).T) - float(self.robot.margin)

    @cached_property
    def _margins(self) -> RowFunction:
        return RowFunction(ca.Function("margins", [self._state], [self._symbolic_margins], {"cse": True}), ROWS)

    @cached_property
    def _slopes(self) -> RowFunction:
        """The function from a posture and a time to the slopes of all margins by both, (pairs * (dof + 1),)."""
        slopes = ca.densify(ca.vec(ca.jacobian(self._symbolic_margins, self._state).T))
        return RowFunction(ca.Function("slopes", [self._state], [slopes], {"cse": True}), ROWS)

    @cached_property
    def moves(self) -> bool:
        return any(pair.is_time_dependent for pair in self._pairs)

    @cached_property
    def still(self) -> PairWorld:
        """The world of the pairs that do not depend on the time; this world where none does."""
        parts = [limit.time_independent_part for limit in self.limits] if self.moves else list(self.limits)
        return PairWorld(self.robot, tuple(part for part in parts if part is not None)) if self.moves else self

    @property
    def is_exact(self) -> bool:
        """Whether joints are off by as much at any speed: always, as pairs keep the largest error."""
        return True

    def errors(self, speed: FloatArray, acceleration: FloatArray) -> None:
        """No errors of joints besides those that pairs keep."""

    def clearance_margins(
        self,
        theta: FloatArray,
        most: float = np.inf,
        which: Separation = Separation.ALL,
        times: FloatArray | None = None,
        errors: FloatArray | None = None,
    ) -> FloatArray:
        wanted = np.where(self._is_own, Separation.FROM_EACH_OTHER, Separation.FROM_OBSTACLES) & which > 0
        return np.asarray(self._at(theta, times)[wanted].min(axis=0, initial=most))

    def _at(self, theta: FloatArray, times: FloatArray | None) -> FloatArray:
        """The clearance margins of all pairs in postures (n, dof) at times (n,), (pairs, n), m."""
        return self._margins(self._states(theta, times))

    def _states(self, theta: FloatArray, times: FloatArray | None) -> FloatArray:
        return np.vstack([theta.T, np.zeros(len(theta)) if times is None else times])

    def clear(self, theta: FloatArray, extra_margin: float = 0.0, times: FloatArray | None = None) -> NDArray[np.bool_]:
        return np.asarray((self._at(theta, times) >= extra_margin).all(axis=0))

    def nearby(
        self, theta: FloatArray, below: float, times: FloatArray | None = None, errors: FloatArray | None = None
    ) -> Nearby:
        """All pairs with smaller clearance margins in postures."""
        margins, states = self._at(theta, times), self._states(theta, times)
        pairs, samples = np.nonzero(margins < below)
        used, columns = np.unique(samples, return_inverse=True)
        slopes = self._slopes(states[:, used]).reshape(len(self._pairs), self.dof + 1, used.size)[pairs, :, columns]
        return Nearby(
            samples.astype(np.int32), self._is_own[pairs], margins[pairs, samples], slopes[:, -1], slopes[:, :-1]
        )

    def prove(self, trajectory: Trajectory) -> Proof:
        """Bound the clearance margin of a motion for all t."""
        proofs = [prove_clearance(limit, trajectory, tell_broken=False) for limit in self.limits]
        return _least([proof for proof in proofs if proof is not None], float(self.robot.margin))

    def connect(
        self,
        start: FloatArray,
        goal: FloatArray,
        box: FloatArray,
        seed: int,
        *,
        schedule: Schedule | None = None,
    ) -> FloatArray | None:
        settings = CONNECT
        slopes = None if schedule is None else schedule.numbers

        def clear(begin: FloatArray, end: FloatArray) -> bool:
            count = max(1, int(np.ceil(np.abs(end - begin).max() / settings.edge_step)))
            theta = begin + (np.arange(1, count + 1) / count)[:, None] * (end - begin)
            times = None
            if slopes is not None:
                offset, first, last = slopes[-3:]
                times = np.clip(offset + theta @ slopes[:-3], first, last)
            return bool(self.clear(theta, times=times).all())

        search = PathSearch(
            box, settings.edge_step, 0.0, settings.longest_edge, settings.extensions, settings.shortcuts, seed
        )
        core = found_core()
        path = None if core is None else core.connect_asking(start, goal, search, clear)
        return path if path is not None and len(path) else None


def _least(proofs: Sequence[ClearanceProof], margin: float) -> Proof:
    """The proofs of several limits as one about the clearance margin."""
    proven = min((proof.proven - margin for proof in proofs), default=np.inf)
    least = min(proofs, key=lambda proof: proof.smallest, default=None)
    status = None if proven == -np.inf else True
    if least is None:
        return Proof(status, proven, np.inf, 0.0, None)
    return Proof(False if least.smallest < margin else status, proven, least.smallest - margin, least.time, None)
