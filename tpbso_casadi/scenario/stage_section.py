"""The interface of every stage of a sequence as a table."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Any, ClassVar, Protocol, Self, TypeVar

from problems import Place, Robot
from problems.base import FloatArray
from problems.tasks import ToolPath
from tpbso_casadi.scenario.carried import Contacts
from tpbso_casadi.scenario.constraints import OwnConstraints
from tpbso_casadi.scenario.expressions import ConstraintSection
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.spatial_robots import PayloadTable, PerJoint
from tpbso_casadi.scenario.validation import ANGULAR, Name, NotNegative, Section, Word

OF_THE_ROBOT = ("max_speed", "max_acceleration", "max_jerk", "payload")  # keys that a stage may state anew


class Changing(Protocol):
    """A state of a sequence, as far as stages change it."""

    def attached(self, stage: Any, posture: FloatArray) -> Self:
        """The state with a body in the hand: an obstacle by its name, or one in the tool's frame."""

    def detached(self, name: str, posture: FloatArray) -> Self:
        """The state with a body that was carried standing where it is."""


C = TypeVar("C", bound=Changing)


class StageSection(Section):
    """A table of [[task.stages]]: the interface of every kind.

    Attributes:
        moves: whether the arm moves, which is then planned.
    """

    moves: ClassVar[bool] = False

    kind: Word

    @property
    def pause(self) -> float:
        """How long the arm stands, s."""
        return 0.0

    def changed(self, cell: C, posture: FloatArray) -> C:
        """The state after the stage, if the arm is then in a posture (dof,)."""
        return cell

    def table(self) -> dict[str, Any]:
        return {key: value for key, value in super().table().items() if value not in (None, [], "")}

    def with_files(self, folder: InputFolder) -> Self:
        """The stage with the content of the files that it names."""
        return self

    @property
    def in_stated_turns(self) -> Self:
        """The stage whose joints have the stated values, not those of the nearest turns."""
        return self


class MovingStage(StageSection):
    """A stage in which the arm moves; what it states of contacts, margin, limits and payload holds in it alone.

    Attributes:
        arm: that moves, of a robot with several: places are its own, and others end where they begin; all where None.
    """

    moves: ClassVar[bool] = True

    arm: Name | None = None
    may_touch: Contacts = field(default_factory=list)
    margin: NotNegative | None = None
    constraints: OwnConstraints = field(default_factory=list)
    max_speed: Annotated[PerJoint | None, ANGULAR] = None
    max_acceleration: Annotated[PerJoint | None, ANGULAR] = None
    max_jerk: Annotated[PerJoint | None, ANGULAR] = None
    payload: PayloadTable | None = None

    @property
    def of_the_robot(self) -> dict[str, Any]:
        """Keys of the robot's table that it states anew."""
        stated = {key: getattr(self, key) for key in OF_THE_ROBOT}
        return {key: value for key, value in stated.items() if value is not None}

    @property
    def manner(self) -> dict[str, Any]:
        """The keys on which its motion depends between two postures that are known."""
        return self.table()

    def vias_from(self, robot: Robot, posture: FloatArray) -> list[Place] | None:
        """Places that are passed, if the stage begins in a posture (dof,); none by default."""
        return None

    @property
    def note(self) -> str:
        """A line on what the stage keeps, for whoever reads the plan; empty by default."""
        return ""

    def goals_from(self, robot: Robot, posture: FloatArray) -> Place | list[Place]:
        """The goals of the stage, if it begins in a posture (dof,)."""
        raise NotImplementedError

    def tool_path(self, robot: Robot, posture: FloatArray) -> ToolPath | None:
        """The way of the tool from a posture (dof,) on; None where that is free."""
        return None

    def further_constraints(self, robot: Robot, posture: FloatArray) -> list[ConstraintSection]:
        """Further constraints of the stage besides the stated ones; none by default."""
        return []
