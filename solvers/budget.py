"""How long a search may go on, and why it stopped."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import StrEnum


class StopReason(StrEnum):
    """Which criterion ended a search."""

    EVALUATIONS = "evaluations"
    ITERATIONS = "iterations"
    SECONDS = "seconds"
    TARGET = "target"
    STAGNATION = "stagnation"
    INTERRUPTED = "interrupted"
    CONVERGED = "converged"  # of one descent: a point where no direction improves
    FAILED = "failed"  # of one descent: infeasible, or the numbers gave out
    EXHAUSTED = "exhausted"  # the solver itself had nothing more to try


@dataclass(frozen=True)
class Budget:
    """The first limit that is reached ends the search; None is no limit.

    Args:
        evaluations: candidates priced, all of them counted, antennae included; kept exactly.
        iterations: of the solver's loop; the initial population is iteration 0.
        seconds: wall-clock time, checked after every batch. Results then depend on the machine.
        target: stop as soon as a cost is at or below it.
        stagnation: stop after so many iterations without improvement.

    Raises:
        ValueError: a limit is not positive, or none of the first three is given.
    """

    evaluations: int | None = None
    iterations: int | None = None
    seconds: float | None = None
    target: float | None = None
    stagnation: int | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name != "target" and value is not None and not value > 0:
                raise ValueError(f"a budget of {value} {field.name} is not positive")
        if self.evaluations is None and self.iterations is None and self.seconds is None:
            raise ValueError("a budget limits evaluations, iterations or seconds")
