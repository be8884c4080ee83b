"""Limits of joints as MoveIt and ROS state them beside a URDF, in ``joint_limits.yaml``."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Annotated

from problems import InvalidProblem
from problems.base import Count, InvalidTable, Range, at
from problems.robots import ChainJoint, JointKind, RobotDescription
from tpbso_casadi.scenario.validation import LARGEST, NotNegative, Number, Section, Word

MOST_JOINTS = 1_000  # of a file
MOST_NAMED = 10  # joints, in a message
Share = Annotated[float, Range(above=0.0, most=1.0)]


class StatedLimits(Section):
    """The limits of one joint, rad or m, s, N m or N; a number counts unless the switch of its kind is off.

    What is not stated is that of the URDF. What is switched off is not known.
    """

    has_position_limits: bool | None = None
    min_position: Number | None = None
    max_position: Number | None = None
    has_velocity_limits: bool | None = None
    max_velocity: NotNegative | None = None
    has_acceleration_limits: bool | None = None
    max_acceleration: NotNegative | None = None
    has_deceleration_limits: bool | None = None
    max_deceleration: Number | None = None
    has_jerk_limits: bool | None = None
    max_jerk: NotNegative | None = None
    has_effort_limits: bool | None = None
    max_effort: NotNegative | None = None
    has_soft_limits: bool | None = None
    soft_lower_limit: Number | None = None
    soft_upper_limit: Number | None = None
    k_position: Number | None = None
    k_velocity: Number | None = None
    angle_wraparound: bool | None = None

    def check(self) -> None:
        for kind in ("velocity", "acceleration", "deceleration", "jerk", "effort"):
            key = f"max_{kind}"
            switch, value = getattr(self, f"has_{kind}_limits"), getattr(self, key)
            if switch and value is None:
                raise InvalidTable(f"missing key; has_{kind}_limits says that there is one", key)
            if switch is not False and value == 0.0:
                raise InvalidTable(f"0, so it never moves; has_{kind}_limits: false says that none is known", key)

    def limit(self, kind: str, known: float | None = None) -> float | None:
        """A limit that holds both ways; None where none is known.

        Args:
            kind: as the keys have it.
            known: of the robot.
        """
        if getattr(self, f"has_{kind}_limits") is False:
            return None
        stated: float | None = getattr(self, f"max_{kind}")
        return known if stated is None else stated

    def acceleration(self, known: float | None) -> float | None:
        """The limit of acceleration or deceleration, whichever is less.

        Args:
            known: of the robot.
        """
        limits = (self.limit("acceleration", known), self.limit("deceleration"))
        return min((abs(limit) for limit in limits if limit is not None), default=None)

    def range_of(self, joint: ChainJoint) -> tuple[float, float] | None:
        """The range of a joint, within its soft limits; None where none is known."""
        if self.has_position_limits is False:
            return None
        low, high = joint.position or (None, None)
        low = low if self.min_position is None else self.min_position
        high = high if self.max_position is None else self.max_position
        if low is None or high is None:
            return None
        if self.has_soft_limits:
            low = max(low, -LARGEST if self.soft_lower_limit is None else self.soft_lower_limit)
            high = min(high, LARGEST if self.soft_upper_limit is None else self.soft_upper_limit)
        return low, high

    def of(self, joint: ChainJoint) -> ChainJoint:
        """A joint with the range, the speed and the effort that are stated.

        Raises:
            InvalidTable: its range would be empty.
        """
        position = self.range_of(joint)
        if position is not None and not position[0] < position[1]:
            raise InvalidTable(f"the range from {position[0]:g} to {position[1]:g} is empty", "max_position")
        turns_without_end = joint.kind is JointKind.CONTINUOUS and position is None
        return replace(
            joint,
            kind=joint.kind if turns_without_end or not joint.turns else JointKind.REVOLUTE,
            position=position,
            speed=self.limit("velocity", joint.speed),
            effort=self.limit("effort", joint.effort),
        )


class JointLimitsFile(Section):
    """A whole ``joint_limits.yaml``: limits by the names of joints, and the shares of them that MoveIt plans with."""

    default_velocity_scaling_factor: Share = 1.0
    default_acceleration_scaling_factor: Share = 1.0
    joint_limits: Annotated[dict[Word, StatedLimits], Count(1, MOST_JOINTS)] = field(default_factory=dict)

    @classmethod
    def read(cls, text: str) -> JointLimitsFile:
        """The limits that a text states.

        Raises:
            InvalidProblem: ``limits``: the text is no YAML, or states no limits of joints, in one line.
        """
        from tpbso_casadi.scenario.yaml_text import yaml_document  # noqa: PLC0415 (loads a library for these files alone)

        try:
            return cls.from_table(yaml_document(text))
        except ValueError as error:
            raise InvalidProblem("limits", str(error)) from error

    def of(self, description: RobotDescription) -> RobotDescription:
        """A robot with these limits in place of its own.

        Raises:
            InvalidProblem: ``limits`` names no joint of the robot, or leaves one no range.
        """
        chain = description.chain
        names = [joint.name for joint in chain.joints]
        if not self.joint_limits.keys() & {*names}:
            known, named = ", ".join(names), ", ".join(list(self.joint_limits)[:MOST_NAMED])
            raise InvalidProblem("limits", f"states no limit of {known}; it names {named or 'no joints'}")
        limits = [self.joint_limits.get(name, StatedLimits()) for name in names]
        speeds, accelerations = self.default_velocity_scaling_factor, self.default_acceleration_scaling_factor
        joints = []
        for joint, stated in zip(chain.joints, limits, strict=True):
            try:
                with at("joint_limits", joint.name):
                    limited = stated.of(joint)
            except InvalidTable as error:
                raise InvalidProblem("limits", str(error)) from error
            joints.append(replace(limited, speed=None if limited.speed is None else speeds * limited.speed))
        unknown = (None,) * len(names)
        before = (description.max_acceleration or unknown, description.max_jerk or unknown)
        most = [stated.acceleration(known) for stated, known in zip(limits, before[0], strict=True)]
        jerks = tuple(stated.limit("jerk", known) for stated, known in zip(limits, before[1], strict=True))
        return replace(
            description,
            chain=replace(chain, joints=tuple(joints)),
            max_acceleration=tuple(None if each is None else accelerations * each for each in most),
            max_jerk=None if jerks == unknown else jerks,
            notes=(*description.notes, *self._scaled),
        )

    @property
    def _scaled(self) -> list[str]:
        """Notes on the limits that are shares of those of the joints."""
        kinds = ("velocity", "acceleration")
        keys = {kind: f"default_{kind}_scaling_factor" for kind in kinds}
        return [
            f"{kind} limits are {getattr(self, key):g} of those stated: {key}"
            for kind, key in keys.items()
            if getattr(self, key) < 1.0
        ]
