"""Polynomials of degree 5 between states where they meet, with durations of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Self

import casadi as ca

from problems.base import FloatArray, Matrix, Operand
from problems.motions import QUINTIC_HERMITE, BoundaryPieces
from problems.robots import Robot

# The first column belongs to the angle at the start, the fourth to the displacement.
DISPLACED = QUINTIC_HERMITE.copy()
DISPLACED[:, 0] += DISPLACED[:, 3]


@dataclass(frozen=True)
class NodeStates:
    """States where pieces meet, both ends included, (n, k) in rad, rad/s, rad/s^2; durations (n - 1, 1) in s."""

    angles: Matrix
    velocities: Matrix
    accelerations: Matrix
    durations: Matrix

    @classmethod
    def joined(
        cls,
        angles: Sequence[Matrix],
        velocities: Sequence[Matrix],
        accelerations: Sequence[Matrix],
        durations: Sequence[Matrix],
    ) -> Self:
        """The states of a list of rows (1, k)."""
        return cls(*(ca.vertcat(*rows) for rows in (angles, velocities, accelerations, durations)))

    def time_scaled(self, factor: Operand) -> NodeStates:
        """The motion run ``factor`` times slower."""
        slower = self.velocities / factor, self.accelerations / factor**2, self.durations * factor
        return NodeStates(self.angles, *slower)


@dataclass(frozen=True)
class StatePieces(BoundaryPieces[NodeStates]):
    """Polynomials of degree 5 between states, sampled at equal steps of time in each.

    Args:
        robot: that moves.
        count: of pieces.
        steps: of time in each.
    """

    robot: Robot
    count: int
    steps: int

    @property
    def matrices(self) -> tuple[FloatArray, ...]:
        return (DISPLACED,) * self.count

    def boundary_data(self, parameters: NodeStates) -> list[Matrix]:
        q, v, a = parameters.angles, parameters.velocities, parameters.accelerations
        data: list[Matrix] = []
        for i, h in enumerate(ca.vertsplit(parameters.durations)):
            ends = [[v[j, :] * h, a[j, :] * h**2] for j in (i, i + 1)]
            data.append(ca.vertcat(q[i, :], *ends[0], q[i + 1, :] - q[i, :], *ends[1]))
        return data

    def durations(self, parameters: NodeStates) -> Matrix:
        return parameters.durations

    def as_matrices(self, parameters: NodeStates) -> list[Matrix]:
        return [getattr(parameters, field.name) for field in fields(parameters)]

    def from_matrices(self, matrices: Sequence[Matrix]) -> NodeStates:
        return NodeStates(*matrices)
