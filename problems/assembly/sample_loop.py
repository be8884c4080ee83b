"""The loop over samples, as steps of a program: written once for one sample, from limits and objective alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from problems.assembly.repeated_loop import PLACES, REPEATED, RepeatedLoop
from problems.base.matrix import Matrix, total
from problems.evaluation import Loop, Step
from problems.limits.constraint import Constraint
from problems.limits.limit import SAMPLING_MARGIN, Limit, Repetition
from problems.motions.motion import Motion, SampleGrid
from problems.motions.samples import Samples
from problems.objectives.objective import Objective


@dataclass(frozen=True, eq=False)
class Instant:
    """Symbols of one sample and of the one before it.

    Args:
        motion: the symbolic twin of the motion that is sampled.
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
        """Which derivatives expressions of :attr:`probe` depend on."""
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
        penalties: how many of the sums are penalties; one more is the objective's, where there is one.
        further: steps that go on with what this one leaves of each sample.
    """

    step: Step
    orders: tuple[int, ...]
    starting_values: dict[str, int]
    penalties: int = 0
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
        motion: the symbolic twin of the motion.
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
        motion: the symbolic twin of the motion.
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
    contributions, count = _contributions(limits, objective, penalty, before, now, row[-1])
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
        penalties=count,
        further=tuple(further),
    )


def _contributions(
    limits: Sequence[Limit],
    objective: Objective,
    penalty: Callable[[Constraint], Matrix],
    before: Samples,
    now: Samples,
    inner: Matrix,
) -> tuple[Matrix, int]:
    """The contributions of one sample to each penalty and, last, to the objective, (c, 1); and the number of penalties.

    Args:
        limits: that are penalised.
        objective: of the motion.
        penalty: of the rows of a constraint.
        before: the sample before.
        now: this sample.
        inner: 0 for the first sample, which has none before it, else 1.
    """
    parts: list[Matrix] = []
    for limit in limits:
        parts += [penalty(constraint) for constraint in limit.at(now, SAMPLING_MARGIN)]
        parts += [_if(inner, penalty(c)) for c in limit.between(before, now, SAMPLING_MARGIN)]
    penalties = len(parts)
    sample, step = objective.at(now), objective.between(before, now)
    added = [total(part) for part in (sample,) if part is not None]
    added += [_if(inner, total(part)) for part in (step,) if part is not None]
    if added:
        parts.append(sum(added, ca.DM(0)))
    return ca.vertcat(*parts) if parts else ca.SX(0, 1), penalties


def _if(inner: Matrix, value: Matrix) -> Matrix:
    """The value where there is a sample before, else 0, whatever the value is then."""
    return ca.if_else(inner > 0.5, value, 0.0)
