"""Moves by splines whose timing follows from the limits."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.assembly import (
    CostSteps,
    LocalTimeScale,
    PathTiming,
    Problem,
    SearchedTimeScale,
    objective_named,
    peak_loop,
)
from problems.base import FloatArray, InvalidProblem, Matrix, Operand, as_array, split
from problems.evaluation import EvaluationOptions, Loop, PopulationFunction, Program, Step
from problems.families.splines.branches import branch_posture, branched, least_time, on_postures
from problems.families.splines.encoding import ControlPoints, nominal, stops
from problems.families.splines.program import MoveNlp, usual_pieces
from problems.limits import (
    MAX_STEP_SHARE,
    SAMPLING_MARGIN,
    Constraint,
    LimitKind,
    StepLimit,
    limits_of,
    looks,
    stay_constraints,
    stay_matters,
)
from problems.motions import (
    ALONG,
    SUPPORT,
    Bounds,
    JointPath,
    PathSpline,
    Rates,
    TimedPath,
    TorqueSlopes,
    Trajectory,
    advance,
    before,
    gap,
    in_time,
    interval_time,
    limited,
)
from problems.objectives import Objective
from problems.robots import JointLimits
from problems.sequential import Polish, can_be_polished
from problems.tasks import Milestone, Move, check_at_least
from problems.timing import SpeedProfile, retime


@dataclass(frozen=True, kw_only=True)
class SplineProblem(Problem[TimedPath]):
    """A path in joint space, run as fast as the limits allow."""

    free_timing: ClassVar[bool] = True

    motion: PathSpline
    encoding: PathTiming

    @cached_property
    def _path(self) -> ca.Function:
        x = ca.SX.sym("x", len(self.variables))
        points, (start, goal) = self.encoding.path(x)
        return ca.Function("path", [x], [points, ca.sqrt(start), ca.DM(0.0) if goal is None else ca.sqrt(goal)])

    def path(self, x: FloatArray) -> JointPath:
        """The path of one candidate (d,), with a parameter u in [0, 1]."""
        return self.motion.path(as_array(self._path(x)[0]))

    def trajectory(self, x: FloatArray) -> Trajectory:
        """The least time along the path of one candidate (d,), or one near it, in which its limits hold for all t.

        Where an obstacle moves, the timing of the search instead, slower only as far as its limits ask between samples.

        Where there is none, as the path stands still or its ends cannot be passed at the given velocities, the motion
        of the search's own timing.
        """
        return self._timed(x, self.robot.limits, refined=not self.is_polished)

    def quick_trajectory(self, x: FloatArray) -> Trajectory:
        """The least time without a jerk limit, found much sooner: where a descent may begin."""
        return self._timed(x, replace(self.robot.limits, jerk=None))

    def _timed(self, x: FloatArray, limits: JointLimits, refined: bool = True) -> Trajectory:
        """In the least time; in the search's own duration where that is a variable, at its times where they matter."""
        points, *rates = (as_array(part) for part in self._path(x))
        start, goal = (float(rate[0, 0]) for rate in rates)
        try:
            path, chain = self.motion.path(points), self.robot.rigid_chain
            least = retime(path, limits, (start, goal), refined, chain, self._ceiling(x))
        except InvalidProblem:
            return super().trajectory(x)
        if self.encoding.time_scale is None:
            return least
        return least.time_scaled(max(1.0, float(self.parameters_of(x).duration) / least.duration))

    def _ceiling(self, x: FloatArray) -> SpeedProfile | None:
        """The timing of the search, where an obstacle moves: a faster motion would come too early."""
        if self.encoding.local_time_scale is None:
            return None
        return SpeedProfile(self.motion.parameters_u, as_array(self.parameters_of(x).squared).ravel())

    def exact_time_scale(self, trajectory: Trajectory) -> float:
        """How much slower, or faster, a trajectory has to be run; 1 where an end moves, whose velocity is given."""
        return super().exact_time_scale(trajectory) if self.encoding.at_rest else 1.0

    def safe_time_scale(self, trajectory: Trajectory) -> float:
        """The same and a little more, so that rounding breaks no limit."""
        return super().safe_time_scale(trajectory) if self.encoding.at_rest else 1.0


GAP_TOLERANCE = 1e-9  # relative, of (du/dt)^2 at the ends


