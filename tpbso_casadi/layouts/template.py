"""Layouts of a cell: the numbers that are free, and the scenario that they give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any

import numpy as np

from problems.base import FloatArray, InvalidTable
from problems.robots import quaternion_product
from problems.tasks import Pose
from solvers import SearchBox
from tpbso_casadi.scenario import (
    FrameSection,
    FreeSection,
    LayoutSection,
    LedStage,
    PoseInFrame,
    Scenario,
    ScenarioError,
    SequenceTask,
    SpatialRobotSection,
    as_scenario_errors,
)

ROBOT, WORLD = "robot", "the world"  # the place of the robot's base; the frame of everything, seen from the base
AXES = ("x", "y", "z")
UNTURNED = (0.0, 0.0, 0.0, 1.0)
DIGITS = 9  # of a free number, m and rad, so that a layout that is written is the one that was looked at
WRAPPED = pi / 2.0  # rad, by which a range of a whole turn is searched beyond its ends


@dataclass(frozen=True)
class Variable:
    """A free number of a layout.

    Attributes:
        place: of the robot's base, or the name of a frame.
        number: of its coordinate, 0 to 2, m; or 3, its turn about the vertical axis, rad.
        low: the least.
        high: the most.
    """

    place: str
    number: int
    low: float
    high: float

    @property
    def name(self) -> str:
        """The place and what of it is free."""
        return f"{self.place} {(*AXES, 'turn')[self.number]}"

    @property
    def goes_round(self) -> bool:
        """Whether it is a whole turn, so that its ends are one."""
        return self.number == len(AXES) and self.high - self.low >= 2.0 * pi * (1.0 - 1e-9)

    @property
    def bounds(self) -> tuple[float, float]:
        """Between which it is searched; a whole turn also beyond its ends, so that the search passes them."""
        return (self.low - WRAPPED, self.high + WRAPPED) if self.goes_round else (self.low, self.high)

    def value(self, searched: float) -> float:
        """The number of a searched one: a whole turn is wrapped."""
        found = self.low + (searched - self.low) % (2.0 * pi) if self.goes_round else searched
        return round(found, DIGITS)


@dataclass(frozen=True, eq=False)
class LayoutTemplate:
    """A cell whose layout is free.

    Args:
        stated: the scenario of a sequence as it is stated, with its frames and its [layout].

    Raises:
        ScenarioError: it has no [layout], is no sequence of one arm in space, or names a place that is not there.
    """

    stated: Scenario

    def __post_init__(self) -> None:
        scenario = self.stated
        if scenario.layout is None:
            raise ScenarioError("layout: missing key; a table says what is free: [layout]")
        if not isinstance(scenario.task, SequenceTask):
            raise ScenarioError('task.kind: a layout is of a "sequence"')
        if not isinstance(scenario.robot, SpatialRobotSection):
            raise ScenarioError("layout: of one robot in space, stated as [robot]")
        for number, free in enumerate(scenario.layout.free):
            with as_scenario_errors("layout", "free", str(number)):
                if free.place != ROBOT and free.place not in self._numbers:
                    known = ", ".join([ROBOT, *self._numbers])
                    raise InvalidTable(f"no frame is called {free.place!r}; there are {known}", "place")

    @property
    def section(self) -> LayoutSection:
        """The table that says what is free."""
        assert self.stated.layout is not None
        return self.stated.layout

    @cached_property
    def _numbers(self) -> dict[str, int]:
        """Numbers of the frames by their names."""
        return {frame.name: number for number, frame in enumerate(self.stated.frames)}

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The free numbers, in the order in which they are stated."""
        return tuple(
            Variable(free.place, number, *bounds)
            for free in self.section.free
            for number, bounds in enumerate((free.x, free.y, free.z, free.turn))
            if bounds is not None
        )

    def across(self, place: str) -> tuple[int, int]:
        """The numbers of the variables that are the x and y of a place.

        Raises:
            ScenarioError: they are not both free.
        """
        known = {(each.place, each.number): number for number, each in enumerate(self.variables)}
        if (place, 0) not in known or (place, 1) not in known:
            both = [each.place for each in self.variables if (each.place, 0) in known and (each.place, 1) in known]
            there = ", ".join(dict.fromkeys(both)) or "no place"
            raise ScenarioError(f"map: of {there}, whose x and y are free, not of {place!r}")
        return known[place, 0], known[place, 1]

    @property
    def box(self) -> SearchBox:
        """The box that is searched."""
        lower, upper = np.array([variable.bounds for variable in self.variables]).T
        return SearchBox(lower, upper)

    @cached_property
    def mountings(self) -> list[tuple[tuple[float, ...] | None, ...]]:
        """How each free place is mounted, in all ways together that are stated; None where as the scenario says."""
        found: list[tuple[tuple[float, ...] | None, ...]] = [()]
        for free in self.section.free:
            choices: Sequence[tuple[float, ...] | None] = free.mountings or [None]
            found = [(*before, choice) for before in found for choice in choices]
        return found

    def values(self, x: FloatArray) -> FloatArray:
        """The free numbers of a searched point, (d,)."""
        return np.array([each.value(float(part)) for each, part in zip(self.variables, x, strict=True)])

    def described(self, values: FloatArray) -> str:
        """A text of where each free place stands, by the free numbers (d,): m and degrees."""
        places: dict[str, list[str]] = {}
        for variable, value in zip(self.variables, values.tolist(), strict=True):
            turns = variable.number == len(AXES)
            shown = f"turn {np.degrees(value):.1f}" if turns else f"{AXES[variable.number]} {value:.4f}"
            places.setdefault(variable.place, []).append(shown)
        return "; ".join(f"{place}: {', '.join(numbers)}" for place, numbers in places.items())

    def placed(self, x: FloatArray, mounting: int = 0) -> Scenario:
        """The scenario of a layout, with its frames.

        Args:
            x: a searched point, (d,).
            mounting: its number among :attr:`mountings`.
        """
        values, changed = dict(zip(self.variables, self.values(x).tolist(), strict=True)), self.stated
        for free, turned in zip(self.section.free, self.mountings[mounting], strict=True):
            own = {variable.number: value for variable, value in values.items() if variable.place == free.place}
            changed = self._with_place(changed, free, own, turned)
        return changed

    def _with_place(
        self, scenario: Scenario, free: FreeSection, own: dict[int, float], mounted: tuple[float, ...] | None
    ) -> Scenario:
        """The scenario with the robot's base, or a frame, somewhere else.

        Args:
            scenario: that is changed.
            free: what of it is free.
            own: the values by their numbers.
            mounted: the quaternion before it is turned; the stated one where None.
        """
        is_base = free.place == ROBOT
        robot = scenario.robot
        assert isinstance(robot, SpatialRobotSection)
        table: Any = robot.base if is_base else scenario.frames[self._numbers[free.place]]
        position = tuple(own.get(number, part) for number, part in enumerate(table.position))
        quaternion = mounted or table.quaternion or UNTURNED
        turn = own.get(len(AXES), 0.0)
        if turn:
            quaternion = quaternion_product((0.0, 0.0, np.sin(turn / 2.0), np.cos(turn / 2.0)), quaternion)
        placed = table.replaced(position=position, quaternion=tuple(map(float, quaternion)))
        if is_base:
            return scenario.replaced(robot=robot.replaced(base=placed))
        frames = list(scenario.frames)
        frames[self._numbers[free.place]] = placed
        return scenario.replaced(frames=frames)

    def scenario(self, x: FloatArray, mounting: int = 0) -> Scenario:
        """The scenario of a layout in the world, which is planned.

        Args:
            x: a searched point, (d,).
            mounting: its number among :attr:`mountings`.

        Raises:
            ScenarioError: it cannot be.
        """
        with as_scenario_errors():
            return self.placed(x, mounting).with_postures()

    def seen_from_base(self, placed: Scenario, world_scenario: Scenario) -> Scenario:
        """The scenario of a layout as the robot's base sees it, which stands still whatever the layout.

        So all that depends on the robot alone is made once. Where constraints are stated in the world, it is that of
        the world.

        Args:
            placed: as of :meth:`placed`.
            world_scenario: the same in the world, as of :meth:`scenario`.

        Raises:
            ScenarioError: it cannot be.
        """
        rooted, base = self._rooted, world_scenario.robot.base  # type: ignore[union-attr]
        if rooted is None:
            return world_scenario
        with as_scenario_errors():
            world = _seen_from(base.position, base.quaternion)
            frames = [world, *(_in_frame(frame) for frame in placed.frames)]
            robot: Any = rooted.robot
            down = tuple(part + 0.0 for part in world.standing.vector(robot.gravity))
            return rooted.replaced(frames=frames, robot=robot.replaced(gravity=down)).with_postures()

    @cached_property
    def _rooted(self) -> Scenario | None:
        """The stated scenario with the robot's base at the origin, and everything else in the frame of the world."""
        scenario, task, robot = self.stated, self.stated.task, self.stated.robot
        assert isinstance(task, SequenceTask) and isinstance(robot, SpatialRobotSection)
        if scenario.model.constraints or scenario.constraints or any(_has_constraints(stage) for stage in task.stages):
            return None
        stages = [_stage_in_frame(stage) for stage in task.stages]
        return scenario.replaced(
            robot=robot.replaced(base=type(robot.base)()),
            obstacles=[_in_frame(obstacle) for obstacle in scenario.obstacles],
            task=task.replaced(start=_place_in_frame(task.start), stages=stages),
            layout=None,
        )


