"""Masses: inertia of a body, of bodies together, and the payload."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from problems.base import (
    COORDINATES,
    INERTIAS,
    MASSES,
    FloatArray,
    InvalidProblem,
    Operand,
    Parametric,
    Relaxation,
    check_within,
)
from problems.robots.transform import (
    Matrix3,
    Point3,
    Rotation,
    Transform,
    Vector,
    added,
    as_point,
    compose,
    outer,
    plus,
    scaled,
    times,
    transposed,
)

MOMENT_ROUNDING = 1e-6  # of the largest principal moment: what figures with few digits may be off by
MASSLESS: Matrix3 = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@dataclass(frozen=True, kw_only=True)
class Inertia(Parametric):
    """The mass of a body and its distribution.

    Attributes:
        mass: kg.
        center: of mass in the body's frame, m.
        matrix: of inertia about the centre of mass, in the axes of the body's frame, kg m^2.
    """

    mass: float
    center: Point3 = (0.0, 0.0, 0.0)
    matrix: Matrix3 = MASSLESS

    def moments(self) -> Moments:
        """The moments about the origin of the body's frame."""
        return Moments.of(self, Transform())


def moved_inertia(inertia: Inertia, pose: Transform) -> Inertia:
    """A body's mass as seen from the frame in which its own frame has this pose."""
    turn = np.array(pose.rotation, dtype=float)
    center = turn @ np.array(inertia.center) + np.array(pose.translation, dtype=float)
    return Inertia(
        mass=inertia.mass, center=as_point(center), matrix=as_matrix(turn @ np.array(inertia.matrix) @ turn.T)
    )


def combined(parts: Sequence[Inertia]) -> Inertia | None:
    """Several masses in one frame as one (parallel axes theorem); None where there are none."""
    if not parts:
        return None
    mass = sum(part.mass for part in parts)
    if mass == 0.0:
        return Inertia(mass=0.0)
    center = np.sum([part.mass * np.array(part.center) for part in parts], axis=0) / mass
    matrix = np.sum(
        [np.array(part.matrix) + part.mass * _spread(np.array(part.center) - center) for part in parts], axis=0
    )
    return Inertia(mass=mass, center=as_point(center), matrix=as_matrix(matrix))


def _spread(offset: FloatArray) -> FloatArray:
    """The inertia of 1 kg at an offset from the axes' origin, m^2."""
    return float(offset @ offset) * np.eye(3) - np.outer(offset, offset)


def as_matrix(matrix: FloatArray) -> Matrix3:
    """Numbers (3, 3) as tuples."""
    one, two, three = (as_point(row) for row in matrix)
    return one, two, three


@dataclass(frozen=True, eq=False)
class Moments:
    """The moments of a mass about the origin of a frame; those of bodies fixed together add up.

    Attributes:
        mass: kg.
        first: the integral of r over the masses, mass times centre, kg m.
        second: the integral of r r^T, kg m^2; the inertia is its trace times the identity, less itself.
    """

    mass: Operand
    first: Vector
    second: Rotation

    @classmethod
    def of(cls, inertia: Inertia, pose: Transform) -> Moments:
        """The moments of a body whose frame is posed in another, about the origin of that one."""
        center = pose.apply(inertia.center)
        first = scaled(center, inertia.mass)
        turned = compose(compose(pose.rotation, _second(inertia.matrix)), transposed(pose.rotation))
        return cls(inertia.mass, first, _sum(turned, outer(first, center)))

    def __add__(self, other: Moments) -> Moments:
        return Moments(plus(self.mass, other.mass), added(self.first, other.first), _sum(self.second, other.second))


def _sum(one: Rotation, two: Rotation) -> Rotation:
    first, second, third = (
        (plus(a[0], b[0]), plus(a[1], b[1]), plus(a[2], b[2])) for a, b in zip(one, two, strict=True)
    )
    return first, second, third


def _second(inertia: Rotation) -> Rotation:
    """The integral of r r^T from the inertia about the same point."""
    half = times(0.5, plus(plus(inertia[0][0], inertia[1][1]), inertia[2][2]))
    (a, xy, xz), (yx, b, yz), (zx, zy, c) = inertia
    return (
        (plus(half, -a), -xy, -xz),
        (-yx, plus(half, -b), -yz),
        (-zx, -zy, plus(half, -c)),
    )


def inertia_fault(matrix: Matrix3) -> str | None:
    """The reason why no body of positive density has this inertia (kg m^2) about its centre of mass, or None.

    Principal moments are sums of two of three variances each, so that none is negative or above the sum of the others.
    """
    inertia = np.array(matrix)
    room = MOMENT_ROUNDING * float(np.abs(inertia).max())
    if float(np.abs(inertia - inertia.T).max()) > room:
        return "the matrix is not symmetric"
    one, two, three = np.linalg.eigvalsh(inertia).tolist()
    moments = f"principal moments {one:.3g}, {two:.3g} and {three:.3g} kg m^2"
    if one < -room:
        return f"{moments}: one is negative"
    return f"{moments}: the largest is above the sum of the others" if three > one + two + room else None


KEYS = ("mass", "center", "inertia")


@dataclass(frozen=True, kw_only=True)
class Payload(Inertia):
    """A load of the tool, in its frame; its numbers may change without compiling anything anew.

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
        reason = inertia_fault(self.matrix)
        if reason is not None:
            raise InvalidProblem("payload.inertia", reason)

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        """The relaxation of the load's mass, where it has one."""

        def lighter(by: float) -> dict[str, object]:
            return {"mass": self.mass - by}

        own = Relaxation(limit="payload", of="mass", statement=self, values=lighter, size=self.mass, unit="kg")
        return (own,) if self.mass else ()


def planar_payload(mass: float, center: tuple[float, float] = (0.0, 0.0), inertia: float = 0.0) -> Payload:
    """The payload of a flat body in the plane of a planar arm.

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
    """The payload of a planar arm from a table of a file.

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
