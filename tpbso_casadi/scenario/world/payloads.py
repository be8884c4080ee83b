"""What a tool carries, as a scenario file states it."""

from __future__ import annotations

from typing import TypeAlias

from problems.robots.rigid.inertia import MASSLESS
from problems.robots.rigid.payload import Payload, planar_payload
from tpbso_casadi.scenario.section import NotNegative, PlanarPoint, Section, SpacePoint

Rows: TypeAlias = tuple[SpacePoint, SpacePoint, SpacePoint]


class PayloadTable(Section):
    """In space: kg, m, kg m^2, in the tool's frame; the inertia is about the centre of mass, a matrix row by row."""

    mass: NotNegative
    center: SpacePoint = (0.0, 0.0, 0.0)
    inertia: Rows = MASSLESS

    def build(self) -> Payload:
        """The payload itself.

        Raises:
            InvalidProblem: a number is out of range, or no body has such an inertia.
        """
        return Payload(mass=self.mass, center=self.center, matrix=self.inertia)


class PlanarPayloadTable(Section):
    """In the plane: kg, m along the last link and to its left, kg m^2 about the centre of mass."""

    mass: NotNegative
    center: PlanarPoint = (0.0, 0.0)
    inertia: NotNegative = 0.0

    def build(self) -> Payload:
        """The payload itself.

        Raises:
            InvalidProblem: a number is out of range, or no body has such an inertia.
        """
        return planar_payload(self.mass, self.center, self.inertia)
