"""Postures along a path: a few normalised redundancy values, interpolated, and inverse kinematics at its knots."""

from __future__ import annotations

from abc import abstractmethod
from functools import cached_property
from typing import TypeVar

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

from problems.base.matrix import FloatArray, Matrix, Operand, constant, split
from problems.encodings.encoding import Variable
from problems.encodings.knot_postures import KnotPostures
from problems.robots.robot import Robot
from problems.robots.turns import wrap_to
from problems.tasks.elbow import Elbow, elbow_signs

P = TypeVar("P")


class PathEncoding(KnotPostures[P]):
    """Search vectors of x_phi for each redundant link, [the elbow,] and whatever a subclass adds at their end.

    Attributes:
        redundancy_values: how many values of x_phi are decided for each redundant link; 5 in the paper.
    """

    redundancy_values: int

    @property
    @abstractmethod
    def robot(self) -> Robot:
        """The robot that moves."""

    @property
    @abstractmethod
    def elbow(self) -> Elbow:
        """The branch of inverse kinematics."""

    @property
    @abstractmethod
    def knots(self) -> FloatArray:
        """Path parameters of the knots, (M,), from 0 to 1."""

    @property
    @abstractmethod
    def knot_points(self) -> FloatArray:
        """The points at the knots, (M, dim), m."""

    @property
    def posture_variables(self) -> list[Variable]:
        """x_phi of link 3, ..., of link k, [elbow]."""
        extra, values = self.robot.redundancy, range(1, self.redundancy_values + 1)
        listed = [Variable(f"x_phi_{link}[{i}]", 0.0, 1.0, "1") for link in range(3, 3 + extra) for i in values]
        if self.elbow == "free":
            listed.append(Variable("elbow", -1.0, 1.0, "1"))
        return listed

    @cached_property
    def interpolation(self) -> FloatArray:
        """Matrix (M, n) from the decision variables of one link to its values at the knots: a cubic spline."""
        decided = np.linspace(0.0, 1.0, self.redundancy_values)
        return np.asarray(CubicSpline(decided, np.eye(self.redundancy_values))(self.knots))

    def parts(self, x: Matrix) -> tuple[Matrix, Operand, Matrix]:
        """The parts of a search vector: redundancy values (n, redundancy), the elbow's sign, and the rest."""
        extra, free = self.robot.redundancy, int(self.elbow == "free")
        own = extra * self.redundancy_values
        x_phi, branch, rest = split(x, [own, free, len(self.variables) - own - free])
        values = ca.reshape(x_phi, self.redundancy_values, extra)
        return values, elbow_signs(self.elbow, branch, ends=1)[0], rest

    def redundancy_at(self, weights: Matrix, point: Matrix, values: Matrix) -> Matrix:
        """Redundant values (redundancy, 1) at a knot: interpolated by weights (1, n), cut off at 0 and 1, then (7)."""
        normalised = ca.fmin(1.0, ca.fmax(0.0, ca.mtimes(weights, values)))
        return self.robot.restore_redundancy(point, normalised.T)

    def posture(self, point: Matrix, redundancy: Matrix, elbow: Operand, before: Matrix) -> Matrix:
        """Joint angles (1, dof) at a knot, each in the turn nearest those at the knot before."""
        angles, _ = self.robot.inverse(point, redundancy, elbow)
        return wrap_to(angles, before)

    @property
    def knot_rows(self) -> FloatArray:
        """Shares of the decided values, and the point; (M, values + dim)."""
        return np.column_stack([self.interpolation, self.knot_points])

    def posture_before(self, x: Matrix) -> Matrix:
        """The angles near which those of the first knot are wrapped, (1, dof), rad: the middle of their first turn."""
        return self.robot.middle

    def posture_at(self, x: Matrix, row: Matrix, before: Matrix) -> Matrix:
        """Inverse kinematics at a knot, near the posture before."""
        share, point = row[: self.redundancy_values].T, row[self.redundancy_values :]
        values, elbow, _ = self.parts(x)
        return self.posture(point, self.redundancy_at(share, point, values), elbow, before)

    def at_knots(self, x: Matrix) -> tuple[Matrix, Matrix]:
        """Redundant values (M, redundancy) and joint angles (M, dof) at the knots, rad."""
        values, elbow, _ = self.parts(x)
        redundancy: list[Matrix] = []
        theta: list[Matrix] = [self.posture_before(x)]
        for weights, point in zip(self.interpolation, self.knot_points, strict=True):
            target = ca.DM(point)
            redundancy.append(self.redundancy_at(constant(weights[None]), target, values))
            theta.append(self.posture(target, redundancy[-1], elbow, theta[-1]))
        return ca.horzcat(*redundancy).T, ca.vertcat(*theta[1:])

    def postures(self, x: Matrix) -> Matrix:
        """Joint angles at all knots, (M, dof), rad."""
        return self.at_knots(x)[1]
