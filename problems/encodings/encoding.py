"""The interface of encodings: decision variables, the motion that they stand for, and its cost."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

import numpy as np

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray, Matrix
from problems.limits.constraint import Constraint
from problems.limits.limit import Limit
from problems.limits.time_scale import scaling
from problems.motions.motion import Motion

P = TypeVar("P")


@dataclass(frozen=True)
class Variable:
    """One decision variable: name, box and unit."""

    name: str
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Decoded(Generic[P]):
    """The motion that a search vector stands for.

    Attributes:
        parameters: of the motion.
        reach: condition of inverse kinematics, part of the cost; None where every vector can be reached.
    """

    parameters: P
    reach: Constraint | None = None


@dataclass(frozen=True, kw_only=True)
class CostWeights(Statement):
    """The numbers of a cost, which follow from what no candidate can exceed.

    Attributes:
        objective_upper_bound: no feasible candidate costs more, every infeasible one does.
        limit: lambda_1 of (15) and (25), on broken limits.
        reach: lambda_2 of (15), where the arm cannot reach.
    """

    numbers: ClassVar[tuple[str, ...]] = ("objective_upper_bound", "limit", "reach")

    objective_upper_bound: float
    limit: float
    reach: float


class Encoding(Statement, ABC, Generic[P]):
    """The mapping from a search vector to the parameters P of a motion. A subclass is a frozen dataclass.

    Attributes:
        name: of the formulation, as in a scenario file.
        motion: whose parameters it decodes.
        scales_time: whether what is decoded is a shape, which is then run as fast as the limits allow.
    """

    name: ClassVar[str]
    scales_time: ClassVar[bool]
    motion: Motion[P]

    @property
    @abstractmethod
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables, in order."""

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the search box, both (d,)."""
        lower, upper = zip(*((v.lower, v.upper) for v in self.variables), strict=True)
        return np.array(lower), np.array(upper)

    @abstractmethod
    def decode(self, x: Matrix) -> Decoded[P]:
        """The motion of a search vector (d, 1), or its shape where time is scaled afterwards."""

    def restored(self, limits: Sequence[Limit]) -> list[Limit]:
        """The limits that scaling time makes hold at the samples; none where time is not scaled."""
        return scaling(limits) if self.scales_time else []

    def penalised(self, limits: Sequence[Limit]) -> list[Limit]:
        """The limits that a decoded motion can break: those not restored, and what is left of those that are."""
        restored = self.restored(limits)
        broken = [limit for limit in limits if limit not in restored]
        return [*broken, *(static for limit in restored for static in limit.statics)]

    def timed(self, shape: P, limits: Sequence[Limit], peaks: Sequence[Matrix], x: Matrix) -> P:
        """The shape run as fast as the limits allow, given their peaks, or slower where the search vector x says so.

        Unchanged where time is not scaled.
        """
        return shape

    @abstractmethod
    def penalty(self, constraint: Constraint) -> Matrix:
        """The penalty for the rows of a constraint that are broken; scalar, 0 where all hold."""

    @abstractmethod
    def cost(
        self, objective: Matrix, penalties: Sequence[Matrix], reach: Matrix | None, weights: CostWeights
    ) -> Matrix:
        """One number for a metaheuristic: below every infeasible cost exactly when feasible at the samples.

        Args:
            objective: of the motion, scalar.
            penalties: of each constraint over all rows, scalars.
            reach: the condition of inverse kinematics, (1, n), within [-1, 1] where it reaches.
            weights: numbers of this cost.
        """

    @abstractmethod
    def weights(self, objective_upper_bound: float, constraints: Sequence[Constraint]) -> CostWeights:
        """The smallest weights that keep the order feasible < breaks a limit < unreachable.

        Args:
            objective_upper_bound: what the objective cannot exceed in the search box.
            constraints: all that is penalised, over all rows.
        """
