"""The trust region of sequential programs: how far a step may go from the motion around which a program is linear."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class TrustRegion:
    """A rule by which the size of a trust region follows the steps of a descent.

    A program promises a gain, and its step has a true one. A step that gains is accepted: where the share of the
    promise that came true is more than ``good``, the size is multiplied by ``growth``, where it is less than ``poor``,
    by ``shrinkage``, never above ``largest``. A step that gains nothing is rejected, and the size is multiplied by
    ``rejection``. A descent ends where the size falls below ``least``.

    Args:
        first: size at the beginning of a descent, in the unit of its variables.
        least: size below which a descent ends.
        largest: size that is never exceeded.
        growth: factor, more than 1.
        shrinkage: factor after an accepted step that was promised far more, less than 1.
        rejection: factor after a rejected step, less than 1.
        good: share of the promised gain above which the size grows.
        poor: share of the promised gain below which the size shrinks.
    """

    first: float
    least: float
    largest: float
    growth: float
    shrinkage: float
    rejection: float
    good: float
    poor: float

    def accepted(self, size: float, share: float) -> float:
        """The size after an accepted step that gained a share of what was promised."""
        factor = self.growth if share > self.good else self.shrinkage if share < self.poor else 1.0
        return min(factor * size, self.largest)

    def rejected(self, size: float) -> float:
        """The size after a rejected step."""
        return self.rejection * size

    def grown(self, size: float) -> float:
        """The largest size that the next step may have."""
        return min(self.growth * size, self.largest)
