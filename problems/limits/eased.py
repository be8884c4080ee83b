"""Limits that a search keeps more strictly in the middle of a motion than at its ends.

What happens between samples takes a margin at the samples. The state in which a motion begins is given, and the posture
in which it ends, however close to a limit they are, so that there no margin can be asked for: it grows from nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import casadi as ca

from problems.base.matrix import FloatArray, Matrix, Operand
from problems.limits.constraint import Constraint
from problems.limits.limit import Limit, Repetition
from problems.motions.samples import Samples
from problems.robots.robot import Robot

RATE_SHARE = 0.02  # of the bound of a limit that a longer duration restores: margin for what is between samples
PLACE_SHARE = 4e-3  # of the reach or of a joint's range: the same for limits on postures
PLACE_EASING = 0.15  # of the duration, from either end: margins of postures are complete in between
RATE_EASING = 0.03  # of the duration, from the start: those of rates, which all vanish at the end, are complete then


@dataclass(frozen=True)
class Eased(Limit):
    """A limit with a margin that vanishes at both ends of a motion.

    Written for one sample at a time, as compiled code has it.

    Args:
        limit: to be kept.
    """

    name: ClassVar[str] = "eased"

    limit: Limit

    @property
    def robot_or_none(self) -> Robot | None:
        """That of the limit."""
        return self.limit.robot_or_none

    def at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The limit's constraints on one sample: their bounds are between those without margin and those with all."""
        return self._between_bounds(self.limit.at(samples, 0.0), self.limit.at(samples, PLACE_SHARE), samples)

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        """The same on one step."""
        loose, tight = (self.limit.between(before, after, share) for share in (0.0, PLACE_SHARE))
        return self._between_bounds(loose, tight, after)

    def repetitions(self, twin: Eased) -> list[Repetition]:
        """Those of the limit, each eased; they need the time."""
        return [
            replace(each, limits=tuple(map(Eased, each.limits)), timed=True)
            for each in self.limit.repetitions(twin.limit)
        ]

    def repeated_numbers(self) -> list[FloatArray]:
        """Those of the limit."""
        return self.limit.repeated_numbers()

    def may_break(self, samples: Samples, margin: float = 0.0) -> Matrix | None:
        """With all of the margin."""
        return self.limit.may_break(samples, PLACE_SHARE)

    def _between_bounds(
        self, loose: Sequence[Constraint], tight: Sequence[Constraint], samples: Samples
    ) -> list[Constraint]:
        past, left = _shares(samples)
        share = ca.fmin(1.0, ca.fmin(past, left) / PLACE_EASING)
        rate = RATE_SHARE * ca.fmin(1.0, past / RATE_EASING) if self.limit.scales_with_time else 0.0
        return [
            replace(
                one,
                lower=_bound(one.lower, other.lower, share, lambda bound: bound + rate * ca.fabs(bound)),
                upper=_bound(one.upper, other.upper, share, lambda bound: bound - rate * ca.fabs(bound)),
            )
            for one, other in zip(loose, tight, strict=True)
        ]


def _shares(samples: Samples) -> tuple[Matrix, Matrix]:
    """The shares of the duration that are past and left, both from 0 to 1."""
    assert samples.times is not None
    past = ca.fmin(1.0, samples.times / samples.duration)
    return past, 1.0 - past


def _bound(
    loose: Matrix | None, tight: Matrix | None, share: Operand, narrowed: Callable[[Matrix], Matrix]
) -> Matrix | None:
    return None if loose is None or tight is None else narrowed(loose + share * (tight - loose))