def _has_constraints(stage: Any) -> bool:
    return bool(getattr(stage, "constraints", ()))


def _in_frame(table: Any) -> Any:
    """A table that is stated in the world, in the world's frame."""
    return table.replaced(frame=WORLD) if table.frame is None else table


def _place_in_frame(place: Any) -> Any:
    """A place, or some, that is stated in the world, in the world's frame."""
    if isinstance(place, list):
        return [_place_in_frame(each) for each in place]
    return PoseInFrame(frame=WORLD, pose=place) if isinstance(place, Pose) else place


def _stage_in_frame(stage: Any) -> Any:
    """A stage whose places are stated in the world, in the world's frame."""
    if isinstance(stage, LedStage):
        return _in_frame(stage)
    keys = [key for key in ("goal", "via") if getattr(stage, key, None) is not None]
    return stage.replaced(**{key: _place_in_frame(getattr(stage, key)) for key in keys}) if keys else stage


def _seen_from(position: Sequence[float], quaternion: Sequence[float]) -> FrameSection:
    """The world's frame as it is seen from a base."""
    x, y, z, w = np.array(quaternion) / np.linalg.norm(quaternion)
    back = FrameSection(name=WORLD, position=(0.0, 0.0, 0.0), quaternion=(-x, -y, -z, w))
    away = back.standing.vector(tuple(-part for part in position))
    return back.replaced(position=away)
