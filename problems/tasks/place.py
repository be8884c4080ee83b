"""Places to start from, pass or reach: postures and positions; elbows up and down."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar, Literal, TypeAlias, get_args

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import ANGLES, Angle, FloatArray, InvalidProblem, Matrix, Operand, Parametric, as_array, check_within
from problems.robots import Robot
from problems.scene import Obstacle
from problems.tasks.checks import check_holding, check_point, check_posture

Elbow: TypeAlias = Literal["up", "down", "free"]
Turns: TypeAlias = Literal["nearest", "exact"]


def check_elbow(robot: Robot, elbow: Elbow) -> None:
    """Raise InvalidProblem where the limits of joint 2 exclude the whole half turn of its elbow, or there is none."""
    if robot.dim != 2 and elbow != "free":
        raise InvalidProblem("elbow", f"{elbow!r} does not apply to a robot in space; leave it out")
    if robot.limits.position is not None and elbow != "free":
        low, high = robot.limits.position[1]
        if half_turn(elbow, (low + high) / 2.0, (low, high), robot.closed_form.stretched) is None:
            raise InvalidProblem(
                "joint_limits", f"joint 2: with the elbow {elbow} it cannot be within {low} and {high}"
            )


def half_turn(
    elbow: Elbow, theta_2: float, within: tuple[float, float], stretched: float = 0.0
) -> tuple[float, float] | None:
    """The range of theta_2 with the elbow up (sin theta_2 >= 0) or down, rad.

    Args:
        elbow: ``up`` or ``down``.
        theta_2: of several half turns the nearest to this angle is taken.
        within: the limits of joint 2.
        stretched: theta_2 of the stretched arm, see :attr:`ClosedForm.stretched`.

    Returns:
        The part of that half turn that lies within the limits; None when no half turn does.
    """
    low = stretched if elbow == "up" else stretched - pi
    nearest = int(np.rint((theta_2 - low - pi / 2.0) / (2.0 * pi)))
    for turn in sorted(range(nearest - 2, nearest + 3), key=lambda n: abs(n - nearest)):
        interval = max(low + 2.0 * pi * turn, within[0]), min(low + pi + 2.0 * pi * turn, within[1])
        if interval[0] < interval[1]:
            return interval
    return None


def narrow_elbow(robot: Robot, elbow: Elbow, x: FloatArray, index: int, lower: FloatArray, upper: FloatArray) -> None:
    """Narrow, in place, the bounds of a theta_2 among the variables to the half turn of its elbow nearest to it."""
    if elbow == "free":
        return
    within = float(lower[index]), float(upper[index])
    interval = half_turn(elbow, float(x[index]), within, robot.closed_form.stretched)
    if interval is not None:
        lower[index], upper[index] = interval


def check_holding_at(robot: Robot, elbow: Elbow, field: str, point: tuple[float, ...], name: str = "") -> None:
    """Check that the motors can hold one of finitely many postures with the tool at a point.

    Raises:
        InvalidProblem: they can hold none.
    """
    if robot.limits.torque is None or robot.dim != 2 or robot.closed_form.redundancy:
        return
    signs = [sign for sign, branch in ((1.0, "up"), (-1.0, "down")) if elbow in (branch, "free")]
    found = [robot.closed_form.inverse(ca.DM(point), ca.DM(0, 1), sign)[0] for sign in signs]
    check_holding(robot, field, as_array(ca.vertcat(*found)), name)


def elbow_signs(elbow: Elbow, branch: Matrix, ends: int) -> list[Operand]:
    """The sign of the elbow, +1 (up) or -1 (down), for each end; of search variables when it is free."""
    if elbow == "free":
        return [ca.if_else(branch[i] < 0.0, -1.0, 1.0) for i in range(ends)]
    return [1.0 if elbow == "up" else -1.0] * ends


ANGLE_TOLERANCE = 1e-9  # rad; allows for rounding only


@dataclass(frozen=True)
class Choice:
    """A number that is free at a place.

    Attributes:
        name: for a variable, before that of the stop.
        index: for a variable, behind it.
        lower: the least that it may be.
        upper: the most.
    """

    name: str
    index: str
    lower: float
    upper: float


class Place(Parametric, ABC):
    """A condition on one posture of a motion. A subclass is a frozen dataclass.

    Attributes:
        chosen_by_inverse_kinematics: whether redundancy values and a branch of the elbow determine the posture.
        always_reached: whether every choice of a posture is one that is there.
        within: how far from it a motion may pass: m of the tool, or rad of all joints together.
        cost: added to what is minimised, where motions to several goals are compared, in its unit.
    """

    inert: ClassVar[tuple[str, ...]] = ("cost",)
    chosen_by_inverse_kinematics: ClassVar[bool]
    always_reached: ClassVar[bool] = True
    within: float
    cost: float

    @property
    @abstractmethod
    def unit(self) -> str:
        """The unit of :meth:`miss`."""

    @abstractmethod
    def check(self, robot: Robot, obstacles: Sequence[Obstacle], field: str, name: str = "") -> None:
        """Check that the robot can be there.

        Args:
            robot: that moves.
            obstacles: to keep clear of.
            field: of the task, for messages.
            name: says more than the field where it is one of several.

        Raises:
            InvalidProblem: it cannot.
        """

    def check_holding(self, robot: Robot, elbow: Elbow, field: str, name: str = "") -> None:
        """Check that the motors can hold the robot there, as far as a place decides that; nothing by default.

        Args:
            robot: that moves.
            elbow: the branches that there are.
            field: of the task, for messages.
            name: says more than the field where it is one of several.

        Raises:
            InvalidProblem: they cannot.
        """

    def choices(self, robot: Robot) -> tuple[Choice, ...]:
        """The numbers, besides a branch of the elbow, that are free here; none by default."""
        return ()

    def branches(
        self, robot: Robot, obstacles: Sequence[Obstacle], near: FloatArray | None, field: str
    ) -> tuple[Place, ...]:
        """The places to tell apart where inverse kinematics finds several postures; itself by default.

        Args:
            robot: that moves.
            obstacles: to keep clear of.
            near: a posture (dof,) in the turns nearest to which joints are taken, rad; the middle of their limits where
                None.
            field: of the task, for messages.

        Raises:
            InvalidProblem: no posture there is clear.
        """
        return (self,)

    def on_branch(self, theta: FloatArray) -> Place:
        """The place with a posture (dof,) that is there as its branch; itself where it has none."""
        return self

    @property
    def branch_angles(self) -> tuple[float, ...]:
        """The posture that :meth:`on_branch` was given, digit for digit, rad; empty where there is none."""
        return ()

    @abstractmethod
    def posture(
        self, robot: Robot, chosen: Matrix, elbow: Operand, near: Matrix | None
    ) -> tuple[Matrix, Matrix | None]:
        """A posture at the place, from free choices.

        Args:
            robot: that moves.
            chosen: values of :meth:`choices`, (choices, 1).
            elbow: the branch, +1 or -1; likewise.
            near: a posture (1, dof) in the turns nearest to which angles are chosen, joint limits first; None for the
                first turns.

        Returns:
            Joint angles (1, dof) in rad, and a number that is within [-1, 1] exactly when the place is reached; None
            where it always is.
        """

    def postures(self, robot: Robot, chosen: FloatArray, elbow: float = 1.0) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Postures there (n, dof), rad, and whether each is there, (n,).

        Args:
            robot: that moves.
            chosen: values of :meth:`choices`, (n, choices).
            elbow: the branch, +1 or -1, where inverse kinematics chooses.
        """
        rows = [as_array(self.posture(robot, ca.DM(row), elbow, None)[0]).ravel() for row in chosen]
        return np.array(rows), np.ones(len(rows), dtype=bool)

    @abstractmethod
    def projected(self, robot: Robot, theta: FloatArray) -> FloatArray:
        """The posture (dof,) there that is nearest to another one (dof,), rad."""

    def near(self, robot: Robot, theta: FloatArray) -> tuple[FloatArray, bool]:
        """A posture there near another one (dof,), and whether it is there."""
        found = self.projected(robot, theta)
        return found, self.is_at(robot, found)

    def is_at(self, robot: Robot, theta: FloatArray) -> bool:
        """Whether a posture (dof,) is there, to its tolerance."""
        return bool(np.abs(as_array(self.miss(robot, ca.DM(theta).T))).max() <= self.tolerance(robot))

    @abstractmethod
    def miss(self, robot: Robot, theta: Matrix) -> Matrix:
        """Vectors by which postures (n, dof) miss it, (n, m), in ``unit``; zero where they are there."""

    @abstractmethod
    def tolerance(self, robot: Robot) -> float:
        """The rounding that each entry of :meth:`miss` may have in a finished motion."""

    @abstractmethod
    def position(self, robot: Robot) -> FloatArray:
        """The position of the tool, (dim,), m."""

    def by_tool(self, robot: Robot) -> Iterator[tuple[Robot, Place]]:
        """The place of each tool, behind the robot with this tool; itself by default."""
        yield robot, self

    def taken(self, robot: Robot, theta: FloatArray) -> str:
        """How a posture (dof,) turns the tool where the place leaves that free, in words; nothing by default."""
        return ""

    def table(self) -> Any:
        """The place as a file states it, plain data.

        Raises:
            InvalidProblem: a file cannot state places of this class.
        """
        raise InvalidProblem("place", f"no table states {type(self).__name__}")

    def _completed(self, table: dict[str, Any]) -> dict[str, Any]:
        """The table with how far from the place a motion may pass, and what it costs, where that is stated."""
        stated = {"within": float(self.within), "cost": float(self.cost)}
        return table | {key: value for key, value in stated.items() if value}


