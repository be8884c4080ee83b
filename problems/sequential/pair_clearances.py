"""Pairs of bodies that come near, as linear rows about a motion.

Only pairs with an obstacle that moves depend on the time; it is not used for the others.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix, as_array
from problems.limits import BodyPair, Pair, Proximity
from problems.robots import Robot

COARSE = 4  # samples from one at which all pairs are computed to the next


@dataclass(frozen=True)
class NearPairs:
    """Pairs of bodies that are near each other at samples.

    Attributes:
        samples: indices, (m,).
        pairs: numbers, (m,).
        clearances: (m,), m.
    """

    samples: NDArray[np.intp]
    pairs: NDArray[np.intp]
    clearances: FloatArray

    def thinned(self, every: int) -> NearPairs:
        """The pairs at every so many samples, and wherever a pair is nearest for a while."""
        order = np.lexsort((self.samples, self.pairs))
        samples, pairs, values = self.samples[order], self.pairs[order], self.clearances[order]
        next_to_it = (np.diff(pairs) == 0) & (np.diff(samples) == 1)
        falls = np.append(True, ~next_to_it | (np.diff(values) <= 0.0))[: values.size]
        rises = np.append(~next_to_it | (np.diff(values) >= 0.0), True)[: values.size]
        chosen = (samples % every == 0) | (falls & rises)
        return NearPairs(samples[chosen], pairs[chosen], values[chosen])


@dataclass(frozen=True)
class _Group:
    """Pairs that are computed alike: their numbers, the frames of their ends (pairs, ends), the distance.

    Distance and gradient are functions of the ends, and, of pairs that depend on it, of the time.
    """

    numbers: NDArray[np.intp]
    frames: NDArray[np.intp]
    is_time_dependent: bool
    distance: ca.Function
    gradient: ca.Function

    def at(
        self,
        function: ca.Function,
        positions: FloatArray,
        times: FloatArray,
        samples: NDArray[np.intp],
        columns: NDArray[np.intp],
    ) -> FloatArray:
        """The values of a function of the group at samples (m,), of pairs in columns (m,)."""
        if not samples.size:
            return np.empty((0, function.size1_out(0)))
        inputs = positions[samples[:, None], self.frames[columns]].reshape(samples.size, -1).T
        return as_array(function(np.vstack([inputs, times[samples]]) if self.is_time_dependent else inputs)).T


@dataclass(frozen=True)
class PairClearances:
    """The clearances of a robot, from obstacles and between its own bodies.

    Args:
        robot: that moves.
        limits: of these clearances.
        own_share: share of the proof margin that pairs of its own bodies keep.
    """

    robot: Robot
    limits: tuple[Proximity, ...]
    own_share: float = 1.0

    @cached_property
    def pairs(self) -> list[Pair]:
        """The pairs of bodies and obstacles whose distance some clearance limit bounds."""
        return [pair for limit in self.limits for pair in limit.pairs]

    @cached_property
    def _thickness(self) -> FloatArray:
        return np.array([float(pair.thickness) for pair in self.pairs])

    @cached_property
    def margin_shares(self) -> FloatArray:
        """The shares of the proof margin that pairs keep, (pairs,)."""
        return np.array([self.own_share if isinstance(pair, BodyPair) else 1.0 for pair in self.pairs])

    @cached_property
    def _groups(self) -> list[_Group]:
        members: dict[Hashable, list[int]] = {}
        for number, pair in enumerate(self.pairs):
            members.setdefault(pair.group, []).append(number)
        return [self._group(np.array(numbers)) for numbers in members.values()]

    def _group(self, numbers: NDArray[np.intp]) -> _Group:
        frames = np.array([self.pairs[number].frames for number in numbers])
        pair, ends = self.pairs[numbers[0]], ca.SX.sym("ends", self.robot.dim, frames.shape[1])
        time = ca.SX.sym("time") if pair.is_time_dependent else None
        distance = pair.between(*(end.T for end in ca.horzsplit(ends)), times=time)
        inputs = ca.vec(ends) if time is None else ca.vertcat(ca.vec(ends), time)
        gradient = ca.gradient(distance, inputs)
        return _Group(
            numbers,
            frames,
            pair.is_time_dependent,
            ca.Function("distance", [inputs], [ca.densify(distance)], {"cse": True}),
            ca.Function("gradient", [inputs], [ca.densify(gradient)], {"cse": True}),
        )

    @cached_property
    def _frames(self) -> list[Matrix]:
        return [point.T for point in self.robot.positions(self._theta.T)]

    @cached_property
    def _theta(self) -> ca.SX:
        return ca.SX.sym("theta", self.robot.dof)

    @cached_property
    def _positions(self) -> ca.Function:
        return ca.Function("positions", [self._theta], [ca.densify(ca.vertcat(*self._frames))], {"cse": True})

    @cached_property
    def _jacobian(self) -> ca.Function:
        jacobian = ca.jacobian(ca.vertcat(*self._frames), self._theta)
        return ca.Function("jacobian", [self._theta], [ca.densify(ca.vec(jacobian.T))], {"cse": True})

    def positions(self, theta: FloatArray) -> FloatArray:
        """Positions of all frames in postures (n, k): (n, frames, dim), m."""
        values = as_array(self._positions(theta.T)).T
        return values.reshape(len(theta), len(self._frames), self.robot.dim)

    @cached_property
    def is_time_dependent(self) -> bool:
        """Whether it matters at which times: an obstacle moves."""
        return any(pair.is_time_dependent for pair in self.pairs)

    @property
    def standing(self) -> PairClearances:
        """The clearances of the pairs alone that do not move by themselves."""
        pairs = [tuple(pair for pair in limit.pairs if not pair.is_time_dependent) for limit in self.limits]
        return replace(self, limits=tuple(replace(one, pairs=p) for one, p in zip(self.limits, pairs, strict=True)))

    def near(self, theta: FloatArray, times: FloatArray, cutoff: float) -> NearPairs:
        """All pairs nearer than a cutoff, m, at samples (n, k) of a motion, at times (n,), s.

        No pair comes nearer from one sample to another than its ends and obstacles move: a pair that is far at every
        ``COARSE``-th sample is not computed in between.
        """
        if not self.pairs:
            none = np.empty(0, dtype=np.intp)
            return NearPairs(none, none, np.empty(0))
        positions, count = self.positions(theta), len(theta)
        nearest = np.minimum((np.arange(count) + COARSE // 2) // COARSE * COARSE, (count - 1) // COARSE * COARSE)
        moved = np.linalg.norm(positions - positions[nearest], axis=2)
        apart = np.abs(times - times[nearest])
        around = np.stack([times[nearest] - apart, times[nearest] + apart], axis=1)
        parts: list[tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]] = []
        for group in self._groups:
            coarse = self._distances(group, positions[::COARSE], times[::COARSE])
            low = coarse[nearest // COARSE] - moved[:, group.frames].sum(axis=2)
            if group.is_time_dependent:
                low -= self.pairs[group.numbers[0]].link_travel(self.robot, around)[:, None]
            samples, columns = np.nonzero(low < cutoff)
            distances = group.at(group.distance, positions, times, samples, columns)[:, 0]
            distances = distances - self._thickness[group.numbers[columns]]
            near = distances < cutoff
            parts.append((samples[near], group.numbers[columns[near]], distances[near]))
        return NearPairs(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    def _distances(self, group: _Group, positions: FloatArray, times: FloatArray) -> FloatArray:
        rows, columns = np.divmod(np.arange(len(positions) * len(group.numbers)), len(group.numbers))
        values = group.at(group.distance, positions, times, rows, columns).reshape(len(positions), -1)
        return values - self._thickness[group.numbers]

    def gradients(self, theta: FloatArray, times: FloatArray, near: NearPairs) -> tuple[FloatArray, FloatArray]:
        """How clearances change with the joints, (m, k), m/rad, and with the time alone, (m,), m/s."""
        by_joints, by_time = np.empty((near.samples.size, self.robot.dof)), np.zeros(near.samples.size)
        if not near.samples.size:
            return by_joints, by_time
        used, places = np.unique(near.samples, return_inverse=True)
        k, dim = self.robot.dof, self.robot.dim
        jacobians = as_array(self._jacobian(theta[used].T)).T.reshape(used.size, len(self._frames), dim, k)
        positions = self.positions(theta[used])
        for group in self._groups:
            column = np.full(len(self.pairs), -1)
            column[group.numbers] = np.arange(group.numbers.size)
            rows = np.flatnonzero(column[near.pairs] >= 0)
            columns = column[near.pairs[rows]]
            slopes = group.at(group.gradient, positions, times[used], places[rows], columns)
            ends = jacobians[places[rows][:, None], group.frames[columns]]
            normals = slopes[:, : ends.shape[1] * dim].reshape(*ends.shape[:-1])
            by_joints[rows] = np.einsum("med,medk->mk", normals, ends)
            if group.is_time_dependent:
                by_time[rows] = slopes[:, -1]
        return by_joints, by_time
