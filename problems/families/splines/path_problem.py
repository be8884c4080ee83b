"""Searches for a path whose timing follows from the limits: what all such problems are, and the steps of their cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Self

import casadi as ca
import numpy as np

from problems.assembly import CostSteps, PathTiming, Problem, peak_loop
from problems.base import FloatArray, InvalidProblem, Matrix, Operand, as_array, split
from problems.evaluation import Loop, Step
from problems.limits import SAMPLING_MARGIN, Constraint, stay_constraints, stay_matters, stay_shares
from problems.motions import (
    ALONG,
    GAUSS_SHARES,
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
    within,
)
from problems.robots import JointLimits
from problems.timing import SpeedProfile, retime


@dataclass(frozen=True, kw_only=True)
class SplineProblem(Problem[TimedPath]):
    """A path in joint space, run as fast as the limits allow."""

    motion: PathSpline
    encoding: PathTiming

    def with_integrals_at_samples(self) -> Self:
        """The problem whose search counts one side alone of every jump of an acceleration, and fixes no timing.

        So it was when the first suite of benchmarks was frozen.
        """
        if not self.motion.integrated:
            return self
        motion = replace(self.motion, integrated=False)
        return replace(self, motion=motion, encoding=replace(self.encoding, motion=motion))

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

        Where an obstacle moves, or something is integrated over time, the timing of the search instead, slower only as
        far as its limits ask between samples.

        Where there is none, as the path stands still or its ends cannot be passed at the given velocities, the motion
        of the search's own timing.
        """
        return self._timed(x, self.motion.robot.limits, refined=not self.direct.replaces_descents)

    def quick_trajectory(self, x: FloatArray) -> Trajectory:
        """The least time without a jerk limit, found much sooner: where a descent may begin."""
        return self._timed(x, replace(self.motion.robot.limits, jerk=None))

    def _timed(self, x: FloatArray, limits: JointLimits, refined: bool = True) -> Trajectory:
        """The motion in least time; in the search's duration where that is a variable, at its times where needed."""
        points, *rates = (as_array(part) for part in self._path(x))
        start, goal = (float(rate[0, 0]) for rate in rates)
        try:
            path, chain = self.motion.path(points), self.motion.robot.rigid_chain
            least = retime(path, limits, (start, goal), refined, chain, self._ceiling(x, limits))
        except InvalidProblem:
            return super().trajectory(x)
        if self.encoding.time_scale is None:
            return least
        return least.time_scaled(max(1.0, float(self.parameters_of(x).duration) / least.duration))

    def _ceiling(self, x: FloatArray, limits: JointLimits) -> SpeedProfile | None:
        """The timing of the search, where it matters: a faster motion would come too early, or take other torques.

        For torques alone it is not kept under jerk limits, which ask for another one: below it they cost too much time.
        """
        kept = self.motion.integrated and limits.jerk is None
        if self.encoding.local_time_scale is None and not kept:
            return None
        return SpeedProfile(self.motion.parameters_u, as_array(self.parameters_of(x).squared).ravel())


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
        """Penalties of ends that cannot be attained, of stops that may be missed, of what comes near after arrival."""
        ends = () if self.encoding.at_rest else ("ends",)
        missed = ("missed",) if self.encoding.may_miss else ()
        return (*ends, *missed, *(("stay",) if self.stays else ()))

    @property
    def stays(self) -> bool:
        """Whether it matters what comes near after arrival."""
        return stay_matters(self.limits, self.encoding.task.stay)

    def further_steps(self, orders: tuple[int, ...]) -> list[Step]:
        return [*super().further_steps(orders), *([self._stay()] if self.stays else [])]

    def _stay(self) -> Step:
        given = {"p": self.p, "window": ca.SX.sym("window", self.motion.robot.dof), "row": ca.SX.sym("row")}
        state = {"stay": ca.SX.sym("stay"), "durations": ca.SX.sym("durations")}
        theta, arrival, since = given["window"].T, state["durations"], given["row"] * self.encoding.task.stay
        found = stay_constraints(self.limits, self.motion.robot, theta, arrival, since, SAMPLING_MARGIN)
        penalty = sum((self.encoding.penalty(constraint) for constraint in found), ca.DM(0))
        shares = stay_shares(self.seconds_stayed)[:, None]
        loop = Loop(rows=shares, window="goal", starts=np.zeros(len(shares), dtype=np.intp))
        return Step.of("stay", given | state, {"stay": state["stay"] + penalty}, loop)

    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
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
        held_orders = self.motion.orders if self.motion.integrated and stacks else [*chain(*stacks.values())]
        along = sorted({n for order in held_orders for n in ALONG[order]})
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
        """The vectors of a path that the scan reads."""
        start, goal = rates
        ends = {
            "squared": start,
            "most": ca.SX(0) if goal is None else goal,
            **({} if goal is None else {"least": goal}),
        }
        return {"control_points": ca.vec(points.T), **ends}

    def _backward(self, along: Sequence[int]) -> Step:
        """The step from the last grid point to the first: bounds of b, kept with what the scan forward needs."""
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
        outputs["scanned"] = ca.vertcat(state["most"], bounds.above, bounds.tilt, *(path[n].T for n in along))
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
            here = {order: in_time(order, found, state["squared"], c) for held in stacks.values() for order in held}
            instants = [(here, state[durations], (state["passed"][1] + taken) / 2.0)]
            for share in GAUSS_SHARES if motion.integrated else ():
                there = dict(enumerate(within(share, [*found.values()], state["squared"], squared, c, taken)))
                instants.append((there, state[durations] + share * taken, taken / len(GAUSS_SHARES)))
            for name, held in stacks.items():
                columns = [[*(values[order].T for order in held), *clock] for values, *clock in instants]
                outputs[name] = ca.vertcat(*chain(*columns))
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
            powers = ([slower**-order for order in held for _ in range(k)] + [slower, slower]) * self.motion.instants
            loop = Loop(rows=self.motion.grid.rows, window=name, starts=self.motion.grid.pieces * size)
            blocks = name.removeprefix("raw_")
            outputs = {blocks: window * ca.vertcat(*powers)}
            steps.append(Step.of("slower", {"window": window, "slower": slower}, outputs, loop, stacked=(blocks,)))
        return steps
