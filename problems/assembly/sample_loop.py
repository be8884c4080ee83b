"""The loop over samples: limits and objective of one sample, added up.

Where a limit says the same of many things, code for one of them is compiled, and called for each with its own numbers:
it stays small however many there are, and another number of them compiles nothing.

Every number of the statement is a symbol here, so that the compiled steps serve every problem of the same structure.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

import casadi as ca
import numpy as np

from problems.assembly.encoding import CostWeights, Encoding
from problems.assembly.problem import Problem
from problems.base import Arguments, Matrix, total
from problems.evaluation import Loop, Program, Step
from problems.limits import SAMPLING_MARGIN, Constraint, DurationBounds, Limit, Repetition
from problems.motions import Motion, SampleGrid, Samples
from problems.objectives import Objective
from problems.robots import Robot

PLACES = "places"  # of the frames at each sample, m
REPEATED = "repeated"  # the penalties, one for each repetition


@dataclass(frozen=True)
class RepeatedLoop:
    """Steps that add up what repetitions make of each sample.

    Args:
        robot: the symbolic copy of the robot that moves.
        repetitions: at least one.
        durations: how many parts of the motion have one.
    """

    robot: Robot
    repetitions: Sequence[Repetition]
    durations: int

    @property
    def frames(self) -> list[int]:
        """Whose positions are needed at each sample."""
        return sorted({frame for repetition in self.repetitions for frame in repetition.frames})

    @property
    def timed(self) -> bool:
        """Whether times are needed."""
        return any(repetition.is_time_dependent for repetition in self.repetitions)

    def places(self, now: Samples) -> Matrix:
        """A column of positions at one sample, one after the other, m, and of the time, s, where it is needed."""
        parts = [now.positions[frame] for frame in self.frames]
        if self.timed:
            assert now.times is not None
            parts.append(now.times)
        return ca.horzcat(*parts).T

    def steps(self, p: ca.SX, samples: int, penalty: Callable[[Constraint], Matrix]) -> list[Step]:
        """One step for each repetition, which runs for all of its things at each sample.

        Args:
            p: the numbers of the statement.
            samples: how many there are.
            penalty: of the rows of a constraint.
        """
        return [self._step(k, p, samples, penalty) for k in range(len(self.repetitions))]

    def _step(self, number: int, p: ca.SX, samples: int, penalty: Callable[[Constraint], Matrix]) -> Step:
        repetition, dim = self.repetitions[number], self.robot.dim
        size = len(self.frames) * dim
        window, sums = ca.SX.sym("window", size + self.timed), ca.SX.sym(REPEATED, len(self.repetitions))
        durations = ca.SX.sym("durations", self.durations)
        places = dict(zip(self.frames, ca.horzsplit(window[:size].T, dim), strict=True))
        unused = ca.DM.nan(1, dim)
        positions = tuple(places.get(frame, unused) for frame in range(max(self.frames) + 1))
        times = window[size:] if self.timed else None
        duration = ca.sum1(durations) if repetition.is_time_dependent else ca.SX(1)
        now = Samples(robot=self.robot, derivatives=(), duration=duration, times=times, known_positions=positions)
        entries = ca.vertsplit(sums)
        for limit in repetition.limits:
            found = sum((penalty(constraint) for constraint in limit.constraints_at(now, SAMPLING_MARGIN)), ca.DM(0))
            near = limit.may_break(now, SAMPLING_MARGIN)
            entries[number] += found if near is None else ca.if_else(near, found, 0.0)
        clock = {"durations": durations} if repetition.is_time_dependent else {}
        inputs = {"p": p, **clock, "window": window, "row": repetition.symbols, REPEATED: sums}
        outputs = {REPEATED: ca.vertcat(*entries)}
        things = len(repetition.numbers)
        starts = np.repeat(np.arange(samples) * window.numel(), things)
        loop = Loop(rows=np.tile(repetition.numbers, (samples, 1)), window=PLACES, starts=starts)
        return Step.of("repeated", inputs, outputs, loop)


@dataclass(frozen=True, eq=False)
class Instant:
    """Symbols of one sample and of the one before it.

    Args:
        motion: the symbolic copy of the motion that is sampled.
    """

    motion: Motion[Any]

    def widths(self, limits: Sequence[Limit]) -> list[int]:
        """How many magnitudes each limit has."""
        return [int(limit.magnitudes(self.probe).shape[1]) for limit in limits]

    @cached_property
    def probe(self) -> Samples:
        """The sample with stand-ins for everything, to see what is needed of it."""
        return Samples.symbolic(self.motion.robot, len(self.motion.orders))

    def needed_orders(self, expressions: Sequence[Matrix]) -> tuple[int, ...]:
        """Orders of the derivatives on which expressions of :attr:`probe` depend."""
        everything = ca.vertcat(*(ca.vec(expression) for expression in expressions))
        symbols = {order: ca.vec(self.probe.derivative(order)) for order in self.motion.orders}
        return tuple(order for order, symbol in symbols.items() if any(ca.which_depends(everything, symbol, 1, False)))

    def before(self, now: Samples) -> tuple[Samples, list[tuple[ca.SX, Matrix]]]:
        """The sample before, and its symbols with what this sample passes on in their place."""
        base, frames = ((), ()) if now.derivatives[0] is None else (now.positions[:1], now.positions[1:])
        known = [derivative for derivative in now.derivatives if derivative is not None]
        passed_on = [*known, *(clock for clock in (now.times, now.weights) if clock is not None), *frames]
        symbols = [ca.SX.sym("before", *value.shape) for value in passed_on]
        values = iter(symbols)
        before = Samples(
            robot=now.robot,
            derivatives=tuple(None if derivative is None else next(values) for derivative in now.derivatives),
            duration=now.duration,
            times=None if now.times is None else next(values),
            weights=None if now.weights is None else next(values),
            known_positions=(*base, *values),
        )
        return before, list(zip(symbols, passed_on, strict=True))


@dataclass(frozen=True, kw_only=True)
class SampleLoop:
    """A step that accumulates over samples.

    Attributes:
        step: of the program.
        orders: of the derivatives that the blocks have to hold.
        starting_values: vectors that an earlier step has to set to zero, with their sizes.
        penalties: names of the sums that are penalties; one more is the objective's, where there is one.
        further: steps that go on with what this one leaves of each sample.
    """

    step: Step
    orders: tuple[int, ...]
    starting_values: dict[str, int]
    penalties: tuple[str, ...] = ()
    further: tuple[Step, ...] = ()


def loop_over(motion: Motion[Any], orders: tuple[int, ...], grid: SampleGrid, blocks: str) -> Loop:
    """Rows of a grid, with a last column that is 0 in the first row and 1 in the others; windows into the blocks."""
    size, _ = motion.piece_sizes(orders)
    inner = (np.arange(len(grid.rows)) > 0).astype(np.float64)
    return Loop(rows=np.column_stack([grid.rows, inner]), window=blocks, starts=grid.pieces * size)


def symbols_of(motion: Motion[Any], orders: tuple[int, ...], grid: SampleGrid) -> tuple[ca.SX, ca.SX]:
    """Symbols of the window and the row of :func:`loop_over`."""
    _, width = motion.piece_sizes(orders)
    return ca.SX.sym("window", width), ca.SX.sym("row", grid.rows.shape[1] + 1)


def peak_loop(motion: Motion[Any], limits: Sequence[Limit], p: ca.SX, name: str = "peaks") -> SampleLoop:
    """Accumulates the largest magnitudes of limits that scale with time over a shape's samples.

    Args:
        motion: the symbolic copy of the motion.
        limits: that scale with time.
        p: the numbers of the statement.
        name: of the vector in which they are accumulated.
    """
    instant = Instant(motion)
    orders = instant.needed_orders([limit.magnitudes(instant.probe) for limit in limits])
    window, row = symbols_of(motion, orders, motion.grid)
    durations = ca.SX.sym("durations", motion.duration_count)
    now = motion.at(window, row[:-1], durations, orders)
    magnitudes = ca.vertcat(*(limit.magnitudes(now).T for limit in limits))
    peaks = ca.SX.sym("peaks", magnitudes.shape[0])
    inputs = {"p": p, "shape_durations": durations, "window": window, "row": row, name: peaks}
    loop = loop_over(motion, orders, motion.grid, "shape_blocks")
    step = Step.of(name, inputs, {name: ca.fmax(peaks, magnitudes)}, loop)
    return SampleLoop(step=step, orders=orders, starting_values={name: magnitudes.shape[0]})


def cost_loop(
    motion: Motion[Any],
    limits: Sequence[Limit],
    objective: Objective,
    penalty: Callable[[Constraint], Matrix],
    least_orders: tuple[int, ...],
    p: ca.SX,
    repetitions: Sequence[Repetition] = (),
) -> SampleLoop | None:
    """Accumulates what limits and objective make of each sample, in ``sums``: penalties first, then the objective.

    None where neither makes anything of single samples.

    Args:
        motion: the symbolic copy of the motion.
        limits: that are penalised, written out.
        objective: of the motion.
        penalty: of the rows of a constraint.
        least_orders: of derivatives that the blocks hold in any case.
        p: the numbers of the statement.
        repetitions: of further limits, whose penalties are accumulated in ``repeated``.
    """
    instant = Instant(motion)
    before, _ = instant.before(instant.probe)
    contributions, _ = _contributions(limits, objective, penalty, before, instant.probe, ca.SX(1))
    repeated = RepeatedLoop(motion.robot, repetitions, motion.duration_count)
    if contributions.numel() == 0 and not repetitions:
        return None
    needed = [contributions, *([repeated.places(instant.probe)] if repetitions else [])]
    orders = tuple(sorted({*instant.needed_orders(needed), *least_orders}))
    window, row = symbols_of(motion, orders, motion.grid)
    durations = ca.SX.sym("durations", motion.duration_count)
    now = motion.at(window, row[:-1], durations, orders)
    before, passed_on = instant.before(now)
    contributions, names = _contributions(limits, objective, penalty, before, now, row[-1])
    carried = [pair for pair in passed_on if any(ca.which_depends(contributions, ca.vec(pair[0]), 1, False))]
    sums = ca.SX.sym("sums", contributions.numel())
    inputs = {"p": p, "durations": durations, "window": window, "row": row, "sums": sums}
    outputs: dict[str, Matrix] = {"sums": sums + contributions}
    starting_values = {"sums": contributions.numel()}
    if carried:
        symbols, values = (ca.vertcat(*(ca.vec(part) for part in side)) for side in zip(*carried, strict=True))
        inputs["before"], outputs["before"] = symbols, values
        starting_values["before"] = symbols.numel()
    further: list[Step] = []
    if repetitions:
        outputs[PLACES], starting_values[REPEATED] = repeated.places(now), len(repetitions)
        further = repeated.steps(p, len(motion.grid.rows), penalty)
    loop, stacked = loop_over(motion, orders, motion.grid, "blocks"), (PLACES,) if repetitions else ()
    return SampleLoop(
        step=Step.of("sample", inputs, outputs, loop, stacked),
        orders=orders,
        starting_values=starting_values,
        penalties=names,
        further=tuple(further),
    )


def _contributions(
    limits: Sequence[Limit],
    objective: Objective,
    penalty: Callable[[Constraint], Matrix],
    before: Samples,
    now: Samples,
    inner: Matrix,
) -> tuple[Matrix, tuple[str, ...]]:
    """The contributions of one sample to each penalty and, last, to the objective, (c, 1); and the penalties' names.

    Args:
        limits: that are penalised.
        objective: of the motion.
        penalty: of the rows of a constraint.
        before: the sample before.
        now: this sample.
        inner: 0 for the first sample, which has none before it, else 1.
    """
    parts: list[Matrix] = []
    names: list[str] = []
    for limit in limits:
        here, steps = limit.constraints_at(now, SAMPLING_MARGIN), limit.between(before, now, SAMPLING_MARGIN)
        parts += [penalty(constraint) for constraint in here]
        parts += [_if(inner, penalty(constraint)) for constraint in steps]
        names += [constraint.name for constraint in (*here, *steps)]
    sample, step = objective.of_samples(now), objective.between(before, now)
    added = [part for part in (sample,) if part is not None]
    added += [_if(inner, total(part)) for part in (step,) if part is not None]
    if added:
        parts.append(sum(added, ca.DM(0)))
    return ca.vertcat(*parts) if parts else ca.SX(0, 1), tuple(names)


def _if(inner: Matrix, value: Matrix) -> Matrix:
    """The value where there is a sample before, else 0, whatever the value is then."""
    return ca.if_else(inner > 0.5, value, 0.0)


P = TypeVar("P")


@dataclass(frozen=True, eq=False, kw_only=True)
class Accumulated:
    """Sums over all samples, as expressions of the inputs of the last step.

    Attributes:
        inputs: of that step, by name.
        objective: of the motion, scalar.
        penalties: names and scalars, in the order in which the cost adds them.
        reach: the condition of inverse kinematics, (1, n); None where every vector is reached.
    """

    inputs: dict[str, ca.SX]
    objective: Matrix
    penalties: Sequence[tuple[str, Matrix]]
    reach: Matrix | None


def statements_of(problem: Problem[Any]) -> tuple[Any, ...]:
    """All that a cost depends on, in the order of its numbers."""
    bounds, objective = problem.criteria.task.duration_bounds, problem.criteria.objective
    return problem.encoding, problem.motion, problem.searched_limits, problem.weights, bounds, objective


class CostSteps(ABC, Generic[P]):
    """The steps of one problem.

    Args:
        problem: whose cost.
    """

    def __init__(self, problem: Problem[P]) -> None:
        self.arguments = Arguments()
        symbolic_copies = self.arguments.symbolic_copy(statements_of(problem))
        self.encoding: Encoding[P] = symbolic_copies[0]
        self.motion: Motion[P] = symbolic_copies[1]
        self.limits: tuple[Limit, ...] = symbolic_copies[2]
        self.weights: CostWeights = symbolic_copies[3]
        self.duration_bounds: DurationBounds | None = symbolic_copies[4]
        self.objective: Objective = symbolic_copies[5]
        each = zip(problem.searched_limits, self.limits, strict=True)
        self._repetitions = {id(symbolic_copy): limit.repetitions(symbolic_copy) for limit, symbolic_copy in each}
        self.seconds_stayed = problem.criteria.task.stay
        self.x = ca.SX.sym("x", len(problem.variables))

    @cached_property
    def p(self) -> ca.SX:
        """All numbers of the statement, (q, 1)."""
        return self.arguments.symbols

    @property
    def time_scale_inputs(self) -> dict[str, ca.SX]:
        """The inputs of the step that scales time: the statement's numbers, and the search vector where it says how."""
        return {"p": self.p, **({} if self.encoding.time_scale is None else {"x": self.x})}

    @property
    def slowing(self) -> list[Limit]:
        """The limits whose peaks the step that scales time has to know."""
        return self.encoding.slowing(self.limits)

    def program(self) -> Program:
        """The program of all steps."""
        front, end = self._assembled()
        return self._ending_in(front, end, self._cost(end))

    def parts(self) -> tuple[Program, tuple[str, ...]]:
        """The program with the objective and each penalty behind the cost, and the penalties' names.

        Where inverse kinematics may fail, how far it is from reaching is the last one.
        """
        front, end = self._assembled()
        penalties = [*end.penalties]
        if end.reach is not None:
            penalties.append(("reach", ca.sum2(ca.fmax(ca.fabs(end.reach) - 1.0, 0.0))))
        values = ca.vertcat(self._cost(end), end.objective, *(value for _, value in penalties))
        return self._ending_in(front, end, values), tuple(name for name, _ in penalties)

    def _ending_in(self, front: Sequence[Step], end: Accumulated, values: Matrix) -> Program:
        last = Step.of("finish", end.inputs, {"cost": values})
        return Program(steps=(*front, last), parameters=self.arguments.values)

    def _cost(self, end: Accumulated) -> Matrix:
        return self.encoding.cost(end.objective, [value for _, value in end.penalties], end.reach, self.weights)

    def _assembled(self) -> tuple[list[Step], Accumulated]:
        """All steps but the last, and what that goes on from."""
        penalised, penalty = self.encoding.penalised(self.limits), self.encoding.penalty
        written_out = [limit for limit in penalised if not self._repetitions.get(id(limit))]
        repeated = [each for limit in penalised for each in self._repetitions.get(id(limit), ())]
        loop = cost_loop(self.motion, written_out, self.objective, penalty, self.least_orders, self.p, repeated)
        orders = tuple(sorted({*(loop.orders if loop else ()), *self.least_orders}))
        front = self.front(orders, loop.starting_values if loop else {})
        steps = [*front, *([loop.step, *loop.further] if loop else []), *self.further_steps(orders)]
        return steps, self._accumulated(loop, repeated)

    @abstractmethod
    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
        """The steps that decode a candidate: from the search vector to the vectors of :meth:`motion_vectors`.

        Args:
            orders: of the derivatives that the blocks hold.
            starting_values: vectors to set to zero, with their sizes.
        """

    @property
    def least_orders(self) -> tuple[int, ...]:
        """Orders of the derivatives that are needed even where the loop over samples has nothing to do."""
        return ()

    def further_steps(self, orders: tuple[int, ...]) -> list[Step]:
        """Steps after the loop over samples; each writes one more penalty, named in :attr:`further_penalties`.

        Args:
            orders: of the derivatives that the blocks hold.
        """
        return []

    @property
    def further_penalties(self) -> tuple[str, ...]:
        """Names of the scalars that further steps write."""
        return ()

    @property
    def reach_size(self) -> int:
        """Entries of ``reach``, the condition of inverse kinematics; none by default."""
        return 0

    def motion_vectors(
        self, parameters: P, orders: tuple[int, ...], starting_values: dict[str, int]
    ) -> dict[str, Matrix]:
        """The vectors that the loop over samples reads: durations, blocks, accumulators set to zero."""
        blocks = {"blocks": self.motion.blocks(parameters, orders)} if orders else {}
        zeros = {name: ca.SX.zeros(size) for name, size in starting_values.items()}
        return {"durations": self.motion.durations(parameters), **blocks, **zeros}

    def peaks_of_each(self, peaks: ca.SX) -> list[Matrix]:
        """The peaks of all limits that time scaling restores, as a row for each."""
        sizes = Instant(self.motion).widths(self.slowing)
        return [part.T for part in ca.vertsplit(peaks, np.cumsum([0, *sizes]).tolist())]

    def _accumulated(self, loop: SampleLoop | None, repeated: Sequence[Repetition]) -> Accumulated:
        """The inputs and terms of which the last step makes the cost."""
        inputs: dict[str, ca.SX] = {"p": self.p, "durations": ca.SX.sym("durations", self.motion.duration_count)}
        if loop is not None:
            inputs |= {n: ca.SX.sym(n, size) for n, size in loop.starting_values.items() if n in {"sums", REPEATED}}
        if self.reach_size:
            inputs["reach"] = ca.SX.sym("reach", self.reach_size)
        for name in self.further_penalties:
            inputs[name] = ca.SX.sym(name)
        sums: Sequence[Matrix] = ca.vertsplit(inputs["sums"]) if loop is not None else []
        named = loop.penalties if loop is not None else ()
        objective = self.objective.terminal(self.motion.duration(inputs["durations"]))
        for accumulated in sums[len(named) :]:
            objective = objective + accumulated
        penalties = list(zip(named, sums, strict=False))
        if REPEATED in inputs:
            names = (" and ".join(dict.fromkeys(limit.name for limit in each.limits)) for each in repeated)
            penalties += zip(names, ca.vertsplit(inputs[REPEATED]), strict=True)
        penalties += [(name, inputs[name]) for name in self.further_penalties]
        if self.duration_bounds is not None and self.encoding.scales_time:  # else the search box keeps them
            durations = self.duration_bounds.at(inputs["durations"].T, SAMPLING_MARGIN)
            penalties.append((durations.name, self.encoding.penalty(durations)))
        reach = inputs["reach"].T if self.reach_size else None
        return Accumulated(inputs=inputs, objective=objective, penalties=penalties, reach=reach)
