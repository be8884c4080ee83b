"""Which candidate is taken: searched, judged, proven."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from math import inf

import numpy as np

from problems import InvalidProblem, Joints, LimitKind, Move, Obstacle, Robot, TimeMoveProblem, Trajectory, time_move
from problems.base import FloatArray
from problems.certify import ClearanceProof
from problems.evaluation import EvaluationOptions
from problems.motions import SLIVER
from problems.timing import MotionState
from solvers import PSO, Archive, Box, Budget, minimize
from tpbso_casadi.replanning.candidates import StepCandidate, direct_moves, lasting, stops
from tpbso_casadi.replanning.proofs import ObservedScene, RobotLimits, is_clear

MEMBERS = 80  # of a swarm whose iterations take little time of their own: a step has little
KEPT = 8  # candidates of a search from which the next one begins
QUINTICS = 4  # durations of the motions in free space from which it begins too
PROVEN = 3  # the best of a search are proven, in order of cost


@dataclass(frozen=True)
class FoundMotion:
    """A motion that keeps everything at the samples of the search.

    Attributes:
        trajectory: from the state at its start.
        x: its search vector, (d,).
    """

    trajectory: Trajectory
    x: FloatArray


class Search:
    """Searches that follow each other.

    Args:
        robot: that moves.
        further: kinds of limits that hold besides those of the robot and of obstacles.
        evaluations: of each search.
        seed: of the first; the next ones count on from it.
    """

    def __init__(self, robot: Robot, further: Sequence[LimitKind], evaluations: int, seed: int) -> None:
        self._robot, self._further, self._evaluations, self._seed = robot, further, evaluations, seed
        self._solver, self._evaluation = PSO(population=MEMBERS), _compiled_at_once()
        self._problem: TimeMoveProblem | None = None
        self._known: FloatArray = np.empty((0, 0))

    def prepare(self, state: MotionState, goals: Sequence[FloatArray], obstacles: Sequence[Obstacle]) -> None:
        """Derive and compile what searches from such states need, so that none of them has to.

        Args:
            state: one of them.
            goals: postures (k,), rad.
            obstacles: as many, and of the same make, as there will be.

        Raises:
            InvalidProblem: that cannot be searched.
        """
        problem = self._stated(state, goals, obstacles)
        problem.evaluator(self._evaluation)(np.mean(problem.bounds, axis=0)[None])

    def _stated(
        self, state: MotionState, goals: Sequence[FloatArray], obstacles: Sequence[Obstacle]
    ) -> TimeMoveProblem:
        """The problem, which shares what was derived and compiled for the one before, if it can."""
        limits, places = self._robot.limits, tuple(Joints(tuple(goal.tolist())) for goal in goals)
        rates = _clipped(state.velocity, limits.speed), _clipped(state.acceleration, limits.acceleration)
        if self._problem is None:
            start, (speeds, changes) = Joints(tuple(state.angles.tolist())), (tuple(rate.tolist()) for rate in rates)
            task = Move(self._robot, start, places, (), "free", tuple(obstacles), speeds, start_acceleration=changes)
            self._problem = time_move(task, limits=self._further)
        else:
            task = self._problem.task.observed((state.angles, *rates), tuple(obstacles), places)
            self._problem = self._problem.same_structure_with(task)
        return self._problem

    def best(
        self,
        state: MotionState,
        goals: Sequence[FloatArray],
        obstacles: Sequence[Obstacle],
        known: Sequence[Trajectory],
        seconds: float | None,
    ) -> Iterator[FoundMotion]:
        """The best motions, the fastest first, as far as they keep everything at their samples.

        Args:
            state: with which they begin.
            goals: postures (k,), rad, of which they reach one.
            obstacles: on clocks that start with them.
            known: motions from about that state, from which the search begins.
            seconds: that it may take at most; None where only evaluations count.
        """
        if seconds is not None and seconds <= 0.0:
            return
        try:
            problem = self._stated(state, goals, obstacles)
        except InvalidProblem:  # the goal is taken by what stands there, or something is too near already
            return
        box = Box(*problem.bounds)
        archive, evaluate = Archive(box), problem.evaluator(self._evaluation)
        self._seed += 1
        minimize(
            evaluate,
            box,
            self._solver,
            Budget(self._evaluations, seconds=seconds),
            self._seed - 1,
            archive=archive,
            known=self._first(problem, known),
        )
        self._known = archive.x[:KEPT]
        for x, cost in zip(archive.x[:PROVEN], archive.cost, strict=False):
            if cost <= problem.objective_upper_bound:
                yield FoundMotion(problem.trajectory(x), x)

    def _first(self, problem: TimeMoveProblem, known: Sequence[Trajectory]) -> FloatArray:
        """Given motions as candidates, and those of the search before, where these have the same variables."""
        width = len(problem.bounds[0])
        rows = [problem.vector_of(trajectory)[None] for trajectory in known]
        kept = self._known if self._known.shape[1] == width else np.empty((0, width))
        return np.concatenate([*rows, problem.quintics(QUINTICS), kept])


def _clipped(values: FloatArray, most: tuple[float, ...]) -> FloatArray:
    """Rates that are beyond their limits by rounding at most, within these."""
    return np.clip(values, -np.array(most), np.array(most))


def _compiled_at_once() -> EvaluationOptions:
    """The usual options, but for waiting until something is worth compiling: a step has no time for it."""
    usual = EvaluationOptions()
    return replace(usual, backend="native") if usual.backend == "auto" else usual


SOONER = 0.99  # of the time until the arm arrives: another motion has to take no more than this share of it
SLOW = 1.1  # times the least time that there is: what takes longer is worth a search
SAME_POSTURE = 1e-6  # rad


@dataclass(frozen=True)
class Judged:
    """A candidate and what is proven of it.

    Attributes:
        candidate: the motion.
        proof: of its clearance from what moves; None where nothing does.
        fixed: whether it keeps the robot's limits, and clear of what stands still.
        proof_age: how old the observation is with which it is proven that it can be stopped in time although
            predictions are wrong, s; None where that is not proven.
    """

    candidate: StepCandidate
    proof: ClearanceProof | None
    fixed: bool
    proof_age: float | None

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
    """What is known when a step begins.

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
        seconds: that are left for it when it begins; None where only evaluations count.
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
    search: Search
    seconds: Callable[[], float | None]
    every: float
    rate: float

    @cached_property
    def until_then(self) -> Trajectory:
        """What is executed until the decision takes effect."""
        return lasting(self.executed, self.every).part(0.0, self.every)

    @cached_property
    def state(self) -> MotionState:
        """How the arm moves then."""
        return MotionState.at_end(self.until_then)

    @cached_property
    def rest(self) -> list[Trajectory]:
        """What would go on from then; nothing where the arm stands then."""
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
        """What is executed from now on: what arrives first of what may be executed; a stop where nothing may."""
        old = self.judged(self.old) if self.arrival < inf else None
        best = old if old is not None and old.accepted else None
        moves = direct_moves(self.state, self.goals, self.scene.robot.limits) if self._has_far_to_go else []
        direct = self._direct(moves, inf if best is None else self.arrival)
        if direct is not None:
            return direct
        bound = self.every + min((move.duration for move, *_ in moves), default=inf)
        if best is None or self.arrival > SLOW * bound:
            found = self._way_round([move for move, *_ in moves], inf if best is None else self.arrival)
            best = found or best
        return best or self.stop()

    @property
    def _has_far_to_go(self) -> bool:
        """Whether the arm is not at a goal already when the decision takes effect."""
        return self.state.moves or all(np.abs(goal - self.state.angles).max() > SAME_POSTURE for goal in self.goals)

    def _direct(self, moves: Sequence[tuple[Trajectory, ...]], arrival: float) -> Judged | None:
        """The first of the fastest moves to the goals that may be executed and arrives before another motion."""
        for efforts in moves:
            for move in efforts:
                if self.every + move.duration > SOONER * arrival:
                    break
                judged = self.judged(self.new(move))
                if judged.accepted:
                    return judged
                if judged.fixed or not is_clear(judged.proof):
                    break  # less effort is for motors that cannot give the whole
        return None

    def _way_round(self, moves: Sequence[Trajectory], arrival: float) -> Judged | None:
        """The first motion that is searched for, may be executed, and arrives before another one."""
        if not moves:
            return None
        old = self.rest if self.arrival < inf else []
        obstacles = [obstacle.later(self.every) for obstacle in self.scene.obstacles]
        for found in self.search.best(self.state, self.goals, obstacles, [*old, *moves], self.seconds()):
            if self.every + found.trajectory.duration > SOONER * arrival:
                return None
            judged = self.judged(self.new(found.trajectory, found.x))
            if judged.accepted:
                return judged
        return None

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
        known = self.foreseen if candidate.trajectory is self.executed else None  # of no more than that
        proof = known or self.scene.moving.proof(candidate.trajectory)
        fixed = is_clear(proof) and self._keeps(candidate)
        return Judged(candidate, proof, fixed, 0.0 if fixed and self._can_stop(candidate.trajectory) else None)

    def _judged_stop(self, added: Trajectory, age: float | None) -> Judged:
        """A stop, which an observation of that age may have proven; what is seen now is tried first."""
        candidate = StepCandidate("stop", self.until_then.followed_by(added), added)
        proof, fixed = self.scene.moving.proof(candidate.trajectory), self._keeps(candidate)
        if not fixed:
            return Judged(candidate, proof, fixed, None)
        if not candidate.trajectory.moves or self._uncertain.moving.are_clear_of(candidate.trajectory):
            return Judged(candidate, proof, fixed, 0.0)
        return Judged(candidate, proof, fixed, age if is_clear(proof) else None)

    def _keeps(self, candidate: StepCandidate) -> bool:
        """Whether a motion keeps the robot's limits, and clear of what stands still."""
        if candidate.added is None:
            standing_then = lasting(self.executed, self.executed.duration + self.every)  # at rest, or it jumps
            return self.is_proven or self._is_kept_by(standing_then)
        return (self.is_proven or self._until_then_is_proven) and self._is_kept_by(candidate.added)

    @cached_property
    def _until_then_is_proven(self) -> bool:
        return self._is_kept_by(self.until_then)

    def _is_kept_by(self, trajectory: Trajectory) -> bool:
        return self.scene.fixed.are_clear_of(trajectory) and self.limits.hold(trajectory)

    @cached_property
    def _uncertain(self) -> ObservedScene:
        return self.scene.less_certain(self.rate)

    def _can_stop(self, trajectory: Trajectory) -> bool:
        """Whether a motion, until the next decision takes effect, and a stop from then on are proven."""
        beginning = trajectory.part(0.0, min(2.0 * self.every, trajectory.duration))
        if not beginning.moves:
            return True
        for stop in stops(MotionState.at_end(beginning), self.scene.robot.limits):
            whole = beginning.followed_by(stop)
            if not (self._uncertain.moving.are_clear_of(whole) and self.scene.fixed.are_clear_of(whole)):
                return False  # a stop with less effort takes longer
            if self.limits.hold(stop):
                return True
        return False
