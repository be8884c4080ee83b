"""A problem as a smooth nonlinear program, for solvers that follow gradients.

Its variables are the arm's own quantities instead of a search vector: kinematics and splines become equalities, so
that nothing has a kink or an edge. Its rows come from the same :class:`Constraint` objects as the penalty and the
verification.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np

from problems.assembly.problem import SAMPLING_MARGIN
from problems.base.matrix import FloatArray, Matrix, differences
from problems.limits.constraint import Constraint
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.robots.planar import PlanarArm

SMOOTHING = 1e-3  # m: rounds the corner of a tip that stands still; costs 1e-4 of a length


class NonlinearProgram(ABC):
    """Minimise f(x) subject to bounds of the rows g(x) and of the variables x."""

    @property
    @abstractmethod
    def x(self) -> ca.SX:
        """The variables, (n, 1)."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the variables, n."""

    @property
    @abstractmethod
    def f(self) -> Matrix:
        """The objective."""

    @abstractmethod
    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        """All rows; equalities are those whose bounds are the same. The margin changes bounds alone."""

    @abstractmethod
    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the variables, (n,), in the turn of the angles of a start (n,)."""

    @abstractmethod
    def from_search(self, x: FloatArray) -> FloatArray:
        """The variables (n,) of a search vector (d,)."""

    @abstractmethod
    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """The variables (n,) of a motion of the task's own form."""

    @abstractmethod
    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        """Endless random starts (n,) that meet the task's points by inverse kinematics."""

    @abstractmethod
    def trajectory(self, x: FloatArray) -> Trajectory:
        """The exact trajectory of a solution, as fast as the limits allow for all t where time is free."""

    @abstractmethod
    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The arm's own quantities (the paper's symbols) of a solution."""

    @property
    def g(self) -> Matrix:
        """All rows of all constraints, (r, 1), each divided by its scale."""
        return ca.densify(ca.vertcat(*(constraint.row_values() for constraint in self.constraints(SAMPLING_MARGIN))))

    def row_bounds(self, margin: float | None = None) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the rows, both (r,).

        Args:
            margin: to keep at the samples for what lies between them, as a share of the reach and of the joints'
                ranges; ``SAMPLING_MARGIN`` if None.
        """
        pairs = [constraint.row_bounds() for constraint in self.constraints(margin or SAMPLING_MARGIN)]
        lower, upper = (np.concatenate(side) for side in zip(*pairs, strict=True))
        return lower, upper


def equality(name: str, expression: Matrix, unit: str, column_names: Sequence[str], formula: str) -> Constraint:
    """``expression == 0``, one column a name."""
    zero, one = np.zeros(len(column_names)), np.ones(len(column_names))
    return Constraint(
        name, "-", unit, expression, zero, zero, tuple(column_names), one, for_all_t=False, formula=formula
    )


def smooth_length(arm: PlanarArm, samples: Samples) -> Matrix:
    """(10) with corners rounded off by ``SMOOTHING``; m."""
    steps = differences(arm.tip(samples.theta))
    squares = ca.sum2(steps * steps)
    return ca.sum1(ca.sqrt(squares + SMOOTHING**2) - SMOOTHING)


def rotation_rows(arm: PlanarArm, samples: Samples, slack: ca.SX) -> list[Constraint]:
    """(9) without its kink: slacks (n - 1, k) no smaller than the increments of both signs; rad."""
    increments = differences(samples.theta)
    zero, endless, one = np.zeros(arm.links), np.full(arm.links, np.inf), np.ones(arm.links)
    joints = tuple(f"joint {joint}" for joint in range(1, arm.links + 1))
    return [
        Constraint(
            f"rotation {name}",
            "(9)",
            "rad",
            slack - step,
            zero,
            endless,
            joints,
            one,
            for_all_t=False,
            formula=f"slack_ij >= {sign}(theta_i(t_j+1) - theta_i(t_j))",
        )
        for name, sign, step in (("forward", "+", increments), ("backward", "-", -increments))
    ]
