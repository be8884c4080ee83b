"""How long a search may go on, and why it stopped: the rules that all drivers share."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import StrEnum
from numbers import Integral, Real


class StopReason(StrEnum):
    """Which criterion ended a search."""

    EVALUATIONS = "evaluations"
    ITERATIONS = "iterations"
    SECONDS = "seconds"
    TARGET = "target"
    STAGNATION = "stagnation"
    INTERRUPTED = "interrupted"
    CONVERGED = "converged"  # of one descent: a point where no direction improves
    FAILED = "failed"  # of one descent: infeasible, or a numerical failure
    EXHAUSTED = "exhausted"  # the solver itself had nothing more to try


@dataclass(frozen=True, kw_only=True)
class Usage:
    """What a search has used so far.

    Attributes:
        evaluations: done.
        requested: evaluations done, and those that the search needs to go on.
        iterations: completed.
        seconds: since the start, wall-clock time.
        cost: the lowest so far.
        unimproved: iterations since it was found.
        interrupted: whether the user has pressed Ctrl-C.
    """

    evaluations: int
    requested: int
    iterations: int
    seconds: float
    cost: float
    unimproved: int
    interrupted: bool


@dataclass(frozen=True)
class Budget:
    """The first limit that is reached ends the search; None is no limit.

    Args:
        evaluations: candidates evaluated, all of them counted, antennae included; never exceeded by a metaheuristic.
        iterations: of the solver's loop, where the initial population is iteration 0; or starts of a descent.
        seconds: wall-clock time, checked after every batch. Results then depend on the machine.
        target: stop as soon as a cost is at or below it.
        stagnation: stop after so many iterations without improvement.

    Raises:
        ValueError: a limit is not positive, or none of the first three is given.
        TypeError: a limit is not a number, or evaluations are not a whole one.
    """

    evaluations: int | None = None
    iterations: int | None = None
    seconds: float | None = None
    target: float | None = None
    stagnation: int | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            _check_number(field.name, value)
            if field.name != "target" and value is not None and not value > 0:
                raise ValueError(f"a budget of {value} {field.name} is not positive")
        if self.evaluations is None and self.iterations is None and self.seconds is None:
            raise ValueError("a budget limits evaluations, iterations or seconds")

    def reached(self, usage: Usage) -> StopReason | None:
        """Which criterion ends the search now, or None. If several do, the first in this order."""
        criteria = (
            (StopReason.INTERRUPTED, usage.interrupted),
            (StopReason.TARGET, self.target is not None and usage.cost <= self.target),
            (StopReason.EVALUATIONS, self.evaluations is not None and usage.requested > self.evaluations),
            (StopReason.ITERATIONS, self.iterations is not None and usage.iterations >= self.iterations),
            (StopReason.SECONDS, self.seconds is not None and usage.seconds >= self.seconds),
            (StopReason.STAGNATION, self.stagnation is not None and usage.unimproved >= self.stagnation),
        )
        return next((reason for reason, holds in criteria if holds), None)

    def share_used(self, usage: Usage) -> float:
        """Share of the budget used, from 0 to 1; the clock counts only where nothing repeatable limits the search."""
        shares = []
        if self.evaluations is not None:
            shares.append(usage.evaluations / self.evaluations)
        if self.iterations is not None:
            shares.append(usage.iterations / self.iterations)
        if not shares and self.seconds is not None:
            shares.append(usage.seconds / self.seconds)
        return min(1.0, max(shares))


def _check_number(name: str, value: object) -> None:
    if value is None:
        return
    kind, words = (Integral, "whole number") if name == "evaluations" else (Real, "number")
    if isinstance(value, bool) or not isinstance(value, kind):
        raise TypeError(f"a budget of {value!r:.60} {name}: a {words} is needed")
