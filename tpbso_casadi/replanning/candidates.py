"""What a replanner may do next: steps, stops, direct moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, TypeAlias

import numpy as np

from problems import Trajectory
from problems.base import FloatArray
from problems.certify import ClearanceProof
from problems.robots import JointLimits
from problems.timing import MotionState, fastest_duration, fastest_move, fastest_stop
from tpbso_casadi.scenario import Scenario

Kind: TypeAlias = Literal["new", "old", "stop"]


@dataclass(frozen=True)
class NearestApproach:
    """The place at which a motion comes nearest to obstacles that move.

    Attributes:
        distance: how near, m; negative where they meet.
        time: when, s.
        pair: the body, and the obstacle's number.
    """

    distance: float
    time: float
    pair: str

    @classmethod
    def of(cls, proof: ClearanceProof | None) -> NearestApproach | None:
        """The nearest approach that a proof has seen; None where nothing moves."""
        return None if proof is None else cls(proof.smallest, proof.time, proof.where)


@dataclass(frozen=True, kw_only=True)
class Step:
    """The motion from now on, on a clock that starts now.

    Attributes:
        kind: another motion than the one that was executed, the same, or a stop.
        trajectory: what has been executed goes on for the time that planning may take; then what follows.
        certified: whether it keeps all limits and stays clear of all obstacles as they are predicted, for all t.
        fail_safe: whether its beginning, followed by a stop, is proven clear until the arm stands though obstacles may
            leave their prediction at the rate; of a stop whether that itself is. The prediction is that of the
            observation ``proof_age`` seconds ago. An arm that stands is not in motion when touched.
        seconds: that the decision took.
        proof_age: of that observation, s: 0 for the one of this step; older where a stop goes on that is not proven
            anew, though what is seen keeps what its proof allows; None where nothing is proven.
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
    proof_age: float | None = None
    closest: NearestApproach | None = None
    x: FloatArray | None = None


EFFORTS = (1.0, 0.5)  # shares of acceleration and jerk that are tried in turn: motors may not give the whole
SAME = 1e-9  # rad / s^n: differences between two motions that are one


@dataclass(frozen=True)
class StepCandidate:
    """A motion from now on.

    Attributes:
        kind: what it would be.
        trajectory: the whole of it.
        added: what follows the motion that is executed; None where that goes on.
        x: the candidate of a search, (d,).
    """

    kind: Kind
    trajectory: Trajectory
    added: Trajectory | None = None
    x: FloatArray | None = None


def lasting(trajectory: Trajectory, seconds: float) -> Trajectory:
    """A motion that is at least so long: after its end it stands."""
    missing = seconds - trajectory.duration
    if missing <= 0.0:
        return trajectory
    return trajectory.followed_by(Trajectory.standing(trajectory.value_at_end(), missing))


def remaining(trajectory: Trajectory, seconds: float, least: float) -> Trajectory:
    """The rest of a motion after so many seconds: ``least`` s at least, standing where nothing is left."""
    left = trajectory.duration - seconds
    if left < least:
        trajectory = lasting(trajectory, seconds + least)
    return trajectory.part(seconds, trajectory.duration)


def passed(rest: Trajectory, whole: Trajectory) -> float | None:
    """How many seconds of a motion are over where another one is what is left of it; None where it is not.

    How long either stands at its end does not matter, but where nothing is left but standing.
    """
    if rest.moves:
        rest, whole = _until_rest(rest), _until_rest(whole)
    seconds = whole.duration - rest.duration
    if not -SAME < seconds < whole.duration:
        return None
    seconds = max(seconds, 0.0)
    own = whole.part(seconds, whole.duration)
    same = own.coefficients.shape == rest.coefficients.shape and np.allclose(own.breakpoints, rest.breakpoints)
    return seconds if same and np.allclose(own.coefficients, rest.coefficients, rtol=SAME, atol=SAME) else None


def _until_rest(trajectory: Trajectory) -> Trajectory:
    """A motion without the time for which it stands at its end."""
    moving = np.flatnonzero(trajectory.coefficients[:-1].any(axis=(0, 2)))
    count = int(moving[-1]) + 1 if moving.size else len(trajectory.breakpoints) - 1
    return Trajectory(trajectory.breakpoints[: count + 1], trajectory.coefficients[:, :count])


def stands_at_end_of(rest: Trajectory, whole: Trajectory) -> bool:
    """Whether a motion is none, in the posture to which another one leads."""
    return not rest.moves and bool((np.abs(rest.value_at_end() - whole.value_at_end()) < SAME).all())


def stops(state: MotionState, limits: JointLimits) -> Iterator[Trajectory]:
    """The fastest stops, with ever less effort; one where the joints stand."""
    for effort in EFFORTS if state.moves else EFFORTS[:1]:
        yield fastest_stop(state, _gentler(limits, effort))


@dataclass(frozen=True, eq=False)
class DirectMove:
    """The fastest move from one state to another, made where more than its duration is asked for.

    Attributes:
        state: with which it begins.
        goal: in which it ends.
        limits: of the joints.
    """

    state: MotionState
    goal: MotionState
    limits: JointLimits

    @cached_property
    def duration(self) -> float:
        """How long it takes, s."""
        return fastest_duration(self.state, self.goal, self.limits)

    @cached_property
    def trajectory(self) -> Trajectory:
        """The move as exact polynomial pieces."""
        return fastest_move(self.state, self.goal, self.limits)

    def efforts(self) -> Iterator[DirectMove]:
        """The move, and the same with ever less effort."""
        yield self
        for effort in EFFORTS[1:]:
            yield replace(self, limits=_gentler(self.limits, effort))


def direct_moves(state: MotionState, goals: Sequence[FloatArray], limits: JointLimits) -> list[DirectMove]:
    """The fastest move to each of some postures (k,), rad; the fastest of them first."""
    moves = (DirectMove(state, MotionState.at_rest(goal), limits) for goal in goals)
    return sorted(moves, key=lambda move: move.duration)


def _gentler(limits: JointLimits, effort: float) -> JointLimits:
    """A share of accelerations and jerks; speeds stay as they are."""
    jerk = None if limits.jerk is None else tuple(effort * most for most in limits.jerk)
    return replace(limits, acceleration=tuple(effort * most for most in limits.acceleration), jerk=jerk)