def end_rates(found: Matrix) -> Constraint:
    """The velocities at the ends can be attained on the path, given by how much not."""
    return Constraint(
        name="end velocities",
        unit="1",
        expression=found,
        lower=None,
        upper=ca.DM([[GAP_TOLERANCE]]),
        columns=("path",),
        for_all_t=False,
        formula="(du/dt)^2 at both ends is neither above nor below what can be attained on the path",
    )


class MoveSteps(CostSteps[TimedPath]):
    """Backward over the grid for the largest (du/dt)^2, forward for the timing; then as any motion."""

    encoding: PathTiming
    motion: PathSpline

    @property
    def torque(self) -> tuple[Operand, ...]:
        """The torque limits that the timing keeps, N m or N; empty where there are none."""
        return tuple(self.motion.robot.limits.torque or ()) if limited(self.motion.robot) else ()

    @property
    def further_penalties(self) -> tuple[str, ...]:
        """Those of ends that cannot be attained, of stops that may be missed, of what comes near after arrival."""
        ends = () if self.encoding.at_rest else ("ends",)
        missed = ("missed",) if self.encoding.may_miss else ()
        return (*ends, *missed, *(("stay",) if self.stays else ()))

    @property
    def stays(self) -> bool:
        """Whether it matters what comes near after arrival."""
        return stay_matters(self.limits, self.encoding.task.stay)

    def further_steps(self, orders: tuple[int, ...]) -> list[Step]:
        """A loop over the time after arrival."""
        return [*super().further_steps(orders), *([self._stay()] if self.stays else [])]

    def _stay(self) -> Step:
        given = {"p": self.p, "window": ca.SX.sym("window", self.motion.robot.dof), "row": ca.SX.sym("row")}
        state = {"stay": ca.SX.sym("stay"), "durations": ca.SX.sym("durations")}
        theta, arrival, since = given["window"].T, state["durations"], given["row"] * self.encoding.task.stay
        found = stay_constraints(self.limits, self.motion.robot, theta, arrival, since, SAMPLING_MARGIN)
        penalty = sum((self.encoding.penalty(constraint) for constraint in found), ca.DM(0))
        shares = looks(self.seconds_stayed)[:, None]
        loop = Loop(rows=shares, window="goal", starts=np.zeros(len(shares), dtype=np.intp))
        return Step.of("stay", given | state, {"stay": state["stay"] + penalty}, loop)

    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
        """The steps from the candidate to the motion's samples."""
        zeros = {name: ca.SX.zeros(size) for name, size in starting_values.items()}
        stacks = {"blocks": orders} if starting_values or orders else {}
        peaks = peak_loop(self.motion, self.slowing, self.p) if self.slowing else None
        untouched = self.duration_bounds is None or not self.encoding.at_rest
        if peaks is None and untouched and self.encoding.time_scale is None:
            return self._scan(stacks, "durations", zeros)
        stacks = {f"raw_{name}": held for name, held in stacks.items()}
        if peaks is None:
            return [*self._scan(stacks, "shape_durations", zeros), *self._slow_down(stacks)]
        zeros["peaks"] = ca.SX.zeros(peaks.starting_values["peaks"])
        scan = self._scan({**stacks, "shape_blocks": peaks.orders}, "shape_durations", zeros)
        return [*scan, peaks.step, *self._slow_down(stacks, zeros["peaks"].shape[0])]

    def _scan(self, stacks: Mapping[str, tuple[int, ...]], durations: str, zeros: Mapping[str, ca.SX]) -> list[Step]:
        """Decode, scan backward and forward.

        Args:
            stacks: of samples, to be written: the orders of the derivatives that they hold.
            durations: the name of the duration.
            zeros: further vectors to begin with.
        """
        along = sorted({n for held in stacks.values() for order in held for n in ALONG[order]})
        begin = {
            "ahead": ca.SX.zeros(2 * self.motion.robot.dof),
            durations: ca.SX(0),
            **({"torques": ca.SX.zeros(3 * self.motion.robot.dof)} if self.torque else {}),
            **({"passed": ca.SX.zeros(2)} if stacks else {}),
            **({} if self.encoding.at_rest else {"ends": ca.SX(0)}),
            **zeros,
        }
        steps = [*self.path_steps(begin), self._backward(along)]
        if not self.encoding.at_rest:
            steps.append(self._ends())
        return [*steps, self._forward(stacks, along, durations)]

    def path_steps(self, begin: Mapping[str, ca.SX]) -> list[Step]:
        """The steps that decode a candidate: control points, (du/dt)^2 at both ends, and vectors to begin with."""
        points, rates, arrival = self.encoding.path_and_arrival(self.x)
        missed = {} if arrival is None else {"missed": self.encoding.penalty(arrival)}
        stays = {"goal": points[-1, :].T, "stay": ca.SX(0)} if self.stays else {}
        outputs = {**self.path_vectors(points, rates), **self.speed_share_vector(), **begin, **missed, **stays}
        return [Step.of("path", {"x": self.x, "p": self.p}, outputs)]

    def speed_share_vector(self) -> dict[str, Matrix]:
        """How fast the path is run, where that is a variable: logarithms of shares of the speed limits, at knots."""
        logarithms = self.encoding.speed_share_logarithms(self.x)
        return {} if logarithms is None else {"speed_shares": logarithms}

    def path_vectors(self, points: Matrix, rates: Rates) -> dict[str, Matrix]:
        """What the scan reads of a path."""
        start, goal = rates
        ends = {
            "squared": start,
            "most": ca.SX(0) if goal is None else goal,
            **({} if goal is None else {"least": goal}),
        }
        return {"control_points": ca.vec(points.T), **ends}

    def _backward(self, along: Sequence[int]) -> Step:
        """What b may be at each grid point, from the last to the first; kept with what the scan forward needs."""
        motion, k, grid = self.motion, self.motion.robot.dof, self.motion.path_grid
        stops = np.isin(np.arange(len(grid.rows)), motion.stops)
        further = [
            *([self.encoding.share_rows] if self.encoding.local_time_scale else []),
            *([stops] if motion.stops else []),
        ]
        rows = np.column_stack([grid.rows, *further, np.append(motion.double_steps, 0.0)])
        window, row = ca.SX.sym("window", SUPPORT * k), ca.SX.sym("row", rows.shape[1])
        given = {"p": self.p, "window": window, "row": row}
        state = {"most": ca.SX.sym("most"), "ahead": ca.SX.sym("ahead", 2 * k)}
        if self.encoding.moving_ends[1]:
            state["least"] = ca.SX.sym("least")
        if not self.encoding.at_rest:
            state["ends"] = ca.SX.sym("ends")
        if self.torque:
            state["torques"] = ca.SX.sym("torques", 3 * k)
        needed = {*along, 1, 2, *([0] if self.torque else [])}
        path, step = motion.along(window, row[:-1], needed), row[-1]
        speed: Sequence[Operand] = motion.robot.limits.speed
        if self.encoding.local_time_scale is not None:
            first, knots = grid.rows.shape[1], self.encoding.share_rows.shape[1]
            given["speed_shares"] = ca.SX.sym("speed_shares", knots)
            share = ca.exp(ca.dot(row[first : first + knots], given["speed_shares"]))
            speed = [limit * share for limit in speed]
        here, ahead = (path[1], path[2]), (state["ahead"][:k].T, state["ahead"][k:].T)
        bounds, outputs = Bounds.of_interval(here, ahead, step, motion.acceleration), {}
        if self.torque:
            torques = TorqueSlopes.along(motion.robot, path[0], *here)
            far = TorqueSlopes.unstacked(state["torques"]).seen_before(step)
            bounds, outputs["torques"] = bounds.with_torques((torques, far), self.torque), torques.stacked
        most, least, between = before(here, bounds, step, state["most"], state.get("least"), speed)
        outputs["most"] = ca.if_else(row[-2] > 0.5, 0.0, most) if motion.stops else most
        outputs["ahead"] = ca.horzcat(*here).T
        if least is not None:
            outputs["least"] = least
        if "ends" in state:
            outputs["ends"] = state["ends"] + between
        outputs["scanned"] = ca.vertcat(state["most"], bounds.room, bounds.tilt, *(path[n].T for n in along))
        loop = Loop(rows=rows[::-1], window="control_points", starts=grid.pieces[::-1] * k)
        return Step.of("backward", given | state, outputs, loop, stacked=("scanned",))

    def _ends(self) -> Step:
        """The penalty for velocities at the ends that cannot be attained."""
        names = ["ends", "squared", "most", *(["least"] if self.encoding.moving_ends[1] else [])]
        given = {name: ca.SX.sym(name) for name in names}
        found = given["ends"] + gap(given["squared"], given["most"])
        if "least" in given:
            found = found + gap(given["least"], given["squared"])
        return Step.of("ends", given, {"ends": self.encoding.penalty(end_rates(found))})

    def _forward(self, stacks: Mapping[str, tuple[int, ...]], along: Sequence[int], durations: str) -> Step:
        """The timing, from the first grid point to the last, and the samples."""
        motion, k, count = self.motion, self.motion.robot.dof, self.motion.parameters_u.size
        rows = 4 * k if self.torque else 2 * k
        size = 1 + 2 * rows + len(along) * k
        given = {"window": ca.SX.sym("window", size), "row": ca.SX.sym("row", 2)}
        state = {"squared": ca.SX.sym("squared"), durations: ca.SX.sym("durations")}
        most, room, tilt, *path = split(given["window"], [1, rows, rows, *[k] * len(along)])
        step, inner = given["row"][0], given["row"][1]
        c, squared = advance(Bounds(room, tilt), step, state["squared"], most)
        taken = interval_time(step, state["squared"], squared)
        outputs = {"squared": squared, durations: state[durations] + inner * taken}
        if stacks:
            state["passed"] = ca.SX.sym("passed", 2)  # c and the duration of the interval before
            c, taken = ca.if_else(inner > 0.5, c, state["passed"][0]), inner * taken
            found = {n: part.T for n, part in zip(along, path, strict=True)}
            clock = state[durations], (state["passed"][1] + taken) / 2.0
            for name, held in stacks.items():
                outputs[name] = ca.vertcat(*(in_time(order, found, state["squared"], c).T for order in held), *clock)
            outputs["passed"] = ca.vertcat(c, taken)
        grid = np.column_stack([np.append(motion.double_steps, 1.0), np.arange(count) < count - 1])
        loop = Loop(rows=grid, window="scanned", starts=np.arange(count)[::-1] * size)
        return Step.of("forward", given | state, outputs, loop, stacked=tuple(stacks))

    def _slow_down(self, stacks: Mapping[str, tuple[int, ...]], magnitudes: int = 0) -> list[Step]:
        """Run the motion more slowly, as far as the task and further limits want it."""
        duration, peaks = ca.SX.sym("duration"), ca.SX.sym("peaks", magnitudes)
        shape = TimedPath(ca.SX(0, 0), ca.SX(1), duration, ca.SX(0))
        slowed = self.encoding.timed(shape, self.slowing, self.peaks_of_each(peaks), self.x)
        given = {**self.time_scale_inputs, "shape_durations": duration}
        given |= {"peaks": peaks} if magnitudes else {}
        written = {"durations": slowed.duration, "slower": slowed.duration / duration}
        steps = [Step.of("slow", given, written)]
        for name, held in stacks.items():
            size, k = self.motion.piece_sizes(held)[0], self.motion.robot.dof
            window, slower = ca.SX.sym("window", size), ca.SX.sym("slower")
            powers = [slower**-order for order in held for _ in range(k)] + [slower, slower]
            loop = Loop(rows=self.motion.grid.rows, window=name, starts=self.motion.grid.pieces * size)
            blocks = name.removeprefix("raw_")
            outputs = {blocks: window * ca.vertcat(*powers)}
            steps.append(Step.of("slower", {"window": window, "slower": slower}, outputs, loop, stacked=(blocks,)))
        return steps


