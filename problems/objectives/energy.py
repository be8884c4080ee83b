"""Energy: the integral of squared torques."""

from __future__ import annotations

from typing import ClassVar

from problems.base.matrix import Matrix
from problems.objectives.torque_integral import TorqueIntegral


class Energy(TorqueIntegral):
    """E = integral of sum over joints of tau_i^2 dt; N^2 m^2 s. Ours: the paper has no dynamics.

    Proportional to the heat in the windings of motors of the same make, whose current goes with the torque.
    """

    name: ClassVar[str] = "energy"
    symbol: ClassVar[str] = "E"
    unit: ClassVar[str] = "N^2 m^2 s"

    def rate(self, torque: Matrix, speed: Matrix) -> Matrix:
        """tau_i^2."""
        return torque * torque
