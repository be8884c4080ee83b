"""One step of a time law as a linear program of its control points and its duration.

Its variables are shares of a trust region, and the change of the duration; a row touches five neighbouring control
points. Rows join the program where limits are nearly used, and when a solution without them breaks them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import LinearProgram, SingleRows, WholeRows, stacked
from problems.timing.parametrisation import DEGREE, Basis, LawLimits
from problems.timing.settings import DEFAULT_RETIMING, LawSettings


@dataclass(frozen=True, kw_only=True)
class LawProgram:
    """A step of a time law within a trust region.

    Attributes:
        rows: limited values at n samples.
        basis: of the samples.
        controls: the control points from which the step begins, (c,).
        width: how far each may move, (c,); zero for those that are determined.
        by_duration: how far each moves where the duration grows by a small share, (c,).
        usable: share of each limit that may be used, (n,).
        elastic: whether limits may be broken, for a price.
        settings: of the search.
    """

    rows: LawLimits
    basis: Basis
    controls: FloatArray
    width: FloatArray
    by_duration: FloatArray
    usable: FloatArray
    elastic: bool
    settings: LawSettings = DEFAULT_RETIMING.law

    def solved(self) -> tuple[FloatArray, float] | None:
        """Changes of the control points, and of the duration as a share of it; None where there is no solution."""
        values, orders = self.rows.values, self.rows.orders[:, None]
        signs = np.where(values < 0.0, -1.0, 1.0)
        settings = self.settings
        active, last = np.abs(values) > settings.considered, None
        for _ in range(settings.row_rounds):
            solution = self._solution(np.nonzero(active), signs)
            if solution is None:
                break
            last = solution
            after = self.rows.after(self.basis.at(solution[0]), solution[1])
            excess = np.abs(after) - orders * solution[1] - self.usable
            broken = (excess > settings.broken) & ~(active & (np.sign(after) == signs))
            if not broken.any():
                break
            active |= excess > settings.newly_active
            signs[broken] = np.where(after[broken] < 0.0, -1.0, 1.0)
        return last

    def _solution(self, chosen: tuple[NDArray[np.intp], ...], signs: FloatArray) -> tuple[FloatArray, float] | None:
        """The solution with some of the rows, of one sign each."""
        free = np.flatnonzero(self.width > 0.0)
        begin, limits, order = int(free[0]), self._limits(chosen, signs), self._increasing()
        whole = WholeRows.none(DEGREE + 1, 1)
        if self.elastic:
            price = np.full(limits.bound.size, self.settings.row_price)
            whole = WholeRows(limits.first - begin, limits.weights[..., None], limits.by_time, limits.bound, price)
        single = order if self.elastic else stacked([order, limits])
        box = np.ones((free[-1] + 1 - begin, 1))
        moved = replace(single, first=single.first - begin)
        longest = self.settings.largest_change
        solution = LinearProgram(moved, whole, -box, box, (-longest, longest)).solved()
        if solution is None:
            return None
        change = self.by_duration * solution[1]
        change[begin : free[-1] + 1] += self.width[begin : free[-1] + 1] * solution[0][:, 0]
        return change, solution[1]

    def _limits(self, chosen: tuple[NDArray[np.intp], ...], signs: FloatArray) -> SingleRows:
        """Limits of chosen rows and samples, (m,) each."""
        row, sample = chosen
        sign, first = signs[chosen], self.basis.first[sample]
        weights = np.einsum(
            "mp,pmw->mw", sign[:, None] * self.rows.slopes[row, :, sample], self.basis.weights[:, sample]
        )
        near = first[:, None] + np.arange(DEGREE + 1)
        by_duration = sign * self.rows.slowing[chosen] + (weights * self.by_duration[near]).sum(axis=1)
        return SingleRows(
            joint=np.zeros_like(first),
            first=first,
            weights=weights * self.width[near],
            by_time=by_duration - self.rows.orders[row],
            bound=self.usable[sample] - sign * self.rows.values[chosen],
        )

    def _increasing(self) -> SingleRows:
        """Rows that keep control points in order where one of two is free."""
        first = np.flatnonzero((self.width[:-1] > 0.0) | (self.width[1:] > 0.0))
        weights = np.zeros((first.size, DEGREE + 1))
        weights[:, 0], weights[:, 1] = self.width[first], -self.width[first + 1]
        return SingleRows(
            joint=np.zeros_like(first),
            first=first,
            weights=weights,
            by_time=-np.diff(self.by_duration)[first],
            bound=self.settings.most_closing * np.diff(self.controls)[first],
        )
