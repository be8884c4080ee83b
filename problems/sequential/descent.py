"""The polish: one linear program after the other, each around the best motion so far."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray
from problems.sequential.freedom import Freedom
from problems.sequential.kept_limits import KeptLimits
from problems.sequential.linear_step import ClearanceRows, best_step, paced
from problems.sequential.nearness import Nearness, NearPairs
from problems.sequential.path_speed import Grid, MotionSpace, PathSpeed

LIMIT_SAMPLES, LIMIT_ROWS = 16, 4  # in each piece of the speed, a sample and, of every so many, rows of a program
CLEARANCE_SAMPLES, CLEARANCE_ROWS = 8, 2  # likewise; rows are also where something is extreme
ITERATIONS = 40
FIRST_TRUST, LEAST_TRUST, LARGEST_TRUST = 0.1, 2e-3, 0.25  # rad, how far a control point may move
GROWS, SHRINKS, FAILS = 1.6, 0.5, 0.3  # the trust region
GOOD, POOR = 0.5, 0.1  # shares of the promised gain
LEAST_GAIN, PATIENCE = 2e-4, 3  # of the duration; and how many iterations may gain less
ENOUGH, AT_ENDS = 0.5, 0.8  # of the spare clearance, and of that of the ends
LOOKED_AT = 1.0  # m/rad: pairs are looked at that come no farther than that beyond what is kept, of the trust region


@dataclass(frozen=True)
class Reached:
    """A motion that keeps the limits of its joints, and how near it comes.

    Attributes:
        motion: as fast as it may be.
        near: its pairs.
        spares: what each of all pairs has to keep at samples on top of the margin, m.
        missing: the sum of the clearances that are missing to the one that is kept, m; 0 where none is.
    """

    motion: PathSpeed
    near: NearPairs
    spares: FloatArray
    missing: float

    def better_than(self, other: Reached) -> bool:
        """Nearer to being clear; if both are, faster."""
        return (self.missing, self.motion.duration) < (other.missing, other.motion.duration)


@dataclass(frozen=True)
class Descent:
    """Sequential linear programs.

    Args:
        space: of motions.
        limits: of the joints.
        freedom: of the ends.
        nearness: of what has to keep a distance.
        kept: that distance, m.
        spare: to keep on top of it at samples, m, where the ends keep more; half of it is enough.
    """

    space: MotionSpace
    limits: KeptLimits
    freedom: Freedom
    nearness: Nearness
    kept: float
    spare: float

    @cached_property
    def _grid(self) -> Grid:
        return self.space.grid(self.space.even(LIMIT_SAMPLES))

    @cached_property
    def _clearance_basis(self) -> FloatArray:
        return self.space.path.matrix(self.space.even(CLEARANCE_SAMPLES))

    def __call__(self, start: PathSpeed) -> Reached:
        """The best motion that steps from a start lead to."""
        trust, idle = FIRST_TRUST, 0
        best = self._reached(replace(start, controls=self.freedom.placed(start.controls)), trust)
        for _ in range(ITERATIONS):
            moves = self.freedom.moves(best.motion.controls)
            linear = self.limits.linear(best.motion, self._grid, LIMIT_ROWS)
            step = best_step(best.motion, self.limits.joints, linear, self._clearances(best, trust), moves, trust)
            if step is None:
                break
            new = self._reached(replace(step.motion, controls=self.freedom.placed(step.motion.controls)), GROWS * trust)
            saved = best.motion.duration - new.motion.duration
            if not new.better_than(best):
                trust *= FAILS
            else:
                share = 1.0 if new.missing < best.missing else saved / max(step.promised, saved, 1e-9)
                trust = min(trust * (GROWS if share > GOOD else SHRINKS if share < POOR else 1.0), LARGEST_TRUST)
                idle = idle + 1 if new.missing == best.missing and saved < LEAST_GAIN * best.motion.duration else 0
                best = new
            if idle == PATIENCE or trust < LEAST_TRUST:
                break
        return best

    def _reached(self, motion: PathSpeed, trust: float) -> Reached:
        """A motion as fast as it may be, and the pairs that may matter in a trust region around it."""
        fast = paced(motion, self.limits, self.limits.linear(motion, self._grid, LIMIT_ROWS), self._grid)
        near = self.nearness.near(self._clearance_basis @ fast.controls, self.kept + self.spare + LOOKED_AT * trust)
        spares = self._spares(near)
        missing = np.maximum(self.kept + ENOUGH * spares[near.pairs] - near.clearances, 0.0)
        return Reached(fast, near, spares, float(missing.sum()))

    def _spares(self, near: NearPairs) -> FloatArray:
        """The spare clearance of each pair, (pairs,): no more than most of what it has at the ends, which are given."""
        spares = np.full(len(self.nearness.pairs), self.spare)
        ends = (near.samples == 0) | (near.samples == len(self._clearance_basis) - 1)
        np.minimum.at(spares, near.pairs[ends], np.maximum(AT_ENDS * (near.clearances[ends] - self.kept), 0.0))
        return spares

    def _clearances(self, around: Reached, trust: float) -> ClearanceRows:
        """Those that may become too small in a step: at the samples of rows, and where a pair is nearest."""
        near = around.near.thinned(CLEARANCE_ROWS)
        gradients = self.nearness.gradients(self._clearance_basis @ around.motion.controls, near)
        room = near.clearances - self.kept - around.spares[near.pairs]
        some = room < np.abs(gradients).sum(axis=1) * trust
        return ClearanceRows(room[some], gradients[some], self._clearance_basis[near.samples[some]])