@dataclass(frozen=True)
class Joints(Place):
    """A place that is one given posture.

    Args:
        values: joint angles, dof of them, rad.
        within: how far from them a motion may pass, rad, of all joints together.
        turns: which of the values a whole turn apart a scenario's move takes: ``exact`` those that are stated,
            ``nearest`` those nearest to the posture before, within the ranges; None for the nearest of joints that turn
            without end, and the stated ones of others.
        cost: of a goal among several, added to the duration or whatever is minimised.
    """

    numbers: ClassVar[tuple[str, ...]] = ("values",)
    inert: ClassVar[tuple[str, ...]] = ("turns", "cost")
    chosen_by_inverse_kinematics: ClassVar[bool] = False

    values: tuple[Angle, ...]
    within: float = 0.0
    turns: Turns | None = None
    cost: float = 0.0

    @property
    def unit(self) -> str:
        return "rad"

    def check(self, robot: Robot, obstacles: Sequence[Obstacle], field: str, name: str = "") -> None:
        """Check that there are as many angles as joints, within their limits, and that the posture is clear."""
        if self.turns not in (None, *get_args(Turns)):
            raise InvalidProblem(field, f"{name}turns: {self.turns!r} is not one of {', '.join(get_args(Turns))}")
        if len(self.values) != robot.dof:
            raise InvalidProblem(field, f"{name}{len(self.values)} joints for a robot of {robot.dof}")
        check_within(field, self.values, ANGLES, "rad", name)
        for joint, (value, (low, high)) in enumerate(zip(self.values, robot.limits.position or (), strict=False), 1):
            if not low <= value <= high:
                raise InvalidProblem(field, f"{name}joint {joint}: {value:g} is not within {low:g} and {high:g} rad")
        check_posture(robot, obstacles, field, self.values, name)

    def check_holding(self, robot: Robot, elbow: Elbow, field: str, name: str = "") -> None:
        check_holding(robot, field, np.array([self.values]), name)

    def posture(
        self, robot: Robot, chosen: Matrix, elbow: Operand, near: Matrix | None
    ) -> tuple[Matrix, Matrix | None]:
        """The given posture, with its turns as they are."""
        return ca.horzcat(*self.values), None

    def postures(self, robot: Robot, chosen: FloatArray, elbow: float = 1.0) -> tuple[FloatArray, NDArray[np.bool_]]:
        return np.tile(np.array(self.values, dtype=np.float64), (len(chosen), 1)), np.ones(len(chosen), dtype=bool)

    def projected(self, robot: Robot, theta: FloatArray) -> FloatArray:
        return np.array(self.values)

    def miss(self, robot: Robot, theta: Matrix) -> Matrix:
        return theta - ca.repmat(ca.horzcat(*self.values), theta.shape[0], 1)

    def tolerance(self, robot: Robot) -> float:
        return max(ANGLE_TOLERANCE, self.within)

    def position(self, robot: Robot) -> FloatArray:
        return as_array(robot.tool.position(ca.DM([self.values]))).ravel()

    def by_tool(self, robot: Robot) -> Iterator[tuple[Robot, Place]]:
        return ((each, self) for each in robot.by_tool)

    def table(self) -> dict[str, Any]:
        turns = {} if self.turns is None else {"turns": self.turns}
        return self._completed({"joints": [*map(float, self.values)], **turns})


