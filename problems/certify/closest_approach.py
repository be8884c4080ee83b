"""When and where a motion comes closest to something."""

from __future__ import annotations

from dataclasses import dataclass

from problems.certify.clearance import prove_clearance
from problems.limits.distances.proximity import Proximity
from problems.motions.trajectory import Trajectory


@dataclass(frozen=True)
class ClosestApproach:
    """The smallest distance of a motion.

    Attributes:
        distance: between the surfaces, m; not positive where they touch.
        time: of that, s.
        pair: that comes so near.
    """

    distance: float
    time: float
    pair: str


def closest_approach(limit: Proximity, trajectory: Trajectory) -> ClosestApproach | None:
    """The closest approach of all pairs of a limit, as the proof of the clearance has seen it; None without pairs."""
    proof = prove_clearance(limit, trajectory)
    return None if proof is None else ClosestApproach(proof.smallest, proof.time, proof.where)
