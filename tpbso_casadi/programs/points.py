"""Points of a motion for joint moves, as few as an accuracy needs, and what is proven of the path through them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, TypeAlias

import numpy as np

from problems import CertificateStatus, Robot, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray, Range
from problems.motions import control_points, fewest, from_line, rounding
from tpbso_casadi.planning import JudgedMotion, PlannedMotion
from tpbso_casadi.programs.program import Coding, ControllerExporter, Program, Proof, Signal
from tpbso_casadi.programs.proofs import (
    clear_along,
    clear_within,
    has_moving_obstacles,
    is_clearance,
    is_of_postures,
    polyline,
    said,
)

CANDIDATES = 1000  # at least, of a motion


@dataclass(frozen=True, eq=False)
class Leg:
    """Points of a motion from standstill to standstill.

    Attributes:
        criteria: by which the motion is judged.
        values: numbers of the program, (n, dof).
        points: the same as they are read, (n, dof), rad or m.
        off: how far joints of the motion are from the lines between points at most, (dof,), rad or m.
    """

    criteria: Criteria
    values: FloatArray
    points: FloatArray
    off: FloatArray

    @classmethod
    def of(
        cls,
        criteria: Criteria,
        motion: Trajectory,
        start: FloatArray,
        coding: Coding,
        accuracy: float,
        longest: float | None,
    ) -> Leg:
        """The fewest points that keep every joint of a motion within an accuracy of the lines between them.

        Args:
            criteria: by which the motion is judged.
            motion: of the joints.
            start: the numbers of its first point, with which the leg before ended, (1, dof).
            coding: of the numbers in the program.
            accuracy: rad, or m of a joint that slides.
            longest: the most that a joint moves from point to point, rad or m; None for whatever it is.
        """
        edges = motion.times(CANDIDATES)
        cut, curves = control_points(motion, edges)
        values = np.concatenate([start, coding.encoded(cut.at(cut.breakpoints[1:]))])
        points = coding.decoded(values)

        def off(first: int, last: int) -> FloatArray:
            return from_line(curves[:, first:last], points[first], points[last])

        def fits(first: int, last: int) -> bool:
            far = longest is not None and np.abs(points[last] - points[first]).max() > longest
            return not far and bool(off(first, last).max() <= accuracy)

        chosen = fewest(len(points), fits)
        most = np.max([off(*pair) for pair in pairwise(chosen)], axis=0) + rounding(motion)
        return cls(criteria, values[chosen], points[chosen], most)

    @property
    def lines(self) -> tuple[Criteria, Trajectory]:
        """The path along lines between the points; obstacles that move are left out: nobody knows the times."""
        return self.criteria, polyline(self.points)

    @property
    def spread(self) -> FloatArray:
        """How far joints that go from point to point each on its own are from a point of the line, (dof,)."""
        return np.asarray(np.abs(np.diff(self.points, axis=0)).max(axis=0) / 2.0)

    @property
    def cut(self) -> FloatArray:
        """How far joints in triangles of a point and the middles of its lines are from these lines at most, (dof,)."""
        return np.asarray(np.abs(np.diff(self.points, 2, axis=0)).max(axis=0, initial=0.0) / 4.0)


Step: TypeAlias = Leg | Signal | float  # a move, a signal that is told, or a wait in s


@dataclass(frozen=True, eq=False)
class Route:
    """The steps of a program of joint moves.

    Attributes:
        robot: that moves.
        coding: of the numbers in it.
        start: where it begins, (1, dof), as numbers.
        steps: in their order.
        rounded: whether corners are rounded rather than stopped at.
    """

    robot: Robot
    coding: Coding
    start: FloatArray
    steps: tuple[Step, ...]
    rounded: bool

    @property
    def corners(self) -> frozenset[int]:
        """The numbers of points that are rounded: none at which a leg begins or ends."""
        ends = np.cumsum([len(leg.points) - 1 for leg in self.legs]).tolist()
        return frozenset(range(1, self.count)) - {*ends} if self.rounded else frozenset()

    @property
    def numbered(self) -> Iterator[int | Signal | float]:
        """The steps, a leg as the numbers of its points, of which the start has 0."""
        number = 0
        for step in self.steps:
            if isinstance(step, Leg):
                yield from range(number + 1, number + len(step.points))
                number += len(step.points) - 1
            else:
                yield step

    @property
    def legs(self) -> list[Leg]:
        """The steps that move."""
        return [step for step in self.steps if isinstance(step, Leg)]

    @cached_property
    def count(self) -> int:
        """The number of moves."""
        return sum(len(leg.points) - 1 for leg in self.legs)

    @cached_property
    def values(self) -> FloatArray:
        """All points, the start first, (count + 1, dof), as numbers of the program."""
        return np.concatenate([self.start, *(leg.values[1:] for leg in self.legs)])


class PointExporter(ControllerExporter):
    """A writer of joint moves from point to point, with a stop at each.

    Attributes:
        documented: whether the maker says that joints move along straight lines.
        path: what the maker documents of the path between two points.
        corner: likewise, of the path that rounds a point.
    """

    documented: ClassVar[bool] = False
    path: ClassVar[str]
    corner: ClassVar[str]

    accuracy: Annotated[float, Range(least=1e-6, most=1.0)] = 0.005
    longest: Annotated[float, Range(least=1e-4)] | None = None
    speed: Annotated[float, Range(least=0.1, most=100.0)] = 20.0
    corners: Literal["stop", "round"] = "stop"

    @abstractmethod
    def text(self, route: Route, notes: list[str]) -> dict[str, str]:
        """The files of a program, by their names.

        Args:
            route: its steps.
            notes: lines of comment.
        """

    def program(self, plan: PlannedMotion) -> Program:
        motion, robot = plan.motion, plan.criteria.robot
        coding = self.coding(robot)
        start, rounded = coding.encoded(motion.trajectory.at(np.zeros(1))), self.corners == "round"
        steps = tuple(self._steps(motion, start, coding))
        route = Route(robot, coding, start, steps, rounded)
        lines, off = [leg.lines for leg in route.legs], np.max([leg.off for leg in route.legs], axis=0)
        at_points = "corners rounded" if rounded else "a stop at each"
        program = Program(
            content=f"{self.title}: {route.count + 1} points, {at_points}, {said(robot, off)} from the plan at most",
            proofs=tuple(self._proofs(route, lines)),
            assumptions=("the robot stands at the first point", self.path, *([self.corner] if rounded else [])),
            unstated=(
                f"times, speeds and accelerations: those of the controller at {self.speed:g} %",
                *_free(lines),
                *self.silent([step for step in steps if isinstance(step, Signal)]),
            ),
            planned=motion.status,
        )
        return program.with_files(self.text(route, program.notes))

    def _steps(self, motion: JudgedMotion, start: FloatArray, coding: Coding) -> Iterator[Step]:
        leg_of = partial(Leg.of, coding=coding, accuracy=self.accuracy, longest=self.longest)
        if not motion.stages:
            yield leg_of(motion.criteria, motion.trajectory, start)
        for stage in motion.stages:
            if stage.signal is not None:
                yield self.signal(*stage.signal)
            if stage.criteria is not None:
                leg = leg_of(stage.criteria, stage.motion(motion.trajectory), start)
                start = leg.values[-1:]
                yield leg
            elif stage.end > stage.start:
                yield stage.end - stage.start

    def _proofs(self, route: Route, lines: list[tuple[Criteria, Trajectory]]) -> Iterator[Proof]:
        """Proofs on the lines between points, and on other paths where the maker does not document that it is these."""

        def near(errors: FloatArray) -> tuple[str, CertificateStatus]:
            return said(route.robot, errors), clear_within(lines, errors, at_planned_times=False)

        cut, spread = (np.max([getattr(leg, of) for leg in route.legs], axis=0) for of in ("cut", "spread"))
        yield Proof("path along straight lines of the joints from point to point", clear_along(lines))
        if route.corners:
            far, status = near(cut)
            yield Proof(f"clearances where corners cut at most half of both lines, {far} from them at most", status)
        if not self.documented:
            far, status = near(spread)
            yield Proof(
                f"clearances where each joint goes from point to point on its own, {far} from the middle at most",
                status,
            )
        if has_moving_obstacles(lines):
            reason = "clearances from obstacles that move: the controller decides when the robot is where"
            yield Proof(reason, CertificateStatus.UNDECIDED)


def _free(lines: list[tuple[Criteria, Trajectory]]) -> list[str]:
    """A line on limits that no proof on the path speaks of."""
    limits = {limit.name: limit for criteria, _ in lines for limit in criteria.judged_limits}
    names = [name for name, limit in limits.items() if not is_clearance(limit) and not is_of_postures(limit)]
    return [f"limits that hold for the plan alone: {', '.join(names)}"] if names else []
