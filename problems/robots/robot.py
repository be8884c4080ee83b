"""What a robot is: joints, limits, frames, bodies, how a point is reached."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import (
    ANGLES,
    COORDINATES,
    FloatArray,
    InvalidProblem,
    Matrix,
    Operand,
    Parametric,
    Relaxation,
    as_array,
    check_fields,
    check_within,
)
from problems.robots.arm_cover import ArmCover
from problems.robots.bodies import Bodies
from problems.robots.closed_form import ClosedForm
from problems.robots.dynamics import RigidChain
from problems.robots.inertia import Payload
from problems.robots.joints import JointLimits, Joints
from problems.robots.tool import LastFrame, Tool

RANGE_ROUNDING = 1e-9  # of the range of a joint without ends


@dataclass(frozen=True, kw_only=True)
class Robot(Parametric, ABC):
    """Joints with bodies, of which plans are made.

    A subclass is a frozen dataclass. Every method takes postures of n rows and computes with whatever matrices it is
    given, symbolic or numeric.

    Args:
        margin: what its bodies keep from every obstacle and, with ``self_collision``, from each other, m.
        self_collision: whether its own bodies must not touch.
        may_touch: names of bodies and of obstacles that they may touch.

    Attributes:
        angular: fields that a file may state in degrees: angles, and rates of angles.
        range_field: of the (lowest, highest) position of each joint.
    """

    numbers: ClassVar[tuple[str, ...]] = ("margin",)
    zero_is_structure: ClassVar[tuple[str, ...]] = ("margin",)
    angular: ClassVar[tuple[str, ...]] = ()
    range_field: ClassVar[str] = "joint_limits"

    margin: float = 0.0
    self_collision: bool = False
    may_touch: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        check_within("margin", (self.margin,), (0.0, COORDINATES[1]), "m")

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> Self:
        """The robot that a table of a file describes: its fields by name, lists for tuples.

        Raises:
            InvalidProblem: an unknown, missing or impossible value.
        """
        own = [field for field in fields(cls) if field.name not in Robot.__dataclass_fields__]
        names = [field.name for field in own]
        unknown = next((key for key in settings if key not in names), None)
        if unknown is not None:
            raise InvalidProblem(unknown, f"{cls.__name__} has no such setting; there are {', '.join(names)}")
        for field in own:
            if field.name not in settings and field.default is MISSING and field.default_factory is MISSING:
                raise InvalidProblem(field.name, "missing key")
        for key in set(cls.numbers) & set(settings):
            if not are_numbers(settings[key]):
                raise InvalidProblem(key, f"numbers are needed, not {settings[key]!r}")
        return cls(**{key: _as_tuple(value) for key, value in settings.items()})

    @property
    @abstractmethod
    def dof(self) -> int:
        """The number of joints."""

    @property
    @abstractmethod
    def limits(self) -> JointLimits:
        """Limits of the joints."""

    @property
    def dim(self) -> int:
        """The dimension: 2 in the plane, 3 in space."""
        return 2

    @property
    def joints(self) -> Joints:
        """Names and units of the joints; numbered by default, and turning."""
        numbers = range(1, self.dof + 1)
        return Joints(
            names=tuple(f"joint {joint}" for joint in numbers),
            identifiers=tuple(f"joint_{joint}" for joint in numbers),
            units=("rad",) * self.dof,
        )

    @property
    def by_tool(self) -> tuple[Robot, ...]:
        """The robot with each of its tools as the one that it has; itself by default."""
        return (self,)

    @property
    def arms(self) -> Mapping[str, tuple[int, ...]]:
        """Numbers, from 0, of the joints of each arm, by the arms' names, where there are several; none by default."""
        return {}

    @property
    def endless(self) -> tuple[bool, ...]:
        """Whether each joint turns without end: values a whole turn apart are one posture."""
        ranges = self.limits.position or (ANGLES,) * self.dof
        errors = self.joint_errors or (0.0,) * self.dof
        reach = (high - low + 2.0 * error for (low, high), error in zip(ranges, errors, strict=True))
        whole = (1.0 - RANGE_ROUNDING) * (ANGLES[1] - ANGLES[0])
        return tuple(unit == "rad" and each >= whole for unit, each in zip(self.joints.units, reach, strict=True))

    @property
    def base(self) -> tuple[float, ...]:
        """The place of the base, m; the origin by default."""
        return (0.0,) * self.dim

    @cached_property
    def position_count(self) -> int:
        """How many matrices ``positions`` gives."""
        return len(self.positions(ca.DM.zeros(1, self.dof)))

    @abstractmethod
    def positions(self, theta: Matrix) -> tuple[Matrix, ...]:
        """Forward kinematics: where the frames are, base first and tool last, each (n, dim), m; theta (n, dof), rad."""

    @property
    def tool(self) -> Tool:
        """The tool; in the last frame by default."""
        return LastFrame(self.positions)

    @property
    def strokes(self) -> tuple[slice, ...]:
        """The points of :meth:`skeleton` that make a line each, from a base to a tool; all of them by default."""
        return (slice(None),)

    def skeleton(self, theta: FloatArray | Matrix) -> FloatArray:
        """Positions of base, joints and tool, for drawing: (n, frames, dim), m; postures (n, dof), rad."""
        return np.stack([as_array(matrix) for matrix in self.positions(ca.DM(theta))], axis=1)

    @property
    @abstractmethod
    def bodies(self) -> Bodies:
        """The bodies that must not touch anything."""

    @property
    def cover(self) -> ArmCover | None:
        """A cover of its links, finer than its bodies, by which verdicts are made; None where the bodies are all."""
        return None

    @abstractmethod
    def reach(self, links: int | None = None) -> tuple[float, float]:
        """The smallest and largest distance in m from the base at which the end of so many links can be."""

    @property
    def radius(self) -> Operand:
        """The largest distance in m that the tool can have from the base; symbolic where the robot is."""
        return self.reach()[1]

    @property
    def length_unit(self) -> float:
        """The unit of lengths in nonlinear programs, m: half the reach, down to a power of two (exact)."""
        return float(2.0 ** np.floor(np.log2(self.reach()[1] / 2.0)))

    @property
    def touching(self) -> Self:
        """The robot without margin: bodies may come near, but must not touch."""
        return replace(self, margin=0.0)

    def within(self, errors: tuple[float, ...]) -> Self:
        """The robot whose joints may be off by errors (dof,), rad or m, besides those that they have already.

        Raises:
            InvalidProblem: nothing is known of such a robot, or errors are too large.
        """
        raise InvalidProblem("robot", f"{type(self).__name__} has no tracking error")

    @property
    def at_any_speed(self) -> Self:
        """The robot whose joints may be off at any speed and acceleration as far as they may be at their limits."""
        return self

    @property
    def assumed(self) -> str:
        """The condition under which ``certified`` is true, in words to stand behind it; empty without one."""
        return ""

    @property
    def locked(self) -> tuple[tuple[str, float], ...]:
        """Joints that are not planned with, by the controller's names, and where each stands, rad or m."""
        return ()

    @property
    def joint_errors(self) -> tuple[Any, ...] | None:
        """The largest distance of each joint from where it is planned, rad or m; None where all follow exactly."""
        return None

    @property
    def unjudged(self) -> tuple[str, ...]:
        """Lines on what no verdict covers, although it is or may be there: contacts that are allowed."""
        return tuple(f"contact of {body} and {obstacle}, which may touch" for body, obstacle in self.may_touch)

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        """The relaxations of its load, where it has a payload."""
        payload = getattr(self, "payload", None)
        return payload.relaxations if isinstance(payload, Payload) else ()

    @property
    def rigid_chain(self) -> RigidChain | None:
        """The joints with the bodies that they move, the payload included; None where masses are not known."""
        return None

    @property
    def dynamics(self) -> RigidChain:
        """The rigid chain, which has to be known: it gives the torques of motions.

        Raises:
            InvalidProblem: masses are not known.
        """
        chain = self.rigid_chain
        if chain is None:
            raise InvalidProblem("robot", "no masses are known, so that torques are not")
        return chain

    @property
    def closed_form(self) -> ClosedForm:
        """The robot's inverse kinematics in closed form.

        Raises:
            InvalidProblem: it has none.
        """
        raise InvalidProblem("robot", f"{type(self).__name__} has no inverse kinematics in closed form")


def _as_tuple(value: Any) -> Any:
    """The value with lists as tuples, all the way down."""
    return tuple(_as_tuple(entry) for entry in value) if isinstance(value, (list, tuple)) else value


def are_numbers(value: Any) -> bool:
    """Whether a value is a number, or a list of numbers or of such lists."""
    if isinstance(value, (list, tuple)):
        return all(are_numbers(entry) for entry in value)
    return isinstance(value, (int, float)) and not isinstance(value, bool)
