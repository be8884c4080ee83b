"""The samples of a polish: parameters at which motions are examined, and their states there by control points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from problems.base import FloatArray
from problems.limits import stay_shares
from problems.polish.deviation import Deviations, JointRows, PostureRows
from problems.polish.settings import DEFAULT_POLISH, PolishSettings
from problems.worlds import World


@dataclass(frozen=True, eq=False, kw_only=True)
class PolishSamples:
    """Samples of motions that deviate from one.

    Args:
        motions: that are examined.
        world: the robot and its surroundings.
        u: parameters of the samples, (n,).
        stay: for how long the goal has to be clear after the arrival, s; it matters where obstacles move.
        settings: of the polish.
    """

    motions: Deviations
    world: World
    u: FloatArray
    stay: float = 0.0
    settings: PolishSettings = DEFAULT_POLISH

    def joined(self, more: FloatArray) -> PolishSamples:
        """The samples and those at more parameters (m,)."""
        return replace(self, u=np.union1d(self.u, more))

    @cached_property
    def _waits(self) -> FloatArray:
        """Times after the arrival at which the goal is examined, (m,), s: none where obstacles stand still."""
        if not self.world.moves:
            return np.empty(0)
        return stay_shares(self.stay) * self.stay if self.stay else np.zeros(1)

    @cached_property
    def passed(self) -> FloatArray:
        """Parameters at which distances are examined, the goal's for each time there, (n + m,)."""
        return np.append(self.u, np.ones_like(self._waits))

    @cached_property
    def postures(self) -> PostureRows:
        """Postures where distances are examined."""
        return self.motions.postures(self.passed)

    def times(self, duration: float) -> FloatArray:
        """Times at which distances are examined in a motion of a duration in s, (n + m,), s."""
        return self.passed * duration + np.append(np.zeros_like(self.u), self._waits)

    @cached_property
    def rates(self) -> tuple[PostureRows, ...]:
        """Speeds and accelerations where distances are examined; they matter where joints have tracking errors."""
        return tuple(self.motions.postures(self.passed, order) for order in (1, 2))

    def errors(self, rates: Sequence[PostureRows], padded: FloatArray, duration: float) -> FloatArray | None:
        """Tracking errors of the joints at speeds and accelerations of a motion, (n, k)."""
        if self.world.is_exact:
            return None
        speed, acceleration = (part.values(padded) / duration**order for order, part in enumerate(rates, start=1))
        return self.world.errors(speed, acceleration)

    def reach(self, trust: float) -> float:
        """The distance, about, by which a step brings bodies nearer, m; programs leave out bodies that are farther."""
        return (2.0 if self.world.moves else 1.0) * self.settings.approach * trust

    def longest_change(self, trust: float) -> float:
        """The most by which a program may change the duration, s: moving obstacles come no farther than joints do."""
        return self.settings.approach * trust / self.world.fastest if self.world.moves else np.inf

    @property
    def repairs(self) -> FloatArray:
        """Parameters that have joined the usual ones, (m,)."""
        return np.setdiff1d(self.u, self.motions.parameters())

    @cached_property
    def angles(self) -> JointRows:
        """Angles where ranges of joints are examined."""
        return self.motions.angles(self.repairs)

    @cached_property
    def torque_states(self) -> tuple[PostureRows, ...]:
        """Postures and their derivatives where torques are examined."""
        usual = np.union1d(self.motions.parameters(self.settings.torque_samples), self.motions.switches)
        u = np.union1d(usual, self.repairs)
        return tuple(self.motions.postures(u, order) for order in range(3))

    @cached_property
    def expression_states(self) -> tuple[PostureRows, ...]:
        """Postures and their derivatives where expressions are examined."""
        return tuple(self.motions.postures(self.u, order) for order in range(3))

    @cached_property
    def ranges(self) -> FloatArray | None:
        """Bounds of angles, (2, k), rad: a little within the joints' ranges, as far as the ends let it."""
        if self.motions.limits.position is None:
            return None
        settings, (low, high) = self.settings, np.array(self.motions.limits.position).T
        ends = np.stack([self.motions.start, self.motions.goal])
        inner = [
            np.clip(settings.inner_range * distance, 0.0, settings.most_inner_range)
            for distance in ((ends - low).min(axis=0), (high - ends).min(axis=0))
        ]
        return np.stack([low + inner[0], high - inner[1]])


def state_of(states: Sequence[PostureRows], padded: FloatArray, duration: float) -> FloatArray:
    """Angles, velocities and accelerations in some postures, (n, 3 k)."""
    return np.concatenate([part.values(padded) / duration**order for order, part in enumerate(states)], axis=1)


def slopes_of(
    weights: Sequence[FloatArray], slopes: FloatArray, state: FloatArray, durations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Slopes by control points, (m, w, k), and by the duration, (m,), of values with slopes (m, 3, k) by the state.

    Args:
        weights: of control points in angles and their derivatives by the parameter, (m, w) each.
        slopes: by angles, velocities and accelerations.
        state: angles, velocities and accelerations, (m, 3 k).
        durations: of that of which the parameter is the share, (m,), s.
    """
    k = slopes.shape[2]
    by_points, by_time = np.zeros((*weights[0].shape, k)), np.zeros(len(slopes))
    for order, own in enumerate(weights):
        by_points += own[:, :, None] * (slopes[:, order] / durations[:, None] ** order)[:, None, :]
        change = -order / durations[:, None] * state[:, order * k : (order + 1) * k]
        by_time += np.einsum("mk,mk->m", slopes[:, order], change)
    return by_points, by_time
