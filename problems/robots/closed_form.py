"""Inverse kinematics in closed form: the postures of a robot whose tool is at a point."""

from __future__ import annotations

from abc import ABC, abstractmethod

from problems.base import FloatArray, Matrix, Operand


class ClosedForm(ABC):
    """Inverse kinematics in closed form: redundant values and a branch of the elbow determine a posture."""

    @property
    @abstractmethod
    def redundancy(self) -> int:
        """The number of values beyond the tool's position that determine a posture."""

    @property
    @abstractmethod
    def stretched(self) -> float:
        """The second joint's angle at which the branches of the elbow meet with the arm stretched, rad."""

    @abstractmethod
    def inverse(self, point: Matrix, redundancy: Matrix, elbow: Operand) -> tuple[Matrix, Matrix]:
        """The posture with the tool at a point.

        Args:
            point: where the tool has to be, (dim, 1), m.
            redundancy: the redundant values, (redundancy, 1).
            elbow: the branch, +1 or -1.

        Returns:
            Joint angles (1, dof), rad, and a number that is within [-1, 1] exactly when the point is reached.
        """

    @abstractmethod
    def restore_redundancy(self, point: Matrix, normalised: Matrix) -> Matrix:
        """Redundant values with which a point (dim, 1) can be reached, from numbers in [0, 1]; both (redundancy, 1)."""

    @abstractmethod
    def redundant_values(self, theta: FloatArray) -> FloatArray:
        """The redundant values of postures (n, dof): (n, redundancy)."""

    @abstractmethod
    def redundancy_ranges(self, theta: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bounds of the redundant values of postures (n, dof) with the tool at points (n, dim); (n, redundancy)."""

    @property
    @abstractmethod
    def middle(self) -> Matrix:
        """The posture around which angles are wrapped, (1, dof), rad."""

    @abstractmethod
    def wrap(self, theta: Matrix) -> Matrix:
        """The posture (1, dof) with each angle in its first turn, rad."""

    @abstractmethod
    def wrap_near(self, theta: Matrix, start: Matrix) -> Matrix:
        """The posture (1, dof) with each angle in the turn nearest ``start``; joint limits decide first."""

    @abstractmethod
    def project_to_point(self, theta: Matrix, point: Matrix) -> Matrix:
        """The posture nearest ``theta`` (1, dof) whose tool is at ``point`` (dim, 1) exactly."""
