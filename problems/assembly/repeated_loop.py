"""The loop over samples and over things of one make, as steps of a program: all obstacles that are boxes, say.

Where a limit says the same of many things, code for one of them is compiled, and called for each with its own numbers:
it stays small however many there are, and another number of them compiles nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base.matrix import Matrix
from problems.evaluation import Loop, Step
from problems.limits.constraint import Constraint
from problems.limits.limit import SAMPLING_MARGIN, Repetition
from problems.motions.samples import Samples
from problems.robots.robot import Robot

PLACES = "places"  # of the frames at each sample, m
REPEATED = "repeated"  # the penalties, one for each repetition


@dataclass(frozen=True)
class RepeatedLoop:
    """Steps that add up what repetitions make of each sample.

    Args:
        robot: the symbolic twin of the robot that moves.
        repetitions: at least one.
        durations: how many parts of the motion have one.
    """

    robot: Robot
    repetitions: Sequence[Repetition]
    durations: int

    @property
    def frames(self) -> list[int]:
        """Whose positions are needed at each sample."""
        return sorted({frame for repetition in self.repetitions for frame in repetition.frames})

    @property
    def timed(self) -> bool:
        """Whether times are needed."""
        return any(repetition.timed for repetition in self.repetitions)

    def places(self, now: Samples) -> Matrix:
        """Their positions at one sample, one after the other, m, and the time, s, where it is needed: a column."""
        parts = [now.positions[frame] for frame in self.frames]
        if self.timed:
            assert now.times is not None
            parts.append(now.times)
        return ca.horzcat(*parts).T

    def steps(self, p: ca.SX, samples: int, penalty: Callable[[Constraint], Matrix]) -> list[Step]:
        """One step for each repetition, which runs for all of its things at each sample.

        Args:
            p: the numbers of the statement.
            samples: how many there are.
            penalty: of the rows of a constraint.
        """
        return [self._step(k, p, samples, penalty) for k in range(len(self.repetitions))]

    def _step(self, number: int, p: ca.SX, samples: int, penalty: Callable[[Constraint], Matrix]) -> Step:
        repetition, dim = self.repetitions[number], self.robot.dim
        size = len(self.frames) * dim
        window, sums = ca.SX.sym("window", size + self.timed), ca.SX.sym(REPEATED, len(self.repetitions))
        durations = ca.SX.sym("durations", self.durations)
        places = dict(zip(self.frames, ca.horzsplit(window[:size].T, dim), strict=True))
        unused = ca.DM.nan(1, dim)
        positions = tuple(places.get(frame, unused) for frame in range(max(self.frames) + 1))
        times = window[size:] if self.timed else None
        duration = ca.sum1(durations) if repetition.timed else ca.SX(1)
        now = Samples(robot=self.robot, derivatives=(), duration=duration, times=times, known_positions=positions)
        entries = ca.vertsplit(sums)
        for limit in repetition.limits:
            found = sum((penalty(constraint) for constraint in limit.at(now, SAMPLING_MARGIN)), ca.DM(0))
            near = limit.may_break(now, SAMPLING_MARGIN)
            entries[number] += found if near is None else ca.if_else(near, found, 0.0)
        clock = {"durations": durations} if repetition.timed else {}
        inputs = {"p": p, **clock, "window": window, "row": repetition.symbols, REPEATED: sums}
        outputs = {REPEATED: ca.vertcat(*entries)}
        things = len(repetition.numbers)
        starts = np.repeat(np.arange(samples) * window.numel(), things)
        loop = Loop(rows=np.tile(repetition.numbers, (samples, 1)), window=PLACES, starts=starts)
        return Step.of("repeated", inputs, outputs, loop)
