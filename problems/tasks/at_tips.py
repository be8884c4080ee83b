"""Places of a robot with several arms: one for each arm."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import ANGLES, FloatArray, InvalidProblem, Matrix, Operand, as_array, check_within
from problems.robots import Robot, SpatialArm
from problems.scene import Obstacle
from problems.tasks.place import ANGLE_TOLERANCE, Choice, Joints, Place
from problems.tasks.pose import SETTINGS, Pose, middle_of, separate_postures, usable_postures


@dataclass(frozen=True)
class AtTips(Place):
    """A place with each tip of a robot at a pose, or each arm at joints of its own.

    Args:
        tips: names of the robot's tips, each of them once.
        places: a :class:`Pose` of the tip, or :class:`Joints` of those joints alone that move it and no other tip.
        cost: of a goal among several, added to the duration or whatever is minimised.
    """

    chosen_by_inverse_kinematics: ClassVar[bool] = False
    always_reached: ClassVar[bool] = False
    within: ClassVar[float] = 0.0  # type: ignore[misc]

    tips: tuple[str, ...]
    places: tuple[Place, ...]
    cost: float = 0.0

    @property
    def unit(self) -> str:
        return "m, rad"

    def check(self, robot: Robot, obstacles: Sequence[Obstacle], field: str, name: str = "") -> None:
        """Check that there is a place for each tip, that no joint moves several tips, and each place by itself."""
        arm = _with_tips(robot, field, name)
        if sorted(self.tips) != sorted(arm.chain.branches):
            known = ", ".join(arm.chain.branches)
            raise InvalidProblem(field, f"{name}places of {', '.join(self.tips)} for a robot with the tips {known}")
        common = set(range(arm.dof)).difference(*arm.chain.branches.values())
        if common:
            joint = arm.joints.names[min(common)]
            raise InvalidProblem(field, f"{name}joint {joint!r} moves several tips: lock it, or state all joints")
        for tip, place in zip(self.tips, self.places, strict=True):
            own = f"{name}{tip}: "
            if isinstance(place, Joints):
                _check_joints(arm, place, arm.chain.branches[tip], field, own)
            elif isinstance(place, Pose):
                place.check(arm.at_tips[tip], obstacles, field, own)
            else:
                raise InvalidProblem(field, f"{own}joints or a pose are needed")

    def by_tool(self, robot: Robot) -> Iterator[tuple[Robot, Place]]:
        return ((arm, place) for arm, place, _ in self._parts(robot))

    def _parts(self, robot: Robot) -> Iterator[tuple[SpatialArm, Place, list[int]]]:
        """The robot with each of its tips as its tool, the place of the tip, and numbers of the joints that move it."""
        arm = _with_tips(robot)
        for tip, place in zip(self.tips, self.places, strict=True):
            yield arm.at_tips[tip], place, list(arm.chain.branches[tip])

    def choices(self, robot: Robot) -> tuple[Choice, ...]:
        return tuple(Choice("branch_offset", f"[{joint}]", -1.0, 1.0) for joint in range(1, robot.dof + 1))

    def branches(
        self, robot: Robot, obstacles: Sequence[Obstacle], near: FloatArray | None, field: str
    ) -> tuple[Place, ...]:
        """The place with each of the clear and separate postures of all arms as its branch, nearest first.

        Raises:
            InvalidProblem: an arm finds no posture at its pose, or none of all arms is clear and held.
        """
        middle, arm = middle_of(robot) if near is None else near, _with_tips(robot, field)
        owns = [list(arm.chain.branches[tip]) for tip in self.tips]
        parts = zip(self.tips, self.places, owns, strict=True)
        rows = product(*[_arm_postures(arm.at_tips[tip], place, own, middle, field) for tip, place, own in parts])
        found = np.array([_joined(row, owns, middle) for row in rows])
        held = usable_postures(robot, obstacles, found, "of all arms together", field)
        return tuple(map(self.on_branch, separate_postures(held, middle)[: SETTINGS.of_all_arms]))

    def on_branch(self, theta: FloatArray) -> Place:
        places = (place.on_branch(theta) if isinstance(place, Pose) else place for place in self.places)
        return replace(self, places=tuple(places))

    @property
    def branch_angles(self) -> tuple[float, ...]:
        return next((place.branch for place in self.places if isinstance(place, Pose)), ())

    def posture(
        self, robot: Robot, chosen: Matrix, elbow: Operand, near: Matrix | None
    ) -> tuple[Matrix, Matrix | None]:
        """The posture at which joints are put, each arm projected onto its place; and its miss over the tolerance."""
        theta = self._onto(robot, ca.horzcat(*self.branch_angles) + SETTINGS.offset * chosen.T)
        return theta, ca.norm_inf(self.miss(robot, theta)) / self.tolerance(robot)

    def postures(self, robot: Robot, chosen: FloatArray, elbow: float = 1.0) -> tuple[FloatArray, NDArray[np.bool_]]:
        theta, reached = np.tile(np.array(self.branch_angles), (len(chosen), 1)), np.ones(len(chosen), dtype=bool)
        for arm, place, own in self._parts(robot):
            if isinstance(place, Joints):
                theta[:, own] = place.values
                continue
            found, there = place.postures(arm, chosen, elbow)
            theta[:, own] = found[:, own]
            reached &= there
        return theta, reached

    def near(self, robot: Robot, theta: FloatArray) -> tuple[FloatArray, bool]:
        found, reached = self.on_branch(theta).postures(robot, np.zeros((1, robot.dof)))
        return found[0], bool(reached[0])

    def projected(self, robot: Robot, theta: FloatArray) -> FloatArray:
        return as_array(self._onto(robot, ca.DM(theta).T)).ravel()

    def _onto(self, robot: Robot, theta: Matrix) -> Matrix:
        columns: list[Matrix] = list(ca.horzsplit(theta))
        for arm, place, own in self._parts(robot):
            found = self._columns(arm, place, own, theta)
            for joint, value in zip(own, found, strict=True):
                columns[joint] = value
        return ca.horzcat(*columns)

    def _columns(self, arm: SpatialArm, place: Place, own: Sequence[int], theta: Matrix) -> list[Matrix]:
        """Values of the joints of an arm, (1, 1) each, at its place near a posture (1, dof)."""
        if isinstance(place, Joints):
            return [ca.DM(value) for value in place.values]
        assert isinstance(place, Pose)
        found = ca.horzsplit(place.onto(arm, theta))
        return [found[joint] for joint in own]

    def miss(self, robot: Robot, theta: Matrix) -> Matrix:
        """The vectors by which each arm misses its place, side by side, (n, m), m and rad."""
        columns = ca.horzsplit(theta)
        return ca.horzcat(
            *(
                place.miss(arm, theta if isinstance(place, Pose) else ca.horzcat(*(columns[joint] for joint in own)))
                for arm, place, own in self._parts(robot)
            )
        )

    def tolerance(self, robot: Robot) -> float:
        return ANGLE_TOLERANCE

    def position(self, robot: Robot) -> FloatArray:
        """The position of the first tip that is to be at a pose, (3,), m."""
        return next(np.array(place.point) for place in self.places if isinstance(place, Pose))

    def taken(self, robot: Robot, theta: FloatArray) -> str:
        words = {
            tip: place.taken(arm, theta) for tip, (arm, place, _) in zip(self.tips, self._parts(robot), strict=True)
        }
        return ", ".join(f"{tip}: {said}" for tip, said in words.items() if said)

    def table(self) -> dict[str, Any]:
        return {tip: place.table() for tip, place in zip(self.tips, self.places, strict=True)}


def _arm_postures(arm: SpatialArm, place: Place, own: list[int], near: FloatArray, field: str) -> list[FloatArray]:
    """Values of the joints of one arm at its place, (own,) each, those nearest to a posture (dof,) first."""
    if isinstance(place, Joints):
        return [np.array(place.values)]
    assert isinstance(place, Pose)
    return separate_postures(place.postures_there(arm, near, field)[:, own], near[own])[: SETTINGS.of_an_arm]


def _joined(values: Sequence[FloatArray], owns: Sequence[list[int]], others: FloatArray) -> FloatArray:
    """The posture (dof,) in which arms have these values, and all other joints those of another posture."""
    theta = others.copy()
    for own, each in zip(owns, values, strict=True):
        theta[own] = each
    return theta


def _check_joints(arm: SpatialArm, place: Joints, own: Sequence[int], field: str, name: str) -> None:
    if len(place.values) != len(own):
        raise InvalidProblem(field, f"{name}{len(place.values)} joints for an arm of {len(own)}")
    check_within(field, place.values, ANGLES, "rad", name)
    ranges = arm.limits.position or (ANGLES,) * arm.dof
    for value, joint in zip(place.values, own, strict=True):
        low, high = ranges[joint]
        if not low <= value <= high:
            where = f"{arm.joints.names[joint]}: {value:g} is not within {low:g} and {high:g}"
            raise InvalidProblem(field, f"{name}{where} {arm.joints.units[joint]}")


def _with_tips(robot: Robot, field: str = "goal", name: str = "") -> SpatialArm:
    if not (isinstance(robot, SpatialArm) and robot.chain.tips):
        raise InvalidProblem(field, f"{name}places of several arms are not for {type(robot).__name__} with one")
    return robot
