"""The last stage of a plan: the same path, or the fastest way between the same ends, as fast as the limits allow."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from problems import InvalidProblem, Trajectory
from problems.timing.free_space.moving_ends import least_time_move
from problems.timing.rest_to_rest import rest_to_rest
from problems.timing.retime import retime
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.progress import Progress

LOG = logging.getLogger(__name__)
POLISHED = "sequential programs"  # the candidate that changes path and speed
FREE_SPACE = "free space"  # the candidate that is the fastest between its ends where nothing is in the way
SAME_PATH = "same path"  # the candidate that runs the path of the motion before
AS_FAST = 1.0 + 1e-6  # how much slower it may be run and is still the fastest
SAME_OBJECTIVE = 1e-9  # relative: what a path gains or loses when it is run at other times is rounding


@dataclass(frozen=True)
class Retiming:
    """A motion and what became of it when it was timed anew.

    Attributes:
        before: the motion of search and polish.
        after: the best of the candidates, accepted or not; None where none could be made.
        candidate: which of ``CANDIDATES`` that is; empty where there is none.
        seconds: that it took.
    """

    before: Motion
    after: Motion | None
    candidate: str
    seconds: float

    @property
    def accepted(self) -> bool:
        """Whether the other motion is certified and better; if not it is discarded."""
        return self.after is not None and is_better(self.after, self.before)

    @property
    def chosen(self) -> Motion:
        """The better of the two motions."""
        return self.after if self.after is not None and self.accepted else self.before


def is_better(motion: Motion, before: Motion) -> bool:
    """Whether a motion is certified, and the other is not, has a larger objective, or the same one and takes longer."""
    objective = motion.problem.objective
    if not motion.feasible or not before.feasible:
        return motion.feasible
    if objective.timed or not objective.sooner_is_better:
        return motion.objective < before.objective
    same = motion.objective <= before.objective + SAME_OBJECTIVE * abs(before.objective)
    return same and motion.trajectory.duration < before.trajectory.duration


def retimed(before: Motion, progress: Progress) -> Retiming:
    """Time a finished motion anew, in all the ways there are.

    Where free space will do, nothing is faster between the same postures, unless it had to be slowed down for limits
    that it is not made for, as torques are; other postures at the ends may be.
    """
    began = time.perf_counter()
    progress.phase("retiming")
    made: dict[str, Motion] = {}
    settled = False
    for name, make in CANDIDATES.items():
        moves_ends = name == POLISHED and before.problem.ends_may_move
        if settled and not moves_ends:
            continue
        motion, slower = _attempted(make, before)
        if motion is not None:
            made[name] = motion
            settled = settled or (motion.feasible and _settles(name, motion, slower))
    best = min(made, key=lambda name: (made[name].merit, made[name].trajectory.duration), default="")
    seconds = time.perf_counter() - began
    LOG.info("retiming: %s, best of %d in %.3f s", best or "no candidate", len(made), seconds)
    return Retiming(before, made.get(best), best, seconds)


def _settles(name: str, motion: Motion, slower: float) -> bool:
    """Whether nothing faster is to be expected after a certified candidate that was run so much slower than made."""
    if name == FREE_SPACE:
        return slower <= AS_FAST
    return name != POLISHED or motion.problem.is_polished


def _attempted(make: Callable[[Motion], Iterator[Trajectory]], before: Motion) -> tuple[Motion | None, float]:
    """The first certified motion of a candidate, or its last, None where it cannot be made; how much it was slowed."""
    motion, slower = None, 1.0
    try:
        for trajectory in make(before) if before.trajectory.is_finite else ():
            motion = _slowed(replace(before, trajectory=trajectory, retimed=True))
            slower = motion.trajectory.duration / trajectory.duration
            if motion.feasible:
                break
    except InvalidProblem:  # it stands still, for example
        pass
    return motion, slower


def _slowed(motion: Motion) -> Motion:
    """The motion, slower where its limits need it."""
    scale = motion.criteria.safe_time_scale(motion.trajectory)
    return motion if scale <= 1.0 else replace(motion, trajectory=motion.trajectory.time_scaled(scale))


def _polished(before: Motion) -> Iterator[Trajectory]:
    """What sequential linear programs make of it, where the problem has them."""
    return before.problem.polished(before.trajectory)


def _same_path(before: Motion) -> Iterator[Trajectory]:
    """The motion's own path in the least time, unless that is what it is; an end that moves keeps its velocity.

    A nonlinear program that minimises the time under jerk limits leaves nothing to gain, and that would take long; nor
    does a motion that keeps its limits, where sooner may be worse.
    """
    problem = before.problem
    programmed = problem.free_timing and problem.objective.timed and problem.robot.limits.jerk is not None
    slow_enough = before.feasible and problem.objective.chooses_duration
    if before.retimed or programmed or slow_enough:
        return
    start, goal = before.problem.task.end_velocities
    rates = float(start.any()), float(goal.any())
    robot = before.problem.robot
    yield retime(before.path, robot.limits, rates, chain=robot.rigid_chain)


def _free_space(before: Motion) -> Iterator[Trajectory]:
    """The fastest motion between the same ends, where nothing but time counts and nothing is passed on the way."""
    problem = before.problem
    if not (problem.objective.timed and problem.objective.sooner_is_better and problem.task.passes_nothing):
        return
    start, goal = before.trajectory.at(before.trajectory.breakpoints[[0, -1]])
    velocities, limits = problem.task.end_velocities, problem.robot.limits
    if velocities.any():
        yield least_time_move(start, goal, velocities[0], velocities[1], limits)
    else:
        yield rest_to_rest(start, goal, limits)


# the motion in free space first: there is no faster one between two postures
CANDIDATES: dict[str, Callable[[Motion], Iterator[Trajectory]]] = {
    FREE_SPACE: _free_space,
    POLISHED: _polished,
    SAME_PATH: _same_path,
}
