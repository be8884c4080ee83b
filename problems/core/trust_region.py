"""Descents by sequential programs: each step solves a program around the best motion, within a trust region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np


class Judged(Protocol):
    """A motion of a descent."""

    @property
    def merit(self) -> float:
        """The value that a descent lowers."""


M = TypeVar("M", bound=Judged)


class Step(NamedTuple, Generic[M]):
    """A step of a descent.

    Attributes:
        motion: to which the program led, measured.
        promised: by how much the program said that its merit would be lower.
    """

    motion: M
    promised: float


@dataclass(frozen=True, kw_only=True)
class TrustRegion:
    """The rule of a descent: which steps it accepts, how far they may go, and when it ends.

    A program around the best motion promises a gain of merit, and its step has a true one. A step that gains is
    accepted: where at least a share ``good`` of the promise came true, the size is multiplied by ``growth``, where less
    than ``poor``, by ``shrinkage``, never above ``largest``. Where a step gains nothing, or a program has no solution,
    the motion stays, and the size is multiplied by ``rejection``.

    A descent ends where the size falls below ``least``, after ``patience`` programs that changed the merit by less than
    ``least_gain`` with none between that gained more, or where a program promises less than ``least_promise``.

    Args:
        first: size at the beginning of a descent, in the unit of its variables.
        least: size below which a descent ends.
        largest: size that is never exceeded.
        growth: factor, more than 1.
        shrinkage: factor after an accepted step that was promised far more, at most 1.
        rejection: factor after a rejected step, less than 1.
        good: share of the promised gain from which on the size grows.
        poor: share of the promised gain below which the size shrinks.
        patience: programs.
        least_gain: share of the merit.
        least_promise: share of the merit.
    """

    first: float
    least: float
    largest: float
    growth: float
    shrinkage: float
    rejection: float
    good: float
    poor: float
    patience: int
    least_gain: float
    least_promise: float

    def descent(
        self,
        best: M,
        programs: int,
        step: Callable[[M, float], Step[M] | None],
        is_done: Callable[[M, int], bool] = lambda motion, number: False,
    ) -> M:
        """The best motion to which steps from a given one lead.

        Args:
            best: where the descent begins.
            programs: at most.
            step: the step of the program around a motion, within a size; None where it has no solution.
            is_done: whether a motion is as good as any after so many programs, or hopeless.
        """
        size, idle = self.first, 0
        for number in range(programs):
            if is_done(best, number):
                break
            taken = step(best, size)
            gain = -np.inf if taken is None else best.merit - taken.motion.merit
            least_gain = self.least_gain * abs(best.merit)
            idle = 0 if gain >= least_gain else idle + (gain > -least_gain)
            if taken is not None and gain > 0.0:
                best, size = taken.motion, self.accepted(size, gain, taken.promised)
            else:
                size *= self.rejection
            has_promise = taken is None or taken.promised >= self.least_promise * abs(best.merit)
            if idle == self.patience or size < self.least or not has_promise:
                break
        return best

    def accepted(self, size: float, gain: float, promised: float) -> float:
        """The size after an accepted step."""
        factor = self.growth if gain >= self.good * promised else self.shrinkage if gain < self.poor * promised else 1.0
        return min(factor * size, self.largest)

    def grown(self, size: float) -> float:
        """The largest size that the next step may have."""
        return min(self.growth * size, self.largest)
