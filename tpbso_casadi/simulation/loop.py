"""What a simulation is set to, and its loop: observe, plan again, move on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import casadi as ca
import numpy as np

from problems import InvalidProblem, Joints, Obstacle, Place, Robot, Trajectory
from problems.base import FloatArray, as_array
from problems.limits import can_hold
from problems.scene import standing
from problems.tasks import least_clearances
from solvers import Interruption
from tpbso_casadi.replanning import Step
from tpbso_casadi.scenario import Scenario, ScenarioError, SimulationSection, as_scenario_errors
from tpbso_casadi.simulation.record import Replan, SimulationRecord, Visit, joined, jumps_between, part, rest_time
from tpbso_casadi.simulation.world import SimulatedWorld

DRAWS = 200  # of the numbers that are free at a place, where the middle of their ranges will not do
SEED = 18  # of the draws: a place has the same posture in every simulation


def posture_at(
    place: Place, robot: Robot, obstacles: Sequence[Obstacle], near: FloatArray | None, field: str
) -> Joints:
    """The posture at a place that is clear at t = 0, can be held, and is nearest to another one.

    Args:
        place: to be at.
        robot: that moves.
        obstacles: to keep clear of.
        near: a posture (dof,), rad; the first that is found will do where None.
        field: for messages.

    Raises:
        InvalidProblem: none is found.
    """
    place.check(robot, obstacles, field)
    for found in (_middles(place, robot, obstacles, near, field), _drawn(place, robot, near)):
        postures = np.array([theta for theta in found if _is_within(robot, theta)]).reshape(-1, robot.dof)
        clear = least_clearances(robot, obstacles, postures) >= robot.margin if len(postures) else np.empty(0, bool)
        usable = postures[clear & can_hold(robot, postures)] if len(postures) else postures
        if len(usable):
            farthest = np.abs(usable - (usable[0] if near is None else near)).max(axis=1)
            return Joints(tuple(usable[int(np.argmin(farthest))].tolist()))
    raise InvalidProblem(field, f"no posture with the tool at {place.position(robot)} is clear and can be held")


def _middles(
    place: Place, robot: Robot, obstacles: Sequence[Obstacle], near: FloatArray | None, field: str
) -> Iterator[FloatArray]:
    """Postures on every branch, with every free number in the middle of its range."""
    for branch in place.branches(robot, obstacles, near, field):
        middle = [(choice.lower + choice.upper) / 2.0 for choice in branch.choices(robot)]
        yield from _postures(branch, robot, middle, near)


def _drawn(place: Place, robot: Robot, near: FloatArray | None) -> Iterator[FloatArray]:
    """Postures with free numbers drawn from their ranges; nothing new where there are none."""
    choices = place.choices(robot) if place.always_reached else ()
    generator = np.random.default_rng(SEED)
    for _ in range(DRAWS if choices else 0):
        drawn = [generator.uniform(choice.lower, choice.upper) for choice in choices]
        yield from _postures(place, robot, drawn, near)


def _postures(place: Place, robot: Robot, chosen: list[float], near: FloatArray | None) -> Iterator[FloatArray]:
    """Postures with both elbows, where these exist."""
    turns = None if near is None else ca.DM(near).T
    for elbow in (1.0, -1.0) if place.chosen_by_inverse_kinematics else (1.0,):
        theta, cosine = place.posture(robot, ca.DM(chosen), elbow, turns)
        if cosine is None or abs(float(cosine)) <= 1.0:
            yield as_array(theta).ravel()


def _is_within(robot: Robot, theta: FloatArray) -> bool:
    """Whether joints are in their ranges."""
    ranges = robot.limits.position
    return ranges is None or all(low <= q <= high for q, (low, high) in zip(theta, ranges, strict=True))


@dataclass(frozen=True, kw_only=True)
class SimulationSetting:
    """The statement with which a simulation begins.

    Attributes:
        scenario: complete: its [simulation] table too, and postures for all places.
        settings: that table.
        robot: that moves.
        world: all obstacles.
        start: where the robot is at t = 0, at rest.
        goals: visited one after the other, cyclically.
    """

    scenario: Scenario
    settings: SimulationSection
    robot: Robot
    world: SimulatedWorld
    start: Joints
    goals: tuple[Joints, ...]

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """The beginning of the simulation of a scenario.

        Raises:
            ScenarioError: it cannot be simulated; the message names the key.
        """
        settings = scenario.simulation or SimulationSection()
        start, goals = _places(scenario, settings)
        criteria = scenario.criteria()
        robot, obstacles = criteria.robot, criteria.obstacles
        world = SimulatedWorld.of(scenario.obstacles, settings, scenario.solver.seed)
        first = _posture("task.start", start, robot, obstacles, None)
        near = np.array(first.values)
        visited = tuple(_posture(key, place, robot, standing(obstacles), near) for key, place in goals)
        task = scenario.task.with_keys({"start": first, "goal": visited[0]})
        with as_scenario_errors():
            simulation = settings.with_keys({"goals": list(visited)})
            complete = scenario.with_keys({"task": task, "simulation": simulation})
        assert complete.simulation is not None
        return cls(
            scenario=complete,
            settings=complete.simulation,
            robot=robot,
            world=world,
            start=first,
            goals=visited,
        )


def _places(scenario: Scenario, settings: SimulationSection) -> tuple[Any, list[tuple[str, Any]]]:
    """Start, and the places to visit with the keys that state them."""
    start, goal = scenario.task.rest_places()
    if settings.goals is not None:
        return start, [(f"simulation.goals.{number}", place) for number, place in enumerate(settings.goals)]
    if isinstance(goal, list):
        raise ScenarioError("task.goal: is a list; state in simulation.goals which places are visited in which order")
    return start, [("task.goal", goal), ("task.start", start)]


def _posture(key: str, place: Any, robot: Robot, obstacles: tuple[Obstacle, ...], near: FloatArray | None) -> Joints:
    try:
        return posture_at(place, robot, obstacles, near, key)
    except InvalidProblem as error:
        raise ScenarioError(f"{key}: {error.reason}") from error


REACHED = 1e-6  # rad or m: a joint that near to its goal is there


class StepPlanner(Protocol):
    """Who is asked at every tick; see :class:`tpbso_casadi.replanning.replanner.Replanner`."""

    def replan(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None = None) -> Step:
        """The motion to execute from now on, given the one that is executed meanwhile, on a clock that starts now."""


@dataclass
class Simulation:
    """A simulation, tick by tick.

    Args:
        setting: robot, scene and goals.
        planner: that is asked.
    """

    setting: SimulationSetting
    planner: StepPlanner

    def __post_init__(self) -> None:
        start = np.array(self.setting.start.values)
        self._ahead = Trajectory.standing(start, self.every)
        self._executed: list[Trajectory] = []
        self._replans: list[Replan] = []
        self._visits: list[Visit] = []
        self._goal = 0

    @property
    def every(self) -> float:
        """The time between two ticks, s."""
        return self.setting.settings.every

    def run(
        self, interruption: Interruption, told: Callable[[Replan], object] = lambda replan: None
    ) -> SimulationRecord:
        """Simulate to the end, or until there is a request to stop.

        Args:
            interruption: is polled; the answer during which it came does not count.
            told: is given every replan.

        Raises:
            KeyboardInterrupt: the request came before the first answer.
        """
        for tick in range(self.setting.settings.ticks):
            replan = self._tick(tick, interruption)
            if replan is None:
                break
            told(replan)
        if not self._executed:
            raise KeyboardInterrupt
        return self._record(interrupted=interruption.requested)

    def _tick(self, tick: int, interruption: Interruption) -> Replan | None:
        """One look at the scene; None where a request came meanwhile."""
        now = tick * self.every
        self._arrive(now)
        answer = self.planner.replan(self._ahead, self.setting.world.observed(now), self._goals[self._goal])
        if interruption.requested:
            return None
        replan = Replan(
            tick=tick,
            time=now,
            goal=self._goal,
            kind=answer.kind,
            certified=answer.certified,
            fail_safe=answer.fail_safe,
            seconds=answer.seconds,
            predicted_distance=np.inf if answer.closest is None else answer.closest.distance,
            arrival=now + rest_time(answer.trajectory),
            jumps=jumps_between(self._ahead, answer.trajectory, self.every),
        )
        self._executed.append(part(self._ahead, 0.0, self.every))
        self._ahead = part(answer.trajectory, self.every, max(answer.trajectory.duration, 2.0 * self.every))
        self._replans.append(replan)
        return replan

    @property
    def _goals(self) -> tuple[Joints, ...]:
        return self.setting.goals

    def _arrive(self, now: float) -> None:
        """Turn to the next goal where this one is reached before the next tick."""
        at_rest = rest_time(self._ahead)
        miss = np.abs(self._ahead.at(np.array([self.every]))[0] - self._goals[self._goal].values).max()
        is_new = not self._visits or self._visits[-1].goal != self._goal
        if at_rest <= self.every and miss <= REACHED and is_new:
            self._visits.append(Visit(goal=self._goal, time=now + at_rest))
            self._goal = (self._goal + 1) % len(self._goals)

    def _record(self, interrupted: bool) -> SimulationRecord:
        return SimulationRecord(
            scenario=self.setting.scenario,
            robot=self.setting.robot,
            executed=joined(self._executed),
            following=self._ahead,
            obstacles=self.setting.world.true,
            goals=self._goals,
            visits=tuple(self._visits),
            replans=tuple(self._replans),
            interrupted=interrupted,
        )
