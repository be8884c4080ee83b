"""What one step of planning decides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from problems import Trajectory
from problems.base.matrix import FloatArray
from problems.certify.clearance import ClearanceProof
from tpbso_casadi.scenario.scenario import Scenario

Kind: TypeAlias = Literal["new", "old", "stop"]


@dataclass(frozen=True)
class Approach:
    """Where a motion comes nearest to obstacles that move.

    Attributes:
        distance: how near, m; negative where they meet.
        time: when, s.
        pair: the body, and the obstacle's number.
    """

    distance: float
    time: float
    pair: str

    @classmethod
    def of(cls, proof: ClearanceProof | None) -> Approach | None:
        """What a proof has seen; None where nothing moves."""
        return None if proof is None else cls(proof.smallest, proof.time, proof.where)


@dataclass(frozen=True, kw_only=True)
class Step:
    """The motion from now on, on a clock that starts now.

    Attributes:
        kind: another motion than the one that was executed, the same, or a stop.
        trajectory: what has been executed goes on for the time that planning may take; then what follows.
        certified: whether it keeps all limits and stays clear of all obstacles as they are predicted, for all t.
        fail_safe: whether its beginning, followed by a stop, is proven clear until the arm stands though obstacles may
            leave their prediction; of a stop whether that itself is. An arm that stands is not in motion when touched.
        seconds: that the decision took.
        closest: where it comes nearest to obstacles that move, as they are predicted; None where none does.
        scenario: of the robot and its goal.
        x: the candidate (d,) of the search that led to it; None where there was none.
    """

    kind: Kind
    trajectory: Trajectory
    certified: bool
    fail_safe: bool
    seconds: float
    scenario: Scenario
    closest: Approach | None = None
    x: FloatArray | None = None
