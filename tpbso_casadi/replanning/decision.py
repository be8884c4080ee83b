"""Which candidate is taken: judged, proven."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from math import inf

import numpy as np

from problems import Trajectory
from problems.base import FloatArray
from problems.certify import ClearanceProof
from problems.motions import SLIVER
from problems.timing import MotionState
from tpbso_casadi.replanning.candidates import DirectMove, StepCandidate, direct_moves, lasting, stops
from tpbso_casadi.replanning.proofs import ObservedScene, RobotLimits, is_clear
from tpbso_casadi.replanning.search import SuccessiveSearches

SOONER = 0.99  # of the time until the arm arrives: another motion has to take no more than this share of it
SLOW = 1.1  # times the least time that there is: what takes longer is worth a search
SAME_POSTURE = 1e-6  # rad
KEPT_FOR_STOPS = 0.3  # of the time that a decision may take


@dataclass(frozen=True)
class Judged:
    """A candidate and what is proven of it.

    Attributes:
        candidate: the motion.
        proof: of its clearance from what moves; None where nothing does.
        fixed: whether it keeps the robot's limits, and clear of what stands still.
        proof_age: how old the observation is with which it is proven that it can be stopped in time although
            predictions are wrong, s; None where that is not proven.
        breaks_limits: whether only the robot's limits are against it.
    """

    candidate: StepCandidate
    proof: ClearanceProof | None
    fixed: bool
    proof_age: float | None
    breaks_limits: bool = False

    @property
    def fail_safe(self) -> bool:
        """Whether it is proven that it can be stopped in time."""
        return self.proof_age is not None

    @property
    def certified(self) -> bool:
        """Whether all of it is proven in the predicted scene."""
        return self.fixed and is_clear(self.proof)

    @property
    def accepted(self) -> bool:
        """Whether it may be executed."""
        return self.certified and self.fail_safe


@dataclass(frozen=True)
class Decision:
    """The knowledge with which a step begins, and the choice that follows from it.

    Args:
        limits: of the robot.
        scene: as it is predicted.
        executed: the motion that goes on until a decision takes effect.
        is_proven: whether it is known to keep the limits, and clear of what stands still.
        stop_age: how old the observation is with which the stop has been proven that begins when this decision takes
            effect, or goes on, s; None where none has, or obstacles have left what that proof allows them.
        stopping: whether a stop is executed.
        foreseen: the proof that it stays clear of what moves, where that is known too.
        goals: postures (k,), rad, of which one is to be reached.
        search: for a way round.
        seconds: that are left, without those that the proof of a stop takes; None where only evaluations count.
        every: how long a decision may take, s.
        rate: how fast what moves may leave its prediction, m/s.
    """

    limits: RobotLimits
    scene: ObservedScene
    executed: Trajectory
    is_proven: bool
    stop_age: float | None
    stopping: bool
    foreseen: ClearanceProof | None
    goals: Sequence[FloatArray]
    search: SuccessiveSearches
    seconds: Callable[[], float | None]
    every: float
    rate: float

    @cached_property
    def until_then(self) -> Trajectory:
        """The motion that is executed until the decision takes effect."""
        return lasting(self.executed, self.every).part(0.0, self.every)

    @cached_property
    def state(self) -> MotionState:
        """How the arm moves then."""
        return MotionState.at_end(self.until_then)

    @cached_property
    def rest(self) -> list[Trajectory]:
        """The motion that would go on from then; None where the arm stands then."""
        goes_on = self.executed.duration > self.every + SLIVER
        return [self.executed.part(self.every, self.executed.duration)] if goes_on else []

    @cached_property
    def old(self) -> StepCandidate:
        """The motion that is executed, to its end."""
        return StepCandidate("old", lasting(self.executed, self.every))

    @cached_property
    def arrival(self) -> float:
        """When it arrives at a goal, s; never where it does not lead to one."""
        end = self.executed.value_at_end()
        return self.executed.duration if any(np.abs(goal - end).max() < SAME_POSTURE for goal in self.goals) else inf

    def chosen(self) -> Judged:
        """The motion to execute from now on: the first to arrive of those that may be; a stop where none may."""
        old = self.judged(self.old) if self.arrival < inf else None
        best = old if old is not None and old.accepted else None
        moves = direct_moves(self.state, self.goals, self.scene.robot.limits) if self._has_far_to_go else []
        direct = self._direct(moves, inf if best is None else self.arrival)
        if direct is not None:
            return direct
        bound = self.every + min((move.duration for move in moves), default=inf)
        if best is None or self.arrival > SLOW * bound:
            found = self._way_round(moves, inf if best is None else self.arrival)
            best = found or best
        return best or self.stop()

    @property
    def _has_far_to_go(self) -> bool:
        """Whether the arm is not at a goal already when the decision takes effect."""
        return self.state.moves or all(np.abs(goal - self.state.angles).max() > SAME_POSTURE for goal in self.goals)

    def _direct(self, moves: Sequence[DirectMove], arrival: float) -> Judged | None:
        """The first of the fastest moves to the goals that may be executed and arrives before another motion."""
        tried = False
        for direct in moves:
            for move in direct.efforts():
                if self.every + move.duration > SOONER * arrival or (tried and self._is_late):
                    break
                tried = True
                judged = self.judged(self.new(move.trajectory))
                if judged.accepted:
                    return judged
                if not judged.breaks_limits:
                    break  # less effort is for motors that cannot give the whole
        return None

    def _way_round(self, moves: Sequence[DirectMove], arrival: float) -> Judged | None:
        """The first motion that is searched for, may be executed, and arrives before another one."""
        if not moves:
            return None
        known = [*(self.rest if self.arrival < inf else []), *(move.trajectory for move in moves)]
        obstacles = [obstacle.later(self.every) for obstacle in self.scene.obstacles]
        for added, x in self.search.best(self.state, self.goals, obstacles, known, self.seconds()):
            if self.every + added.duration > SOONER * arrival or self._is_late:
                return None
            judged = self.judged(self.new(added, x))
            if judged.accepted:
                return judged
        return None

    @property
    def _is_late(self) -> bool:
        """Whether there is no time for anything but a stop."""
        left = self.seconds()
        return left is not None and left <= 0.0

    def stop(self) -> Judged:
        """The first stop that is proven, or else the fastest one."""
        under_way = self.rest if self.stopping else []
        judged: list[Judged] = []
        for stop in chain(under_way, stops(self.state, self.scene.robot.limits)):
            is_known = len(judged) < len(under_way) or not under_way
            judged.append(self._judged_stop(stop, self.stop_age if is_known else None))
            if judged[-1].accepted:
                return judged[-1]
        return next((each for each in judged if each.certified), judged[0])

    def new(self, added: Trajectory, x: FloatArray | None = None) -> StepCandidate:
        """A motion that begins when the decision takes effect, with what is executed before."""
        return StepCandidate("new", self.until_then.followed_by(added), added, x)

    def judged(self, candidate: StepCandidate) -> Judged:
        """The proofs, as far as they can still matter."""
        ways_to_stop, searched = self._clear_stops(candidate.trajectory), candidate.x is not None
        first = next(ways_to_stop, None) if searched else None  # clear at its samples: more often it cannot be stopped
        if searched and first is None:
            return Judged(candidate, None, fixed=False, proof_age=None)
        known = self.foreseen if candidate.trajectory is self.executed else None  # of no more than that
        proof = known or self.scene.moving.proof(candidate.trajectory)
        if not (is_clear(proof) and self._keeps_clear(candidate)):
            return Judged(candidate, proof, fixed=False, proof_age=None)
        first = first or next(ways_to_stop, None)  # clearances take less time than torques
        if first is None:
            return Judged(candidate, proof, fixed=False, proof_age=None)
        fixed = self._keeps_limits(candidate)
        can_stop = fixed and any(not stop.moves or self.limits.hold(stop) for stop in chain([first], ways_to_stop))
        return Judged(candidate, proof, fixed, 0.0 if can_stop else None, breaks_limits=not can_stop)

    def _judged_stop(self, added: Trajectory, age: float | None) -> Judged:
        """A stop, which an observation of that age may have proven; what is seen now is tried first."""
        candidate = StepCandidate("stop", self.until_then.followed_by(added), added)
        proof = self.scene.moving.proof(candidate.trajectory)
        fixed = self._keeps_clear(candidate) and self._keeps_limits(candidate)
        if not fixed:
            return Judged(candidate, proof, fixed, None)
        if not candidate.trajectory.moves or self._uncertain.moving.are_clear_of(candidate.trajectory):
            return Judged(candidate, proof, fixed, 0.0)
        return Judged(candidate, proof, fixed, age if is_clear(proof) else None)

    def _to_prove(self, candidate: StepCandidate) -> list[Trajectory]:
        """The parts of a motion of which it is not known yet that they keep what does not change."""
        if candidate.added is not None:
            return [candidate.added] if self.is_proven else [self.until_then, candidate.added]
        return [] if self.is_proven else [lasting(self.executed, self.executed.duration + self.every)]  # else it jumps

    def _keeps_clear(self, candidate: StepCandidate) -> bool:
        """Whether a motion keeps clear of what stands still."""
        return all(self.scene.fixed.are_clear_of(part) for part in self._to_prove(candidate))

    def _keeps_limits(self, candidate: StepCandidate) -> bool:
        """Whether a motion keeps the robot's limits."""
        parts = self._to_prove(candidate)
        return all(self._until_then_holds if part is self.until_then else self.limits.hold(part) for part in parts)

    @cached_property
    def _until_then_holds(self) -> bool:
        return self.limits.hold(self.until_then)

    @cached_property
    def _uncertain(self) -> ObservedScene:
        return self.scene.less_certain(self.rate)

    def _clear_stops(self, trajectory: Trajectory) -> Iterator[Trajectory]:
        """Stops from when the next decision takes effect, as far as a motion until then and they are proven clear.

        No motion at all where it stands until then.
        """
        beginning = trajectory.part(0.0, min(2.0 * self.every, trajectory.duration))
        if not beginning.moves:
            yield beginning
            return
        for stop in stops(MotionState.at_end(beginning), self.scene.robot.limits):
            whole = beginning.followed_by(stop)
            if not (self._uncertain.moving.are_clear_of(whole) and self.scene.fixed.are_clear_of(whole)):
                return  # a stop with less effort takes longer
            yield stop
