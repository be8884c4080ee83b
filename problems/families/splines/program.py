"""The nonlinear program.

The waypoints (start, vias, goal) are nodes between pieces, so that they are passed whenever it suits. Where jerk is
limited it is constant in each piece and accelerations are continuous, zero at both ends; else accelerations are linear
in each piece and may jump from one to the next. Bounds of speed, acceleration, jerk and angles hold for all t: they are
on Bezier coefficients. Other limits are sampled.

Where time does not matter, only the shape is sought: all pieces take the same time, no speed, acceleration or jerk is
bounded, and the exact time scaling of a solution restores the limits. A motion whose ends move cannot be scaled; its
durations are always variables.

Of several goals a descent keeps to the one that its start misses least.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix, as_array
from problems.certify import safe_time_scale
from problems.families.splines.encoding import stops
from problems.families.splines.pieces import SHORTEST, Pieces, PieceVariables, Waypoints, node_times, through
from problems.families.splines.starts import MoveStarts, PassedMotion
from problems.limits import SAMPLING_MARGIN, Constraint, Limit, StepLimit, stay_constraints, stay_matters, stay_shares
from problems.motions import Samples, Trajectory
from problems.objectives import Objective
from problems.programs import (
    MAX_ANGLE_CHANGE,
    MotionProgram,
    composed_hessian,
    equality,
    replace_with_symbols,
    slack_constraints,
)
from problems.robots import Robot
from problems.tasks import ANGLE_TOLERANCE, Move, Place, narrow_elbow

ALLOWANCE = 1e-3  # of the margin, left of what holds for all t and only rounding may break


def place_rows(task: Move, theta: Matrix, misses: Matrix) -> list[Constraint]:
    """Start, vias and goal.

    Args:
        task: whose.
        theta: angles at the waypoints, (waypoints, k), rad.
        misses: by how much each of several goals is missed, (m, 1), of about 1; which of them must be zero is for the
            bounds of these variables to say. Empty where there is one goal.
    """
    robot = task.robot
    named = [("start", task.start), *((f"via {number}", via) for number, via in enumerate(task.vias, start=1))]
    rows = [_place_row(robot, name, place, theta[row, :]) for row, (name, place) in enumerate(named)]
    goals = [_place_row(robot, "goal", goal, theta[-1, :]) for goal in task.goals]
    if len(goals) > 1:
        parts = ca.vertsplit(misses, np.cumsum([0, *(len(goal.columns) for goal in goals)]).tolist())
        each = zip(task.goals, goals, parts, strict=True)
        goals = [replace(row, expression=row.expression - _size(robot, goal) * part.T) for goal, row, part in each]
    return [*rows, *goals]


def goal_misses(task: Move, theta: FloatArray) -> list[FloatArray]:
    """Misses of each of several goals by a posture (k,), as the variables say it, each (m,); empty for one goal."""
    robot, posture = task.robot, ca.DM(theta).T
    if len(task.goals) == 1:
        return []
    return [as_array(goal.miss(robot, posture)).ravel() / _size(robot, goal) for goal in task.goals]


def _size(robot: Robot, place: Place) -> float:
    """The size that makes a miss dimensionless."""
    return place.tolerance(robot) / ANGLE_TOLERANCE


def _place_row(robot: Robot, name: str, place: Place, theta: Matrix) -> Constraint:
    miss = place.miss(robot, theta)
    columns = [str(number) for number in range(1, miss.shape[1] + 1)]
    return equality(name, miss, place.unit, columns, f"the motion is at {name}", _size(robot, place))


@dataclass(frozen=True)
class ExactRows:
    """Limits of angles and derivatives on Bezier coefficients, between which these stay for all t.

    Args:
        variables: of the motion.
        pieces: the same, in symbols.
        waypoints: which nodes are waypoints.
        moving: whether ends move, so that a solution cannot be scaled in time.
        margin: of limits that are sampled; these ones need but a small part of it.
    """

    variables: PieceVariables
    pieces: Pieces
    waypoints: NDArray[np.intp]
    moving: bool
    margin: float

    def of(self, limits: Iterable[Limit]) -> list[Constraint]:
        """The rows of those limits that bound angles or, where time counts, a derivative of them."""
        rows = []
        for limit in limits:
            if limit.order == 0:
                rows += self._range(limit)
            elif limit.order is not None and self.variables.timed:
                values = self._values(limit.order) / self.variables.unit**limit.order
                chosen = limit.constraints_at(self._samples(limit.order, values))
                rows += [self._narrowed(row) for row in chosen] if self.moving else chosen
        return rows

    def _samples(self, order: int, values: Matrix) -> Samples:
        """Samples of one derivative."""
        derivatives = *((None,) * order), values
        return Samples(robot=self.variables.robot, derivatives=derivatives, duration=ca.DM.nan())

    def _values(self, order: int) -> Matrix:
        """Bezier coefficients of a derivative, scaled; without those at the ends, which are given."""
        pieces, smooth = self.pieces, self.variables.smooth
        if order == 1:
            return ca.vertcat(pieces.speed[1:-1, :], pieces.middle[1:-1, :] if smooth else pieces.middle)
        if order == 2:
            return pieces.before[1:, :] if smooth else ca.vertcat(pieces.before, pieces.after)
        assert pieces.jerk is not None  # where it is limited
        return pieces.jerk

    def _range(self, limit: Limit) -> list[Constraint]:
        """The angles between waypoints; next to one, which may be at the end of a range, without allowance."""
        after, before = self.pieces.inner_angles
        beside = ca.vertcat(after[self.waypoints[:-1].tolist(), :], before[(self.waypoints[1:] - 1).tolist(), :])
        inner = np.setdiff1d(np.arange(self.variables.count), self.waypoints)
        apart = ca.vertcat(
            self.pieces.theta[inner.tolist(), :], after[inner.tolist(), :], before[(inner - 1).tolist(), :]
        )
        return [
            *limit.constraints_at(self._samples(0, apart), ALLOWANCE * self.margin),
            *limit.constraints_at(self._samples(0, beside)),
        ]

    def _narrowed(self, row: Constraint) -> Constraint:
        """The row with the allowance of a motion that cannot be scaled."""
        share = 1.0 - ALLOWANCE * self.margin
        assert row.lower is not None
        assert row.upper is not None
        return replace(row, lower=row.lower * share, upper=row.upper * share)


@dataclass(frozen=True)
class MoveBounds:
    """Bounds around a start.

    Args:
        task: whose.
        variables: of the motion; behind them are the misses of several goals, then slacks.
        waypoints: which nodes are waypoints.
    """

    task: Move
    variables: PieceVariables
    waypoints: NDArray[np.intp]

    def near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of variables (n,), both (n,)."""
        lower, upper = np.full(x.size, -np.inf), np.full(x.size, np.inf)
        goal = self.task.reached_goal(self.variables.end_postures(x)[1])
        self._angles(x, goal, lower, upper)
        self._ends(lower, upper)
        lower[self.variables.slices[-1]] = SHORTEST
        motion = sum(self.variables.sizes)
        kept = self._kept(goal)
        lower[motion : motion + kept.size][kept] = upper[motion : motion + kept.size][kept] = 0.0
        lower[motion + kept.size :] = 0.0
        return lower, upper

    def _angles(self, x: FloatArray, goal: Place, lower: FloatArray, upper: FloatArray) -> None:
        """Ranges, and elbows at the waypoints; in place."""
        robot, nodes, theta = self.task.robot, self.variables.count + 1, self.variables.slices[0]
        lower[theta], upper[theta] = (
            (x[theta] - MAX_ANGLE_CHANGE, x[theta] + MAX_ANGLE_CHANGE)
            if robot.limits.position is None
            else np.repeat(np.array(robot.limits.position), nodes, axis=0).T
        )
        for node, place in zip(self.waypoints.tolist(), [self.task.start, *self.task.vias, goal], strict=True):
            if place.chosen_by_inverse_kinematics:  # theta_2 is the second column
                narrow_elbow(robot, self.task.elbow, x, nodes + node, lower, upper)

    def _ends(self, lower: FloatArray, upper: FloatArray) -> None:
        """Velocities, and accelerations where they are continuous; in place."""
        _, speed, acceleration, *_ = self.variables.slices
        velocities = self.task.end_velocities * self.variables.unit
        fixed = [(speed, velocities), *([(acceleration, 0.0 * velocities)] if self.variables.smooth else [])]
        for block, values in fixed:
            for bound in (lower, upper):
                bound[block].reshape(self.task.robot.dof, -1)[:, [0, -1]] = values.T

    def _kept(self, goal: Place) -> NDArray[np.bool_]:
        """Flags of the misses of several goals that are those of one of them."""
        sizes = [miss.size for miss in goal_misses(self.task, np.zeros(self.task.robot.dof))]
        return np.repeat([other is goal for other in self.task.goals], sizes or 0)


