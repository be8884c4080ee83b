"""Motions at the lower bound of the duration: as fast as the slowest joint alone would be.

Between two postures at rest the slowest joint decides the least duration, and how it moves. All other joints have time:
they may run their own motions slower, and wait before or after. Most pairs of postures with a clear motion at all have
one among these; they are drawn at random, and examined in a few postures before anything is proven.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.motions import Trajectory
from problems.polish.settings import DEFAULT_REPHASING, RephasingSettings
from problems.robots import JointLimits
from problems.tasks import Surroundings
from problems.timing import Phasing, least_durations, rest_to_rest

EXAMINED_POSTURES = 64  # of a motion before it is made; a power of two


def examined_shares() -> FloatArray:
    """Shares of the duration at which motions are examined, those where contact is likely first."""
    count, numbers = EXAMINED_POSTURES, list[int]()
    width = count // 2
    while width >= 1:
        level = np.arange(width, count, 2 * width)
        numbers += sorted(level.tolist(), key=lambda number: abs(number - count // 2))
        width //= 2
    return np.array(numbers) / count


@dataclass(frozen=True, eq=False)
class Rephased:
    """Motions between two postures at rest as fast as the direct one.

    Args:
        start: (dof,), rad.
        goal: (dof,), rad.
        limits: of the joints.
    """

    start: FloatArray
    goal: FloatArray
    limits: JointLimits

    @cached_property
    def direct(self) -> Trajectory:
        """The motion in which all joints move from the first moment to the last."""
        return rest_to_rest(self.start, self.goal, self.limits)

    @cached_property
    def _least_shares(self) -> FloatArray:
        """Least durations of the joints as shares of the slowest one's, (dof,)."""
        durations = least_durations(self.goal - self.start, self.limits)
        shares = np.ones_like(durations)
        return np.asarray(np.divide(durations, durations.max(), out=shares, where=durations > 0.0))

    def postures(self, stretches: FloatArray, waits: FloatArray, share: float) -> FloatArray:
        """Postures (n, dof) at a share of the time of motions with stretches and waits (n, dof) of :class:`Phasing`."""
        taken = self._least_shares + stretches * (1.0 - self._least_shares)
        done = np.clip((share - waits * (1.0 - taken)) / taken, 0.0, 1.0)
        direct = self.direct
        times = done * direct.duration
        piece = np.clip(np.searchsorted(direct.breakpoints, times, side="right") - 1, 0, len(direct.breakpoints) - 2)
        since, joints = times - direct.breakpoints[piece], np.arange(self.start.size)
        theta = np.zeros_like(times)
        for coefficients in direct.coefficients:
            theta = theta * since + coefficients[piece, joints]
        return theta

    def made(self, stretches: FloatArray, waits: FloatArray) -> Trajectory:
        """The motion of one stretch and wait of each joint, (dof,)."""
        return rest_to_rest(self.start, self.goal, self.limits, Phasing(stretches, waits))


Allowed: TypeAlias = Callable[[FloatArray], NDArray[np.bool_]]


def everywhere(theta: FloatArray) -> NDArray[np.bool_]:
    """A mask that allows all postures (n, dof)."""
    return np.ones(len(theta), dtype=bool)


def random_phases(
    count: int, dof: int, rng: np.random.Generator, fastest_share: float = RephasingSettings.fastest_share
) -> tuple[FloatArray, FloatArray]:
    """Random stretches and waits of so many motions, both (count, dof)."""
    stretches = np.where(rng.random((count, dof)) < fastest_share, 0.0, rng.random((count, dof)))
    waits = rng.random((count, dof))
    early_or_late = rng.random((count, 1)) < fastest_share
    return stretches, np.where(early_or_late, np.round(waits), waits)


def at_the_bound(
    around: Surroundings,
    starts: FloatArray,
    goals: FloatArray,
    rng: np.random.Generator,
    allowed: Allowed = everywhere,
    settings: RephasingSettings = DEFAULT_REPHASING,
) -> Iterator[Trajectory]:
    """The direct motions and others as fast as they that are clear: proven where the core can, else at samples.

    Args:
        around: the robot, and the obstacles that it keeps clear of.
        starts: at rest, (n, dof), rad.
        goals: one of each start; any pair will do, the soonest reached first, (n, dof), rad.
        rng: of the draws.
        allowed: which postures (n, dof) may be passed, (n,).
        settings: of the draws.
    """
    limits, world = around.robot.limits, around.world

    def proven(trajectory: Trajectory) -> bool:
        return world is None or bool(world.prove(trajectory).status)

    motions = [Rephased(*ends, limits) for ends in zip(starts[: settings.pairs], goals[: settings.pairs], strict=True)]
    for motion in motions:
        none = np.zeros((1, motion.start.size))
        if _clear(around, motion, none, none, allowed).size and proven(motion.direct):
            yield motion.direct
    for motion in motions:
        stretches, waits = random_phases(settings.draws // len(motions), motion.start.size, rng, settings.fastest_share)
        for number in _clear(around, motion, stretches, waits, allowed):
            trajectory = motion.made(stretches[number], waits[number])
            if proven(trajectory):
                yield trajectory


def _clear(
    around: Surroundings, motion: Rephased, stretches: FloatArray, waits: FloatArray, allowed: Allowed
) -> NDArray[np.intp]:
    """Numbers of the motions that are clear at all examined postures."""
    left = np.arange(len(stretches))
    for share in examined_shares():
        if not left.size:
            break
        theta = motion.postures(stretches[left], waits[left], float(share))
        left, theta = left[may := allowed(theta)], theta[may]
        left = left[around.clear(theta, np.full(left.size, share * motion.direct.duration))]
    return left
