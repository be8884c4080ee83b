"""The ladder: what costs least comes first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from solvers.abso import AdaptiveBeetleSwarm


@dataclass(frozen=True)
class Ladder(AdaptiveBeetleSwarm):
    """The adaptive beetle swarm, where no motion as fast as a lower bound of the duration is clear."""

    bound_first: ClassVar[bool] = True
