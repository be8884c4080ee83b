"""What a tool carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from problems.base.errors import InvalidProblem
from problems.base.ranges import COORDINATES, INERTIAS, MASSES, check_within
from problems.robots.rigid.inertia import Inertia, impossible

KEYS = ("mass", "center", "inertia")


@dataclass(frozen=True, kw_only=True)
class Payload(Inertia):
    """What the tool carries, in the tool's frame; its numbers may change without compiling anything anew.

    Raises:
        InvalidProblem: ``payload.mass``, ``payload.center`` or ``payload.inertia``: the mass is negative, a number is
            out of range, or no body has such an inertia.
    """

    numbers: ClassVar[tuple[str, ...]] = ("mass", "center", "matrix")
    zero_is_structure: ClassVar[tuple[str, ...]] = ("center", "matrix")

    def __post_init__(self) -> None:
        check_within("payload.mass", (self.mass,), (0.0, MASSES[1]), "kg")
        check_within("payload.center", self.center, COORDINATES, "m")
        entries = [entry for row in self.matrix for entry in row]
        check_within("payload.inertia", entries, (-INERTIAS[1], INERTIAS[1]), "kg m^2")
        reason = impossible(self.matrix)
        if reason is not None:
            raise InvalidProblem("payload.inertia", reason)


def planar_payload(mass: float, center: tuple[float, float] = (0.0, 0.0), inertia: float = 0.0) -> Payload:
    """A flat body in the plane of a planar arm.

    Args:
        mass: kg.
        center: of mass, from the tool along the last link and to its left, m.
        inertia: about the centre of mass, kg m^2.

    Raises:
        InvalidProblem: as of a payload.
    """
    check_within("payload.inertia", (inertia,), INERTIAS, "kg m^2")
    half = inertia / 2.0  # of a disc, about its diameters: of no effect on motions in its plane
    matrix = ((half, 0.0, 0.0), (0.0, half, 0.0), (0.0, 0.0, inertia))
    return Payload(mass=mass, center=(*center, 0.0), matrix=matrix)


def planar_payload_of(table: Any) -> Payload:
    """The same from a table of a file.

    Raises:
        InvalidProblem: it is none, or as of a payload.
    """
    if not (isinstance(table, Mapping) and "mass" in table and set(table) <= set(KEYS)):
        raise InvalidProblem("payload", f"a table with a mass is needed; its keys are {', '.join(KEYS)}")
    center, inertia = table.get("center", (0.0, 0.0)), table.get("inertia", 0.0)
    if not (isinstance(center, (list, tuple)) and len(center) == 2):
        raise InvalidProblem("payload.center", "two numbers are needed, along the last link and to its left")
    for key, value in zip(("mass", "inertia", "center", "center"), (table["mass"], inertia, *center), strict=True):
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise InvalidProblem(f"payload.{key}", f"a number is needed, not {value!r}")
    return planar_payload(table["mass"], (center[0], center[1]), inertia)
