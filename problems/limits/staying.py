"""Margins that taper off, and what a robot that stays at its goal has to keep.

What happens between samples takes a margin at the samples. The state in which a motion begins is given, and the posture
in which it ends, however close to a limit they are, so that there no margin can be asked for: it grows from nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, is_zero
from problems.limits.limit import Constraint, Limit, Repetition
from problems.motions import Samples
from problems.robots import Robot


@dataclass(frozen=True, kw_only=True)
class TaperSettings:
    """Settings of the margins at samples for what lies between them.

    Values are chosen.

    Attributes:
        rate_share: of the bound of a limit that a longer duration restores.
        place_share: of the reach or of a joint's range, for limits on postures.
        place_easing: share of the duration, from either end, within which margins of postures grow.
        rate_easing: share of the duration, from the start, within which margins of rates grow; all rates vanish
            at the end.
    """

    rate_share: float = 0.02
    place_share: float = 4e-3
    place_easing: float = 0.15
    rate_easing: float = 0.03


TAPER = TaperSettings()


@dataclass(frozen=True)
class TaperedMargin(Limit):
    """A limit with a margin that vanishes at both ends of a motion.

    Written for one sample at a time, as compiled code has it.

    Args:
        limit: to be kept.
    """

    name: ClassVar[str] = "tapered margin"

    limit: Limit

    @property
    def robot_or_none(self) -> Robot | None:
        return self.limit.robot_or_none

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The limit's constraints on one sample, with bounds between those without margin and those with all of it."""
        return self._between_bounds(
            self.limit.constraints_at(samples, 0.0), self.limit.constraints_at(samples, TAPER.place_share), samples
        )

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        loose, tight = (self.limit.between(before, after, share) for share in (0.0, TAPER.place_share))
        return self._between_bounds(loose, tight, after)

    def repetitions(self, symbolic_copy: TaperedMargin) -> list[Repetition]:
        return [
            replace(each, limits=tuple(map(TaperedMargin, each.limits)), is_time_dependent=True)
            for each in self.limit.repetitions(symbolic_copy.limit)
        ]

    def repeated_numbers(self) -> list[FloatArray]:
        return self.limit.repeated_numbers()

    def may_break(self, samples: Samples, margin: float = 0.0) -> Matrix | None:
        return self.limit.may_break(samples, TAPER.place_share)

    def _between_bounds(
        self, loose: Sequence[Constraint], tight: Sequence[Constraint], samples: Samples
    ) -> list[Constraint]:
        past, left = _shares(samples)
        share = ca.fmin(1.0, ca.fmin(past, left) / TAPER.place_easing)
        rate = TAPER.rate_share * ca.fmin(1.0, past / TAPER.rate_easing) if self.limit.scales_with_time else 0.0
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


SAMPLE_STEP = 0.05  # s, between samples of a stay
FEWEST_SAMPLES, MOST_SAMPLES = 21, 600
AT_GOAL = " at the goal"  # after the name of a constraint


def stay_shares(seconds: float) -> FloatArray:
    """Shares of a stay of so many s at which it is sampled, (n,), from 0 to 1."""
    return np.linspace(0.0, 1.0, int(np.clip(np.ceil(seconds / SAMPLE_STEP) + 1.0, FEWEST_SAMPLES, MOST_SAMPLES)))


def staying(robot: Robot, theta: Matrix, arrival: Matrix, since: Matrix) -> Samples:
    """The samples of a posture after the end of a motion.

    Args:
        robot: that stands.
        theta: its joints, (1, dof), rad.
        arrival: when it arrives, scalar, s.
        since: how long it has stood, (n, 1), s.
    """
    postures = ca.repmat(theta, since.shape[0], 1)
    return Samples(robot=robot, derivatives=(postures,), duration=arrival, times=arrival + since)


def stay_constraints(
    limits: Sequence[Limit], robot: Robot, theta: Matrix, arrival: Matrix, since: Matrix, margin: float
) -> list[Constraint]:
    """The constraints of time-dependent limits on a robot that stands; arguments as of :func:`staying`."""
    samples = staying(robot, theta, arrival, since)
    return [
        replace(constraint, name=f"{constraint.name}{AT_GOAL}")
        for limit in time_dependent_parts(limits)
        for constraint in limit.constraints_at(samples, margin)
    ]


def time_dependent_parts(limits: Sequence[Limit]) -> list[Limit]:
    """The parts of limits that depend on the time itself."""
    return [kept for limit in limits if (kept := limit.time_dependent_part) is not None]


def stay_matters(limits: Sequence[Limit], seconds: Operand) -> bool:
    """Whether any limit depends on the time after arrival."""
    return bool(time_dependent_parts(limits)) and not is_zero(seconds)