USUAL_PIECES = {1: 6, 2: 4, 3: 3}  # of the spline in each segment, by the number of segments
LEAST_PIECES = 2
LEAST_STEPS = 5  # of the grid in each piece
FINE = 50  # samples of a segment of the usual motion
DETOUR = 2.0  # lengths of the usual motion that a motion may have
MOST_SAMPLES = 600
MOVING_SHARE = 0.98  # of accelerations: between moving ends nothing can be slowed down for what a grid does not see
LEAST_SHARE = 0.1  # of the longest segment: no segment has less of the path parameter


def move(
    task: Move,
    objective: Objective | str = "time",
    samples: int = 60,
    pieces: int | None = None,
    limits: Sequence[LimitKind] = (),
) -> MoveProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, start, vias, goals, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        samples: steps of the path, at whose ends it is timed and checked; more where there are many pieces, or
            obstacles so small that one could be jumped over.
        pieces: of the spline between two stops; by the number of stops where None.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, too few samples or pieces, a pose without a clear posture, or an
            acceleration at the start.
    """
    check_at_least("samples", samples, 2)
    check_at_least("pieces", pieces, LEAST_PIECES)
    if any(task.start_acceleration):
        raise InvalidProblem("start_acceleration", "a path that is timed leaves at zero; needs motion = 'time-spline'")
    tasks = branched(task)
    segments = len(task.vias) + 1
    each = USUAL_PIECES.get(segments, LEAST_PIECES) if pieces is None else pieces
    steps, least = max(LEAST_STEPS, round(samples / (segments * each))), max(map(least_samples, tasks))
    while steps * segments * each < least:
        steps *= 2  # and not what is just enough: another number is compiled anew
    kept, minimised = limits_of(task.robot, task.obstacles, limits), objective_named(objective, task.robot)
    time_scale = SearchedTimeScale.where_needed(minimised, task)
    local_time_scale = LocalTimeScale.where_needed(task)
    start, goal = (task.is_timed and not velocity.any() for velocity in task.end_velocities)
    share = 1.0 if task.at_rest and not task.is_timed else MOVING_SHARE
    spline = PathSpline(task.robot, usual_nodes(tasks[0], each), steps, share, (start, goal))
    several = tasks[0].narrowed(tasks[0].start, tasks[0].vias, tuple(goal for one in tasks for goal in one.goals))
    problem, *branches = (
        MoveProblem(
            task=stated,
            motion=spline,
            encoding=ControlPoints(
                stated,
                spline,
                float(segment_durations(stated).sum()),
                time_scale=time_scale,
                local_time_scale=local_time_scale,
            ),
            objective=minimised,
            limits=kept,
        )
        for stated in (several, *(tasks if len(tasks) > 1 else ()))
    )
    return replace(problem, branches=_sharing_structure(branches)) if branches else problem


def usual_nodes(task: Move, each: int) -> tuple[float, ...]:
    """Nodes of a spline with so many pieces in each segment, which has as much of it as it usually takes time."""
    durations = segment_durations(task)
    lengths = np.maximum(durations, LEAST_SHARE * durations.max())
    stops, segments = np.append(0.0, np.cumsum(lengths)), durations.size
    nodes = np.interp(np.arange(segments * each + 1) / each, np.arange(segments + 1), stops)
    return tuple((nodes / nodes[-1]).tolist())


def _sharing_structure(problems: Iterable[MoveProblem]) -> tuple[MoveProblem, ...]:
    """The same problems; those of one make share the steps of one program."""
    first: dict[object, MoveProblem] = {}
    return tuple(replace(each, same_structure_as=first.setdefault(each.structure_key, each)) for each in problems)


def least_samples(task: Move) -> int:
    """How many steps it takes that a motion somewhat longer than the usual one jumps over no obstacle."""
    step = StepLimit.for_robot(task.robot, task.obstacles)
    if step is None:
        return 0
    stops = np.concatenate([as_array(posture) for posture in nominal(task)])
    between = np.linspace(0.0, len(stops) - 1.0, FINE * (len(stops) - 1) + 1)
    theta = np.column_stack([np.interp(between, np.arange(len(stops)), column) for column in stops.T])
    travel = np.linalg.norm(np.diff(task.robot.skeleton(theta), axis=0), axis=2).sum(axis=0).max()
    return min(MOST_SAMPLES, ceil(DETOUR * float(travel) / (MAX_STEP_SHARE * step.width)))


def segment_durations(task: Move) -> FloatArray:
    """Roughly how long each segment takes on a straight line between usual postures, (segments,), s."""
    limits = task.robot.limits
    speed, acceleration = np.array(limits.speed), np.array(limits.acceleration)
    distances = np.abs(np.diff(np.concatenate([as_array(posture) for posture in nominal(task)]), axis=0))
    return np.asarray((distances / speed).max(axis=1)) + float((speed / acceleration).max())


@dataclass(frozen=True, kw_only=True)
class MoveProblem(SplineProblem):
    """Move from a place to another, by way of others.

    Attributes:
        branches: where places leave several postures to inverse kinematics, the problems that keep to one of them each;
            all of one make have the same program, with other numbers.
        same_structure_as: the problem whose program has the same steps; itself where None.
    """

    task: Move
    motion: PathSpline
    encoding: ControlPoints
    branches: tuple[MoveProblem, ...] = ()
    same_structure_as: MoveProblem | None = None

    @property
    def branch(self) -> dict[str, FloatArray]:
        """The postures of the stops that have several, where one has been chosen at each."""
        if self.branches:
            return {}
        raced = self.same_structure_as is not None
        listed = [stop for stop in stops(self.task) if stop.may_be_missed or (raced and stop.name == "goal")]
        return {stop.name: branch_posture(self.robot, stop.places[0]) for stop in listed}

    def on_branch(self, branch: Mapping[str, FloatArray]) -> MoveProblem:
        """The same problem on the branches of given postures."""
        own = (self.branches or (self,))[0]
        if set(branch) != set(own.branch):
            raise InvalidProblem("branches", f"postures at {', '.join(own.branch) or 'no stop'} are needed")
        task = on_postures(self.task, branch)
        duration = float(segment_durations(task).sum())
        encoding = replace(self.encoding, task=task, usual_duration=duration)
        found = replace(own, task=task, encoding=encoding, same_structure_as=None)
        return replace(
            found,
            same_structure_as=next((each for each in self.branches if each.structure_key == found.structure_key), None),
        )

    @property
    def free_space_time(self) -> float:
        """Of straight lines in joint space, with a stop at each via."""
        return least_time(self.task)

    @property
    def structure_key(self) -> Hashable:
        """What is the same for problems whose programs differ in their numbers alone."""
        return self.variables

    def point_constraints(self, parameters: TimedPath) -> list[Constraint]:
        """The length of steps, with obstacles; velocities at the ends that can be attained; what stays clear after."""
        found = super().point_constraints(parameters)
        found += [] if self.encoding.at_rest else [end_rates(parameters.gap)]
        if not stay_matters(self.limits, self.task.stay):
            return found
        goal, since = parameters.control_points[-1, :], ca.DM(looks(self.task.stay) * self.task.stay)
        return [*found, *stay_constraints(self.limits, self.robot, goal, parameters.duration, since, SAMPLING_MARGIN)]

    def cost_program(self) -> Program:
        """Path, scan backward, scan forward, [slow down,] sample, finish."""
        steps = MoveSteps(self)
        return (
            steps.program()
            if self.same_structure_as is None
            else self.same_structure_as.program.with_numbers(steps.arguments.values)
        )

    def new_evaluator(self, options: EvaluationOptions) -> PopulationFunction:
        """That of the sibling with other numbers, where there is one."""
        if self.same_structure_as is None:
            return super().new_evaluator(options)
        return self.same_structure_as.evaluator(options).with_numbers(self.program.parameters)

    def nlp(self) -> MoveNlp:
        """The same problem for solvers that follow gradients: cubic pieces in time, not a spline."""
        return MoveNlp(self.task, self.objective, self.limits, usual_pieces(self.task), self.quick_trajectory)

    @cached_property
    def _has_polish(self) -> bool:
        """Whether sequential linear programs know all that is asked for."""
        least_time = self.objective.timed and self.objective.sooner_is_better
        return least_time and can_be_polished(self.task, self.limits)

    @property
    def is_polished(self) -> bool:
        """In space, where there is a polish; in the plane a nonlinear program may do as well."""
        return self._has_polish and self.robot.dim == 3

    @property
    def ends_may_move(self) -> bool:
        """Where an end is a pose, which leaves postures to choose."""
        ends = (self.task.start, *self.task.goals)
        return self.is_polished and not all(place.always_reached for place in ends)

    def polished(self, start: Trajectory) -> Iterator[Trajectory]:
        """What sequential linear programs over path and speed make of a motion.

        In the plane a nonlinear program does as well, unless torques are limited or obstacles move.
        """
        hard = self.robot.limits.torque is not None or any(obstacle.moves for obstacle in self.obstacles)
        needed = self.robot.dim == 3 or hard
        return self._polish(start) if needed and self._has_polish else iter(())

    @cached_property
    def _polish(self) -> Polish:
        return Polish(self.task, self.limits)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The postures at the stops of one candidate (d,), rad, and the path parameter there."""
        at = np.array(self.motion.nodes[:: self.encoding.pieces])
        names = [stop.name for stop in stops(self.task)]
        theta = {f"theta_{name}": row for name, row in zip(names, self.path(x).at(at), strict=True)}
        return {**theta, "u_stops": at}

    def milestones(self, trajectory: Trajectory) -> tuple[Milestone, ...]:
        """When the vias are passed."""
        times = self.task.via_times(trajectory)
        return tuple(Milestone(label=f"via {number}", time=float(t)) for number, t in enumerate(times, start=1))