SAMPLED_STEPS = 36  # time steps of the whole motion at the least, where something is sampled
PIECES_ALONE, PIECES_BETWEEN_VIAS = 12, 7
FINER = 3  # times as many steps: torques that 4 of a piece miss by 2 % are missed by 0.2 %
LEAST_STEPS, DYNAMIC_STEPS = 2, 4  # of a piece; where torques count, which bend more
NEAR_TIMES = 101  # at which it is seen how far a motion is from its limits
SHAPE_UNIT = 0.25  # s, of time, where the shape alone is sought and takes a second


def usual_pieces(task: Move) -> int:
    """Pieces between one waypoint and the next with which least times are within about 1e-3 of the optimum."""
    return PIECES_BETWEEN_VIAS if task.vias else PIECES_ALONE


SPARE_TIME = 1e-6  # of the shortest duration: what moves at its ends is not slowed down, and IPOPT leaves some 1e-8


@dataclass(frozen=True)
class MoveNlp(MotionProgram):
    """Move from the start through the vias to a goal.

    Args:
        task: the statement: robot, places, velocities at the ends, obstacles.
        objective: what is minimised.
        limits: what holds.
        pieces: between one waypoint and the next.
        decode: the motion of a search vector (d,).
        sampling: how many times as many samples of what is sampled there are as usual.
    """

    takes_any_motion: ClassVar[bool] = True

    task: Move
    objective: Objective
    limits: tuple[Limit, ...]
    pieces: int
    decode: Callable[[FloatArray], Trajectory]
    sampling: int = 1

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @property
    def has_free_durations(self) -> bool:
        """Whether durations are variables: where they matter, and where ends move."""
        return super().has_free_durations or not self.task.at_rest

    @cached_property
    def variables(self) -> PieceVariables:
        """The layout of the motion's variables."""
        smooth = not self.has_free_durations or any(limit.order == 3 for limit in self.limits)
        count = self.pieces * (len(self.task.vias) + 1)
        unit = _time_unit(self.robot) if self.has_free_durations else SHAPE_UNIT
        return PieceVariables(self.robot, count, smooth, self.has_free_durations, unit)

    @property
    def _is_dynamic(self) -> bool:
        """Whether torques count, or what bends as they do: between samples then has to be little, in every piece."""
        return self.objective.is_integral or any(limit.bends or _is_dynamic(limit) for limit in self.limits)

    def near(self, trajectory: Trajectory) -> MoveNlp:
        """Without the limits, or the pairs that have to keep apart, from which a motion is far, if there are any."""
        samples = trajectory.samples(trajectory.times(NEAR_TIMES), self.robot)
        limits = tuple(kept for limit in self.limits if (kept := limit.near(samples)) is not None)
        return self if limits == self.limits else replace(self, limits=limits)

    @property
    def waypoints(self) -> NDArray[np.intp]:
        """Numbers of the nodes that are waypoints, (waypoints,)."""
        return np.arange(0, self.variables.count + 1, self.pieces)

    @property
    def steps(self) -> int:
        """Time steps of a piece."""
        least = DYNAMIC_STEPS if self._is_dynamic else LEAST_STEPS
        return self.sampling * max(least, -(-SAMPLED_STEPS // self.variables.count))

    def finer(self) -> MoveNlp:
        return replace(self, sampling=FINER) if self._is_dynamic and self.has_free_durations else self

    @cached_property
    def _symbols(self) -> tuple[ca.SX, Pieces, ca.SX, ca.SX]:
        """Variables of the motion, the same in parts, misses of several goals, slacks of the rotation."""
        x, k = ca.SX.sym("x", sum(self.variables.sizes)), self.robot.dof
        slacks = self.objective.slack_count(self.robot, self.variables.count * self.steps)
        misses = ca.SX.sym("miss", sum(miss.size for miss in goal_misses(self.task, np.zeros(k))))
        return x, self.variables.split(x), misses, ca.SX.sym("slack", slacks // k, k)

    @cached_property
    def _samples(self) -> Samples:
        pieces = self._symbols[1]
        samples = self.variables.samples(pieces, self.steps)
        if not self.variables.smooth and self._is_dynamic:
            samples = replace(samples, before_jumps=self.variables.before_jumps(pieces))
        return replace(samples, quadrature=self.variables.quadrature(pieces)) if self.objective.is_integral else samples

    @cached_property
    def x(self) -> ca.SX:
        """The motion, by how much each of several goals is missed, slacks of the rotation."""
        x, _, misses, slack = self._symbols
        return ca.vertcat(x, misses, ca.vec(slack))

    @property
    def names(self) -> tuple[str, ...]:
        _, _, misses, slack = self._symbols
        numbered = [("miss", misses.numel()), ("slack", slack.numel())]
        return (*self.variables.names, *(f"{s}[{i}]" for s, n in numbered for i in range(1, n + 1)))

    @property
    def objective_size(self) -> float:
        """A value of the usual size for this robot; of what depends on the duration alone, that of the time unit."""
        terminal = float(self.objective.terminal(ca.DM(self.variables.unit)))
        return terminal if terminal > 0.0 and not self.objective.is_integral else super().objective_size

    @cached_property
    def f(self) -> Matrix:
        return self.objective.smooth(self._samples, self._symbols[3]) / self.objective_size

    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        return self._constraints(self._samples, margin)

    def _constraints(self, samples: Samples, margin: float) -> tuple[Constraint, ...]:
        """Constraints on samples of the motion, or on symbols in their place."""
        _, pieces, misses, slack = self._symbols
        exact = ExactRows(self.variables, pieces, self.waypoints, not self.task.at_rest, margin)
        rows = [
            *self.variables.joins(pieces),
            *place_rows(self.task, pieces.theta[self.waypoints.tolist(), :], misses),
            *exact.of(self.limits),
        ]
        for limit in self.sampled_limits:
            if limit.order is None:
                rows += limit.constraints(samples.both_sides if _is_dynamic(limit) else samples, margin)
        rows += self.variables.evenness(pieces, self.pieces) if self.has_free_durations and self._is_dynamic else []
        bounds, stay = self.task.duration_bounds, self.task.stay
        spare = 0.0 if self.task.at_rest else SPARE_TIME
        rows += [] if bounds is None else [bounds.at(samples.duration, margin, spare)]
        if stay_matters(self.limits, stay):
            goal, since = samples.derivative(0)[-1, :], ca.DM(stay_shares(stay) * stay)
            rows += stay_constraints(self.limits, self.robot, goal, samples.duration, since, margin)
        step = StepLimit.for_robot(self.robot, self.task.obstacles)
        rows += [] if step is None else step.constraints(samples)
        return (*rows, *slack_constraints(self.objective, samples, slack))

    @cached_property
    def hessian(self) -> ca.Function | None:
        """The Hessian in two steps, over the samples, where limits or the objective are sampled; else None."""
        if all(limit.order is not None for limit in self.limits) and not self.objective.is_integral:
            return None
        y, inner, samples = replace_with_symbols(self._samples)
        g = ca.vertcat(*(row.row_values() for row in self._constraints(samples, SAMPLING_MARGIN)))
        f = self.objective.smooth(samples, self._symbols[3]) / self.objective_size
        return composed_hessian(self.x, y, inner, f, g)

    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint ranges, elbows, velocities and accelerations at the ends, least durations, the nearest goal.

        Without joint ranges an angle stays within ``MAX_ANGLE_CHANGE`` of where it starts.
        """
        return MoveBounds(self.task, self.variables, self.waypoints).near(x)

    def from_search(self, x: FloatArray) -> FloatArray:
        return self.from_trajectory(self.decode(x))

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """Nodes where the places are passed; between them at the motion's own breakpoints, or at equal times."""
        passed = np.concatenate([[0.0], self.task.via_times(trajectory), [trajectory.duration]])
        return self._variables(PassedMotion(trajectory, passed))

    def _variables(self, motion: PassedMotion) -> FloatArray:
        x = self.variables.of(motion.trajectory, self.node_times(motion))
        misses = goal_misses(self.task, self.variables.end_postures(x)[1])
        return np.concatenate([x, *misses, self.objective.slack_values(as_array(self._angles(x)))])

    def node_times(self, motion: PassedMotion) -> FloatArray:
        """The times of the nodes on a motion, (N + 1,), s: equal steps where torques count."""
        if self._is_dynamic:
            nodes = np.arange(self.variables.count + 1) / self.pieces
            return np.interp(nodes, np.arange(motion.times.size), motion.times)
        return node_times(motion.trajectory, motion.times, self.pieces, self.robot.limits)

    @cached_property
    def _angles(self) -> ca.Function:
        """The angles at the samples, of the variables of the motion."""
        return ca.Function("angles", [self._symbols[0]], [self._samples.theta])

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        return map(self._variables, MoveStarts(self.task, self.objective, self.limits).sequence(rng))

    def trajectory(self, x: FloatArray) -> Trajectory:
        motion = through(self.variables.accelerations(x), self._exact_waypoints(x), self.variables.smooth)
        if not self.task.at_rest:
            return motion
        least, bounds = safe_time_scale(self.limits, motion), self.task.duration_bounds
        if self.depends_on_speed or not self.objective.sooner_is_better:
            least = max(1.0, least)
        if bounds is not None:
            least = max(least, bounds.time_scale(np.array([motion.duration])))
        return motion.time_scaled(least)

    def _exact_waypoints(self, x: FloatArray) -> Waypoints:
        """The waypoints of a solution, exactly at their places."""
        angles = x[self.variables.slices[0]].reshape(self.robot.dof, -1).T[self.waypoints]
        places = [self.task.start, *self.task.vias, self.task.reached_goal(angles[-1])]
        theta = [place.projected(self.robot, posture) for place, posture in zip(places, angles, strict=True)]
        return Waypoints(self.waypoints, np.array(theta), self.task.end_velocities)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The postures at the stops of a solution, rad, and when they are passed, s: of the finished motion."""
        motion = self.trajectory(x)
        passed = motion.breakpoints[self.waypoints]
        theta = {f"theta_{stop.name}": row for stop, row in zip(stops(self.task), motion.at(passed), strict=True)}
        return {**theta, "t_stops": passed}


def _is_dynamic(limit: Limit) -> bool:
    """Whether it depends on accelerations as torques do, and on one sample at a time."""
    return limit.order is None and limit.scales_with_time


def _time_unit(robot: Robot) -> float:
    """How long the robot's joints take for a radian, about, s."""
    limits = robot.limits
    times = [1.0 / np.array(limits.speed), np.array(limits.acceleration) ** -0.5]
    times += [] if limits.jerk is None else [np.array(limits.jerk) ** (-1.0 / 3.0)]
    return float(np.median(np.max(times, axis=0)))
