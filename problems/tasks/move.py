"""Moves between places, through other places, with velocities at the ends."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import ClassVar, get_args

import casadi as ca
import numpy as np

from problems.base import TIMES, FloatArray, InvalidProblem, as_array, check_fields, check_within
from problems.limits import Constraint
from problems.motions import Trajectory, increasing_choice
from problems.robots import Robot
from problems.scene import Obstacle, standing
from problems.tasks.checks import check_choice, check_obstacles, check_range
from problems.tasks.place import Elbow, Joints, Place, check_elbow
from problems.tasks.task import Marker, MarkerKind, Milestone, Task

COSTS = (0.0, 1e6)  # of goals, s, or the unit of what is minimised
LARGEST_CORNER = 1.0  # m or rad: no via may be missed by more
RATE_TOLERANCE = 1e-9  # of a joint's largest speed or acceleration; allows for rounding only


def rate_conditions(
    task: Task, trajectory: Trajectory, order: int, ends: Sequence[str] = ("start", "goal")
) -> list[tuple[Constraint, FloatArray]]:
    """Velocities or accelerations, by order, at the ends of a motion: numeric constraints, and their times in s."""
    limits, at_goal = task.robot.limits, {"start": 0, "goal": -1}
    kind, unit, symbol, most = {
        1: ("velocity", "rad/s", "dtheta_i", limits.speed),
        2: ("acceleration", "rad/s^2", "d2theta_i", limits.acceleration),
    }[order]
    bounds, found = RATE_TOLERANCE * np.array(most), []
    for end in ends:
        time = trajectory.breakpoints[[at_goal[end]]]
        away = np.abs(trajectory.at(time, order)[0] - task.end_rates[at_goal[end], order - 1])
        found.append((_rates(task, f"{end} {kind}", unit, symbol, away, bounds), time))
    return found


def _rates(task: Task, name: str, unit: str, symbol: str, away: FloatArray, bounds: FloatArray) -> Constraint:
    """A constraint on rates that differ from those of the task by ``away`` (dof,), and may by ``bounds`` (dof,)."""
    bound = ca.DM(bounds).T
    return Constraint(
        name=name,
        unit=unit,
        expression=ca.DM(away).T,
        lower=-bound,
        upper=bound,
        symmetric=True,
        columns=task.robot.joints.names,
        scale=bound,
        for_all_t=False,
        formula=f"|{symbol} - {name}_i|, to rounding",
    )


STATE_ROUNDING = 0.01  # share of a limit, by which a measured state is beyond it by what a drive rounds at most
SEARCHED_TIMES = 2001  # at which places are looked for, besides the breakpoints
NEWTON_STEPS = 12  # towards the exact time


def passing_times(robot: Robot, trajectory: Trajectory, places: Sequence[Place]) -> FloatArray:
    """The times that miss the places least, in their order, (places,), s.

    Of all increasing choices among many times the one with the smallest sum of squared distances (in units of each
    place's tolerance), found by dynamic programming; then Newton steps to where the distance is stationary.
    """
    if not places:
        return np.empty(0)
    times = np.unique(np.concatenate([trajectory.times(SEARCHED_TIMES), trajectory.breakpoints]))
    theta = ca.DM(trajectory.at(times))
    chosen = increasing_choice(np.array([_squared_miss(robot, place, theta) for place in places]))
    return np.array([_refined(robot, trajectory, place, times, i) for place, i in zip(places, chosen, strict=True)])


def _squared_miss(robot: Robot, place: Place, theta: ca.DM) -> FloatArray:
    missed = as_array(place.miss(robot, theta)) / place.tolerance(robot)
    return np.asarray(np.square(missed).sum(axis=1))


def _refined(robot: Robot, trajectory: Trajectory, place: Place, times: FloatArray, index: int) -> float:
    """The nearest time at which the distance is stationary, if it is smaller there."""
    low, high = times[max(index - 1, 0)], times[min(index + 1, times.size - 1)]
    q, t = ca.SX.sym("q", 1, robot.dof), float(times[index])
    miss = ca.Function("miss", [q], [place.miss(robot, q), ca.jacobian(place.miss(robot, q), q)])

    def distance(at: float) -> tuple[float, float, float]:
        residual, jacobian = (as_array(part) for part in miss(ca.DM(trajectory.at(np.array([at])))))
        slope = jacobian @ trajectory.at(np.array([at]), 1)[0]
        return float((residual**2).sum()), float(residual.ravel() @ slope), float(slope @ slope)

    best = t
    for _ in range(NEWTON_STEPS):
        _, gradient, curvature = distance(t)
        if curvature == 0.0:
            break
        t = float(np.clip(t - gradient / curvature, low, high))
        if distance(t)[0] < distance(best)[0]:
            best = t
    return best


@dataclass(frozen=True)
class Move(Task):
    """The task to move from ``start`` to any one of ``goals``, through ``vias`` in order.

    Args:
        robot: that moves.
        start: where it is at t = 0.
        goals: of which one is reached at t = T.
        vias: passed in this order, at free times.
        elbow: the branch of inverse kinematics wherever it chooses a posture; ``free`` adds decision variables.
        obstacles: to keep clear of.
        start_velocity: of the joints at t = 0, rad/s; at rest where empty.
        goal_velocity: of the joints at t = T, rad/s; at rest where empty.
        start_acceleration: of the joints at t = 0, rad/s^2; free, or zero at rest, where empty.
        goal_acceleration: of the joints at t = T, likewise.
        total_time: bounds of T in s; None where nothing is promised.
        stay: how long after T the robot, which stands then, has to stay clear of obstacles that move, s.
        notes: on how the statement was read, a line each.
        alternatives: all goals of the statement, of which ``goals`` are some; ``goals`` themselves where empty.

    Raises:
        InvalidProblem: a place cannot be reached, or a field is not one of the above.
    """

    numbers: ClassVar[tuple[str, ...]] = (
        "start_velocity",
        "goal_velocity",
        "start_acceleration",
        "goal_acceleration",
        "total_time",
        "stay",
    )
    zero_is_structure: ClassVar[tuple[str, ...]] = ("stay",)
    inert: ClassVar[tuple[str, ...]] = ("notes", "alternatives")

    robot: Robot
    start: Place
    goals: tuple[Place, ...]
    vias: tuple[Place, ...] = ()
    elbow: Elbow = "free"
    obstacles: tuple[Obstacle, ...] = ()
    start_velocity: tuple[float, ...] = ()
    goal_velocity: tuple[float, ...] = ()
    total_time: tuple[float, float] | None = None
    start_acceleration: tuple[float, ...] = ()
    goal_acceleration: tuple[float, ...] = ()
    stay: float = 0.0
    notes: tuple[str, ...] = ()
    alternatives: tuple[Place, ...] = dataclasses.field(default=(), compare=False)

    def __post_init__(self) -> None:
        check_fields(self)
        check_choice("elbow", self.elbow, get_args(Elbow))
        check_elbow(self.robot, self.elbow)
        if not self.goals:
            raise InvalidProblem("goal", "there is none")
        if self.total_time is not None:
            check_range("total_time", self.total_time)
        check_obstacles(self.robot, self.obstacles)
        self.start.check(self.robot, self.obstacles, "start")
        for field, places in (("goal", self.goals), ("via", self.vias)):
            for number, place in enumerate(places):
                name = f"{field}[{number}]: " if len(places) > 1 else ""
                place.check(self.robot, standing(self.obstacles), field, name)
                check_within(field, (place.within,), (0.0, LARGEST_CORNER), place.unit, f"{name}within ")
        for field, places in (("start", (self.start,)), ("goal", self.goals)):
            if any(place.within for place in places):
                raise InvalidProblem(field, "within is how far a via may be missed; leave it out")
        for field, places in (("start", (self.start,)), ("via", self.vias)):
            if any(place.cost for place in places):
                raise InvalidProblem(field, "cost is that of a goal among several; leave it out")
        check_within("goal", [goal.cost for goal in self.goals], COSTS, "s", "cost ")
        limits = self.robot.limits
        self._check_rates("start_velocity", limits.speed, "rad/s")
        self._check_rates("goal_velocity", limits.speed, "rad/s")
        self._check_rates("start_acceleration", limits.acceleration, "rad/s^2")
        self._check_rates("goal_acceleration", limits.acceleration, "rad/s^2")
        if self.at_rest:
            self._check_holding()
        check_within("stay", (self.stay,), (0.0, TIMES[1]), "s")
        for field in ("goal_velocity", "goal_acceleration") if self.stay else ():
            if any(getattr(self, field)):
                raise InvalidProblem("stay", f"the robot does not stop at its goal: {field} is not zero")

    def _check_holding(self) -> None:
        for field, places in (("start", (self.start,)), ("goal", self.goals), ("via", self.vias)):
            for number, place in enumerate(places):
                name = f"{field}[{number}]: " if len(places) > 1 else ""
                place.check_holding(self.robot, self.elbow, field, name)

    def _check_rates(self, field: str, limits: tuple[float, ...], unit: str) -> None:
        rates: tuple[float, ...] = getattr(self, field)
        if rates and len(rates) != self.robot.dof:
            raise InvalidProblem(field, f"{len(rates)} values for {self.robot.dof} joints")
        for joint, (value, most) in enumerate(zip(rates, limits, strict=False), start=1):
            if most < abs(value) <= (1.0 + STATE_ROUNDING) * most:
                beyond = f"joint {joint}: {value:g} is {100.0 * (abs(value) / most - 1.0):.2g} % beyond {most:g} {unit}"
                raise InvalidProblem(field, f"{beyond}, as a drive rounds; state the limit itself, or raise the limit")
            check_within(field, (value,), (-most, most), unit, f"joint {joint}: ")

    def narrowed(self, start: Place, vias: tuple[Place, ...], goals: tuple[Place, ...]) -> Move:
        """The move between places that are its own more narrowly stated, and so need no check."""
        move, every = copy(self), self.alternatives or self.goals
        for name, places in (("start", start), ("vias", vias), ("goals", goals), ("alternatives", every)):
            object.__setattr__(move, name, places)
        return move

    def observed(
        self,
        state: tuple[FloatArray, FloatArray, FloatArray],
        obstacles: tuple[Obstacle, ...],
        goals: tuple[Place, ...] | None = None,
    ) -> Move:
        """The move from an observed state among observed obstacles, of which nothing is checked.

        Args:
            state: joint angles, velocities and accelerations, each (dof,); rad, rad/s, rad/s^2.
            obstacles: to keep clear of from now on.
            goals: others, of which one is reached; those of this move where None.
        """
        theta, velocity, acceleration = (tuple(values.tolist()) for values in state)
        move = self.narrowed(Joints(theta), self.vias, self.goals if goals is None else goals)
        observed = {"start_velocity": velocity, "start_acceleration": acceleration, "obstacles": obstacles}
        for name, value in observed.items():
            object.__setattr__(move, name, value)
        return move

    @property
    def end_velocities(self) -> FloatArray:
        rest = (0.0,) * self.robot.dof
        return np.array([self.start_velocity or rest, self.goal_velocity or rest])

    @property
    def end_accelerations(self) -> FloatArray:
        rest = (0.0,) * self.robot.dof
        return np.array([self.start_acceleration or rest, self.goal_acceleration or rest])

    @property
    def passes_nothing(self) -> bool:
        return not self.vias

    @property
    def start_posture(self) -> FloatArray | None:
        return self._posture_of(self.start)

    def goal_posture(self, theta: FloatArray) -> FloatArray | None:
        return self._posture_of(self.reached_goal(theta))

    def end_places(self, theta: FloatArray) -> tuple[Place, ...]:
        return self.start, self.reached_goal(theta)

    def _posture_of(self, place: Place) -> FloatArray | None:
        if place.chosen_by_inverse_kinematics or place.choices(self.robot):
            return None
        return as_array(place.posture(self.robot, ca.DM(0, 1), 1.0, None)[0]).ravel()

    @property
    def last_places(self) -> tuple[Place, ...]:
        return self.goals if self.passes_nothing and not self.end_rates[1].any() else ()

    @property
    def given_postures(self) -> FloatArray:
        """The joints of start and vias, and of the goal where there is one alone."""
        places = [self.start, *self.vias, *(self.goals if len(self.goals) == 1 else ())]
        given = [place for place in places if not (place.chosen_by_inverse_kinematics or place.choices(self.robot))]
        rows = [as_array(place.posture(self.robot, ca.DM(0, 1), 1.0, None)[0]) for place in given]
        return np.concatenate([np.empty((0, self.robot.dof)), *rows])

    @property
    def is_plain_move(self) -> bool:
        return self.at_rest and self.passes_nothing and self.total_time is None

    @property
    def passed_postures(self) -> FloatArray | None:
        places, given = (self.start, *self.vias, *self.goals), self.given_postures
        exact = len(given) == len(places) and not any(place.within for place in places)
        return given if exact and self.vias and not self.end_accelerations.any() else None

    def reached_goal(self, theta: FloatArray) -> Place:
        """The goal that a posture (dof,) misses least, relative to its tolerance."""
        return self._nearest(self.goals, theta)

    def _nearest(self, goals: tuple[Place, ...], theta: FloatArray) -> Place:
        posture = ca.DM(theta).T

        def missed(place: Place) -> float:
            return float(np.abs(as_array(place.miss(self.robot, posture))).max()) / place.tolerance(self.robot)

        return goals[0] if len(goals) == 1 else min(goals, key=missed)

    @property
    def goal_cost(self) -> float:
        return min(goal.cost for goal in self.goals)

    def added_cost(self, trajectory: Trajectory) -> float:
        if len({goal.cost for goal in self.goals}) == 1:
            return self.goal_cost  # whichever is reached
        return self.reached_goal(trajectory.at(trajectory.breakpoints[-1:])[0]).cost

    def taken(self, trajectory: Trajectory) -> tuple[str, ...]:
        """The number of the goal that is reached of several, and turns of the tool that are free."""
        start, end = trajectory.at(trajectory.breakpoints[[0, -1]])
        goal, every = self.reached_goal(end), self.alternatives or self.goals
        number = every.index(self._nearest(every, end)) + 1
        which = f"number {number} of {len(every)}" if len(every) > 1 else ""
        found = {
            "start": self.start.taken(self.robot, start),
            "goal": ", ".join(filter(None, (which, goal.taken(self.robot, end)))),
        }
        return tuple(f"{name}: {words}" for name, words in found.items() if words)

    def via_times(self, trajectory: Trajectory) -> FloatArray:
        """Times at which the vias are passed, or missed least, in order, (vias,), s."""
        return passing_times(self.robot, trajectory, self.vias)

    def milestones(self, trajectory: Trajectory) -> tuple[Milestone, ...]:
        times = self.via_times(trajectory)
        return tuple(Milestone(label=f"via {number}", time=float(t)) for number, t in enumerate(times, start=1))

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        """Conditions on start, vias and goal; on the velocities at both ends; on accelerations stated there."""
        times = np.concatenate([[0.0], self.via_times(trajectory), [trajectory.duration]])
        names = ["start", *(f"via {number}" for number in range(1, len(self.vias) + 1)), "goal"]
        places = [self.start, *self.vias, self.reached_goal(trajectory.at(times[-1:])[0])]
        passed = [
            (self._passed(name, place, trajectory.at(times[i : i + 1])), times[i : i + 1])
            for i, (name, place) in enumerate(zip(names, places, strict=True))
        ]
        stated = [end for end in ("start", "goal") if getattr(self, f"{end}_acceleration")]
        return [
            *passed,
            *rate_conditions(self, trajectory, 1),
            *rate_conditions(self, trajectory, 2, stated),
        ]

    def _passed(self, name: str, place: Place, theta: FloatArray) -> Constraint:
        miss = place.miss(self.robot, ca.DM(theta))
        bound = ca.DM([[place.tolerance(self.robot)]])
        return Constraint(
            name=name,
            unit=place.unit,
            expression=ca.norm_2(miss),
            lower=-bound,
            upper=bound,
            symmetric=True,
            columns=("distance",),
            scale=bound,
            for_all_t=False,
            formula=f"the motion is at {name}, to rounding",
        )

    def markers(self) -> tuple[Marker, ...]:
        ends = [
            Marker(label="start", points=self._tools_at(self.start), kind=MarkerKind.START),
            Marker(label="goal", points=self._tools_at(*self.goals), kind=MarkerKind.GOAL),
        ]
        if self.vias:
            ends.insert(1, Marker(label="via", points=self._tools_at(*self.vias), kind=MarkerKind.VIA))
        return tuple(ends)

    def _tools_at(self, *places: Place) -> FloatArray:
        """Positions of all tools at places, (n, dim), m."""
        return np.array([one.position(robot) for place in places for robot, one in place.by_tool(self.robot)])