@dataclass(frozen=True)
class Position(Place):
    """A place with the tool at a point, in any posture.

    Args:
        point: m.
        within: how far from it a motion may pass, m.
        cost: of a goal among several, added to the duration or whatever is minimised.
    """

    numbers: ClassVar[tuple[str, ...]] = ("point",)
    chosen_by_inverse_kinematics: ClassVar[bool] = True

    point: tuple[float, ...]
    within: float = 0.0
    cost: float = 0.0

    @property
    def unit(self) -> str:
        return "m"

    def check(self, robot: Robot, obstacles: Sequence[Obstacle], field: str, name: str = "") -> None:
        """Check that the point is in reach, not too close, and clear; needs closed-form inverse kinematics."""
        if len(self.point) != robot.dim:
            raise InvalidProblem(field, f"{name}{self.point} where the robot needs {robot.dim} coordinates")
        check_point(robot, obstacles, field, self.point, name)

    def check_holding(self, robot: Robot, elbow: Elbow, field: str, name: str = "") -> None:
        """Check that the motors can hold one of the branches of the elbow, where nothing is redundant."""
        check_holding_at(robot, elbow, field, self.point, name)

    def choices(self, robot: Robot) -> tuple[Choice, ...]:
        """The redundancy values of the links 3..k, in [0, 1]."""
        return tuple(Choice("x_phi", f"[{link}]", 0.0, 1.0) for link in range(3, 3 + robot.closed_form.redundancy))

    def posture(
        self, robot: Robot, chosen: Matrix, elbow: Operand, near: Matrix | None
    ) -> tuple[Matrix, Matrix | None]:
        point, form = ca.vertcat(*self.point), robot.closed_form
        theta, cosine = form.inverse(point, form.restore_redundancy(point, chosen), elbow)
        return (form.wrap(theta) if near is None else form.wrap_near(theta, near)), cosine

    def projected(self, robot: Robot, theta: FloatArray) -> FloatArray:
        return as_array(robot.closed_form.project_to_point(ca.DM(theta).T, ca.vertcat(*self.point))).ravel()

    def miss(self, robot: Robot, theta: Matrix) -> Matrix:
        """Vectors from the point to the tool, (n, dim), m."""
        return robot.tool.position(theta) - ca.repmat(ca.horzcat(*self.point), theta.shape[0], 1)

    def tolerance(self, robot: Robot) -> float:
        return max(ANGLE_TOLERANCE * robot.reach()[1], self.within)

    def position(self, robot: Robot) -> FloatArray:
        return np.array(self.point)

    def table(self) -> list[float] | dict[str, Any]:
        point = [*map(float, self.point)]
        return point if len(point) == 2 and not (self.within or self.cost) else self._completed({"position": point})
