"""Plans without a search of a population: what a problem may know of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from problems.motions import Trajectory


@dataclass(frozen=True, eq=False)
class Approach:
    """Postures at both ends.

    Attributes:
        start: the posture at the start, (dof,), rad.
        goal: that at the goal.
        bound: no motion between them has a lower objective, the cost of its goal included.
    """

    start: FloatArray
    goal: FloatArray
    bound: float


class DirectPlanner:
    """Programs that plan motions without a search, or improve a given one; this base class has none."""

    @property
    def replaces_descents(self) -> bool:
        """Whether :meth:`polished` goes on from any motion, whatever its timing, so that no descent is needed."""
        return False

    @property
    def lacks_core(self) -> bool:
        """Whether a compiled core, which is not there, may find faster motions."""
        return False

    @property
    def ends_may_move(self) -> bool:
        """Whether a plan may have other postures at its ends than the motion that it is made of."""
        return False

    @property
    def free_space_time(self) -> float:
        """A motion's least duration in free space between the postures of its branch, s; 0 where none is known."""
        return 0.0

    @property
    def least_bound(self) -> float:
        """A lower bound of the objective over all approaches; minus infinity where none is known."""
        return -np.inf

    @property
    def in_free_space(self) -> Trajectory | None:
        """The fastest motion to the nearest posture at the goal, whatever is in its way; None where none is known."""
        return None

    def at_the_bound(self, rng: np.random.Generator) -> Iterator[Trajectory]:
        """Motions that nothing between the same two postures can beat, if they keep all limits.

        Args:
            rng: of what is drawn.
        """
        return iter(())

    def approaches(self) -> Sequence[Approach]:
        """Postures at the ends between which :meth:`along_paths` leads, the lowest bound first."""
        return ()

    def along_paths(
        self, approach: Approach, seed: int, to_beat: float, is_enough: Callable[[bool], bool]
    ) -> Iterator[Trajectory]:
        """Motions polished from paths that are found, each better than those before.

        Args:
            approach: between which postures they lead.
            seed: of the paths.
            to_beat: the objective of a motion that is known, with the cost of its goal; infinite where none is.
            is_enough: whether to come to an end, with a motion that is known or without one.
        """
        return iter(())

    def polished(self, start: Trajectory, is_enough: Callable[[bool], bool]) -> Iterator[Trajectory]:
        """Faster motions made of one that may break limits, each kept farther from them than the last.

        Args:
            start: the motion.
            is_enough: whether to come to an end, with a motion that is known or without one.
        """
        return iter(())
