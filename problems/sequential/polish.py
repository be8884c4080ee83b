"""The polish: a motion is fitted by splines, improved by a descent, and timed for the proof."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from problems.base import FloatArray
from problems.limits import Limit, Proximity, TorqueLimit
from problems.motions import Trajectory
from problems.sequential.cover_pairs import CoverPairs
from problems.sequential.descent import PathIterate, PathSpeedDescent
from problems.sequential.limit_rows import MotionLimits
from problems.sequential.pair_clearances import PairClearances
from problems.sequential.path_speed import RESTING, Clock, Freedom, MotionSpace, PathSpeed
from problems.sequential.torques import JointTorques
from problems.tasks import Move
from problems.timing import rest_to_rest

FIT_SAMPLES = 400


def fitted(trajectory: Trajectory, space: MotionSpace) -> PathSpeed:
    """The path nearest to a motion, with the share of its duration as the parameter, run at constant speed."""
    u = np.linspace(0.0, 1.0, FIT_SAMPLES)
    theta = trajectory.at(u * trajectory.duration)
    basis = space.path.matrix(u)
    controls = np.repeat(theta[[0, -1]], [space.path.size - RESTING, RESTING], axis=0)
    controls[:RESTING] = theta[0]
    inner = slice(RESTING, -RESTING)
    fixed = controls.copy()
    fixed[inner] = 0.0
    controls[inner] = np.linalg.lstsq(basis[:, inner], theta - basis @ fixed, rcond=None)[0]
    return PathSpeed(space, controls, np.full(space.speed.size, 1.0 / trajectory.duration))


def bent(motion: PathSpeed, bend: FloatArray) -> PathSpeed:
    """A motion with its path moved sideways, by ``bend`` (k,) rad in the middle and not at the ends."""
    share = np.linspace(0.0, 1.0, len(motion.controls) - 2 * RESTING + 2)[1:-1, None]
    controls = motion.controls.copy()
    controls[RESTING:-RESTING] += 4.0 * share * (1.0 - share) * bend
    return replace(motion, controls=controls)


def delayed(trajectory: Trajectory, seconds: float) -> Trajectory:
    """A motion that first stands still at its start for so many seconds."""
    first = np.zeros_like(trajectory.coefficients[:, :1])
    first[-1, 0] = trajectory.coefficients[-1, 0]
    breakpoints = np.concatenate([[0.0], trajectory.breakpoints + seconds])
    return Trajectory(breakpoints, np.concatenate([first, trajectory.coefficients], axis=1))


LEAST_DELAY = 1e-6  # s
IN_PIECE = 8  # pieces in time for each of the speed


def with_timing(motion: PathSpeed, in_piece: int = IN_PIECE) -> Trajectory:
    """The motion as polynomials of degree 5 in time, with its angles, velocities and accelerations where they meet."""
    grid = motion.space.grid(motion.space.even(in_piece))
    q, (v, a, _) = motion.theta(grid), motion.derivatives(grid)
    steps = Clock(motion.space, grid.u).steps(motion.speeds)
    h = steps[:, None]
    q0, q1 = q[:-1], q[1:]
    v0, v1, a0, a1 = v[:-1] * h, v[1:] * h, a[:-1] * h**2 / 2.0, a[1:] * h**2 / 2.0
    rest = q1 - q0 - v0 - a0
    turn, bend = v1 - v0 - 2.0 * a0, a1 - a0
    scaled = np.stack([6.0 * rest - 3.0 * turn + bend, -15.0 * rest + 7.0 * turn - 2.0 * bend,
                       10.0 * rest - 4.0 * turn + bend, a0, v0, q0])  # fmt: skip
    powers = np.arange(5, -1, -1)[:, None]
    moving = Trajectory(np.concatenate([[0.0], np.cumsum(steps)]), scaled / (steps**powers)[..., None])
    return moving if motion.delay < LEAST_DELAY else delayed(moving, motion.delay)


SPACE = MotionSpace(path_pieces=12, speed_pieces=24)
MOVING_SPACE = replace(SPACE, parts=IN_PIECE)  # where obstacles move
PROOF_MARGINS = (6e-3, 1.2e-2, 2.4e-2)  # m, kept at samples on top of the margin: the next where proofs fail
LEAST_PROOF_MARGIN = 2e-3  # m, tried first among obstacles that move, where a little clearance costs much time
COVER_ROUNDS = 6  # of finding balls of covers that come too near
NEAR_BOUND = 1.02  # times the duration in free space; a motion as fast needs no other start
USUAL_STARTS = 3  # where one of them leads to a clear motion
DELAYS = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)  # durations of a motion, after which it begins
DELAY_TOLERANCE = 2e-3  # s
BENT_STARTS = 8  # where no usual start leads to a clear motion
BEND = 0.7  # rad, the standard deviation of how far these are bent
JOINT_ORDERS = range(4)  # derivatives of the joint angles whose limits are kept


@dataclass(frozen=True)
class PathSpeedPolish:
    """The polish of motions of a task by sequential programs over path and speed.

    Args:
        task: at rest at both ends, with nothing to pass on the way.
        limits: each of a derivative of the joint angles up to the jerk, of torques, or of clearances.
    """

    task: Move
    limits: tuple[Limit, ...]

    @cached_property
    def _nearness(self) -> PairClearances:
        return PairClearances(self.task.robot, tuple(limit for limit in self.limits if isinstance(limit, Proximity)))

    @cached_property
    def _kept(self) -> MotionLimits:
        return MotionLimits(self.task.robot.limits, JointTorques.among(self.limits))

    def __call__(self, start: Trajectory) -> Iterator[Trajectory]:
        """Polished motions from one that may break limits, clear at samples, each with more clearance than the last.

        Where the result is not clear or much slower than without obstacles, others between the same ends are tried too:
        a line, and lines that are bent at random. Of a robot with covers, the best of a few is tried before.
        """
        covered = self.task.robot.cover is not None
        for most in (USUAL_STARTS, None) if covered else (None,):
            best = self._best(start, most)
            is_slow = best.motion.duration > NEAR_BOUND * self._free(start).duration
            if self._nearness.is_time_dependent and best.missing == 0.0 and is_slow:
                yield with_timing(self._descent(best.motion, LEAST_PROOF_MARGIN, self._nearness)(best.motion).motion)
            if best.missing == 0.0:
                yield with_timing(best.motion)
            yield from self._among_covers(best) if covered else self._farther(best)
            if best.missing == 0.0:
                return

    def _farther(self, best: PathIterate) -> Iterator[Trajectory]:
        """Motions with more and more clearance at samples."""
        for proof_margin in PROOF_MARGINS[1:]:
            if best.missing > 0.0:
                return
            best = self._descent(best.motion, proof_margin, self._nearness)(best.motion)
            if best.missing == 0.0:
                yield with_timing(best.motion)

    def _among_covers(self, best: PathIterate) -> Iterator[Trajectory]:
        """Motions among covers, which proofs judge: balls that come too near are added one after the other."""
        pairs = CoverPairs.of(self.task.robot, self.task.obstacles)  # type: ignore[arg-type]
        for proof_margin in PROOF_MARGINS:
            for _ in range(COVER_ROUNDS):
                descent = self._descent(best.motion, proof_margin, pairs.nearness)
                best = descent(best.motion) if pairs.count or best.missing > 0.0 else best
                more = pairs.joined(*descent.samples_of(best.motion), proof_margin)
                if more.count == pairs.count:
                    break
                pairs = more
            if best.missing == 0.0:
                yield with_timing(best.motion)

    def _best(self, start: Trajectory, most: int | None) -> PathIterate:
        """The best motion that starts lead to, so many at the most."""
        starts, bound = islice(self._starts(start), most), NEAR_BOUND * self._free(start).duration
        if not self._nearness.is_time_dependent:
            return self._best_of(starts, self._nearness, bound)
        standing = self._best_of(starts, self._nearness.standing, bound).motion
        starts = islice(self._starts_among_moving(start, standing), most)
        return self._best_of(starts, self._nearness, NEAR_BOUND * standing.duration)

    def _best_of(self, starts: Iterator[PathSpeed], nearness: PairClearances, bound: float) -> PathIterate:
        """The best motion that starts lead to, until it is as fast as a bound in s, or clear after a few of them."""
        best: PathIterate | None = None
        for number, motion in enumerate(starts, start=1):
            clear_one = best is not None and best.missing == 0.0 and nearness.is_time_dependent
            to_beat = best.motion.duration if best is not None and clear_one else np.inf
            iterate = self._descent(motion, PROOF_MARGINS[0], nearness)(motion, to_beat)
            best = iterate if best is None or iterate.better_than(best) else best
            if best.missing == 0.0 and (best.motion.duration <= bound or number >= USUAL_STARTS):
                break
        assert best is not None
        return best

    def _free(self, start: Trajectory) -> Trajectory:
        """The fastest motion between its ends, were there no obstacles."""
        first, last = start.at(start.breakpoints[[0, -1]])
        return rest_to_rest(first, last, self.task.robot.limits)

    def _descent(self, motion: PathSpeed, proof_margin: float, nearness: PairClearances) -> PathSpeedDescent:
        robot = self.task.robot
        freedom = Freedom(robot, self.task.start, self.task.reached_goal(motion.controls[-1]))
        return PathSpeedDescent(motion.space, self._kept, freedom, nearness, robot.margin, proof_margin)

    def _starts(self, start: Trajectory) -> Iterator[PathSpeed]:
        """The motion itself, the free one between its ends, and that bent at random; the same ones every time."""
        yield fitted(start, SPACE)
        free = fitted(self._free(start), SPACE)
        yield free
        yield from self._bent(free)

    def _bent(self, motion: PathSpeed) -> Iterator[PathSpeed]:
        rng = np.random.default_rng(0)
        for _ in range(BENT_STARTS):
            yield bent(motion, rng.normal(0.0, BEND, self.task.robot.dof))

    def _starts_among_moving(self, start: Trajectory, standing: PathSpeed) -> Iterator[PathSpeed]:
        """Starts where obstacles move: the motion itself, the best among those that stand, and both begun later."""
        start_motion, standing = fitted(start, MOVING_SPACE), replace(standing, space=MOVING_SPACE)
        yield from (start_motion, self._later(standing), standing, self._later(start_motion))
        for motion in self._bent(standing):
            yield from (motion, self._later(motion))

    def _later(self, motion: PathSpeed) -> PathSpeed:
        """The motion begun as soon as it is clear, or when least is missing: at some delays, then by bisection."""
        descent = self._descent(motion, PROOF_MARGINS[0], self._nearness)
        first = descent.begun(motion).motion

        def missing(delay: float) -> float:
            return descent.measured(replace(first, delay=delay), 0.0).missing

        delays = [first.duration * share for share in DELAYS]
        lacking = [missing(delay) for delay in delays]
        best = lacking.index(min(lacking))
        before, after = delays[max(best - 1, 0)], delays[best]
        while lacking[best] == 0.0 and after - before > DELAY_TOLERANCE:
            middle = (before + after) / 2.0
            before, after = (before, middle) if missing(middle) == 0.0 else (middle, after)
        return replace(first, delay=after)


def limits_can_be_polished(limits: Sequence[Limit]) -> bool:
    """Whether sequential programs can keep all of some limits."""
    return all(limit.order in JOINT_ORDERS or isinstance(limit, (Proximity, TorqueLimit)) for limit in limits)


def can_be_polished(task: Move, limits: Sequence[Limit]) -> bool:
    """Whether sequential programs can keep all that a task asks for."""
    return limits_can_be_polished(limits) and task.at_rest and task.passes_nothing and task.duration_bounds is None
