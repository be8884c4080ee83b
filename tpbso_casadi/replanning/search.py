"""The search for a way round, step after step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from problems import InvalidProblem, Joints, LimitKind, Move, Obstacle, Robot, TimeMoveProblem, Trajectory, time_move
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions
from problems.timing import MotionState
from solvers import PSO, Archive, Budget, SearchBox, minimize

MEMBERS = 80  # of a swarm whose iterations take little time of their own: a step has little
KEPT = 8  # candidates of a search from which the next one begins
QUINTICS = 4  # durations of the motions in free space from which it begins too
PROVEN = 3  # the best of a search are proven, in order of cost


class SuccessiveSearches:
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
        self._last: tuple[Move, TimeMoveProblem] | None = None
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
        if self._last is None:
            start, (speeds, changes) = Joints(tuple(state.angles.tolist())), (tuple(rate.tolist()) for rate in rates)
            task = Move(self._robot, start, places, (), "free", tuple(obstacles), speeds, start_acceleration=changes)
            problem = time_move(task, limits=self._further)
        else:
            task = self._last[0].observed((state.angles, *rates), tuple(obstacles), places)
            problem = self._last[1].same_structure_with(task)
        self._last = task, problem
        return problem

    def best(
        self,
        state: MotionState,
        goals: Sequence[FloatArray],
        obstacles: Sequence[Obstacle],
        known: Sequence[Trajectory],
        seconds: float | None,
    ) -> Iterator[tuple[Trajectory, FloatArray]]:
        """The best motions with their search vectors (d,), the fastest first, as far as they keep all at their samples.

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
        box = SearchBox(*problem.bounds)
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
                yield problem.trajectory(x), x

    def _first(self, problem: TimeMoveProblem, known: Sequence[Trajectory]) -> FloatArray:
        """Given motions as candidates, and those of the search before, where these have the same variables."""
        width = len(problem.bounds[0])
        rows = [problem.nearest_candidate(trajectory)[None] for trajectory in known]
        kept = self._known if self._known.shape[1] == width else np.empty((0, width))
        return np.concatenate([*rows, problem.quintics(QUINTICS), kept])


def _clipped(values: FloatArray, most: tuple[float, ...]) -> FloatArray:
    """Rates that are beyond their limits by rounding at most, within these."""
    return np.clip(values, -np.array(most), np.array(most))


def _compiled_at_once() -> EvaluationOptions:
    """The usual options, but for waiting until something is worth compiling: a step has no time for it."""
    usual = EvaluationOptions()
    return replace(usual, backend="native") if usual.backend == "auto" else usual
