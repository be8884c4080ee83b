"""What is known of pairs before anything moves: how fast each can, and which are computed together."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.arguments import Arguments, Reading
from problems.base.matrix import FloatArray
from problems.evaluation.row_function import RowFunction
from problems.evaluation.step import PARAMETERS
from problems.limits.distances.proximity import Pair
from problems.robots.robot import Robot

KEPT = 16  # robots with their pairs
COMPILED = 64  # formulas of distances, of which functions are kept
AT_ONCE = 1024  # distances that are computed at once


@dataclass(frozen=True)
class KnownPairs:
    """Pairs of a robot's bodies, or of them and obstacles."""

    robot: Robot
    pairs: tuple[Pair, ...]

    @classmethod
    @lru_cache(maxsize=KEPT)
    def of(cls, robot: Robot, pairs: tuple[Pair, ...]) -> KnownPairs:
        """The same object for the same pairs, so that nothing is computed twice."""
        return cls(robot, pairs)

    @cached_property
    def rates(self) -> tuple[FloatArray, FloatArray]:
        """All turns that move any pair, (m, dof), and their levers, (pairs, m), m."""
        numbers: dict[bytes, int] = {}  # of turns
        columns: dict[bytes, list[int]] = {}  # of all turns of a pair
        levers = np.zeros((len(self.pairs), len(self.pairs) * self.robot.dof))
        for row, pair in zip(levers, self.pairs, strict=True):
            turns, own = pair.motion(self.robot)
            key = turns.tobytes()
            if key not in columns:
                columns[key] = [numbers.setdefault(turn.tobytes(), len(numbers)) for turn in turns]
            row[columns[key]] = own
        turns = np.array([np.frombuffer(turn) for turn in numbers]).reshape(-1, self.robot.dof)
        return turns, levers[:, : len(numbers)].copy()

    @cached_property
    def groups(self) -> list[PairGroup]:
        """Pairs that are computed together."""
        groups: dict[Hashable, list[int]] = {}
        for number, pair in enumerate(self.pairs):
            groups.setdefault(pair.group, []).append(number)
        return [
            PairGroup(self.pairs[members[0]], np.array(members), np.array([self.pairs[k].frames for k in members]))
            for members in groups.values()
        ]

    @cached_property
    def thickness(self) -> FloatArray:
        """What their widths take from the distances between their middle lines, (pairs,), m."""
        return np.array([float(pair.thickness) for pair in self.pairs])


@dataclass(frozen=True, eq=False)
class PairGroup:
    """Pairs whose distances have one formula.

    Attributes:
        first: of them.
        members: their numbers, (members,).
        frames: numbers of the frames in which they end, (members, ends).
    """

    first: Pair
    members: NDArray[np.intp]
    frames: NDArray[np.intp]

    @cached_property
    def _formula(self) -> tuple[RowFunction, FloatArray]:
        form, arguments = self.first.form, Arguments()
        arguments.twin(form)
        return _distances(_Formula(Reading(form).make, form)), arguments.values

    def distances(self, times: FloatArray, rows: NDArray[np.intp], ends: list[FloatArray]) -> FloatArray:
        """How far middle lines are apart, (m,), m, less what is kept as time goes by.

        Args:
            times: (n,), s.
            rows: at which of the times, (m,).
            ends: of the lines, each (m, dim), m.
        """
        view, (function, numbers) = self.first.view(times), self._formula
        seen = ends if view is None else [view.at(rows).seen(end) for end in ends]
        distances = np.asarray(function(np.vstack([end.T for end in seen]), numbers)[0])
        rate = self.first.growth_rate
        return distances - rate * times[rows] if rate else distances


@dataclass(frozen=True)
class _Formula:
    """That of a distance; pairs of the same make have the same."""

    make: Hashable
    pair: Pair = field(compare=False)


@lru_cache(maxsize=COMPILED)
def _distances(formula: _Formula) -> RowFunction:
    """How far two middle lines are apart, (1,), m, given their ends as one sees the other, and the numbers of both."""
    arguments = Arguments()
    pair, dim = arguments.twin(formula.pair), formula.pair.dim
    ends = ca.SX.sym("ends", dim * len(pair.frames))
    apart = ca.densify(pair.apart(*(end.T for end in ca.vertsplit(ends, dim))))
    return RowFunction(
        ca.Function("apart", [ends, arguments.symbols], [apart], ["ends", PARAMETERS], ["apart"]), AT_ONCE
    )
