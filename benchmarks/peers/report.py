"""What a table of this comparison is, how large it is made, and how it is printed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from problems import Trajectory
from problems.base import FloatArray
from problems.robots import JointLimits

CHECKED_TIMES, TIMES_PER_CHUNK = 100_000, 10_000
ALLOWED = 1e-9  # of a limit; rounding

R = TypeVar("R")


@dataclass(frozen=True)
class Size:
    """How many cases a table has, and how many processes compute them."""

    moves: int
    paths: int
    workers: int


@dataclass(frozen=True)
class Report:
    """A table: its title, its header and its rows."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    def print(self) -> None:
        """As Markdown."""
        print(f"\n{self.title}\n")
        for line in (self.header, ["---"] * len(self.header), *self.rows):
            print(f"| {' | '.join(line)} |", flush=True)


def in_parallel(case: Callable[[int], R], count: int, workers: int) -> list[R]:
    """One result for each seed."""
    with ProcessPoolExecutor(workers) as pool:
        return list(pool.map(case, range(count), chunksize=5))


def excess(at: Callable[[FloatArray, int], FloatArray], duration: float, limits: JointLimits) -> float:
    """By how much of a limit a motion exceeds it at very many times: 0.12 is 12 %; 0 for rounding.

    Args:
        at: derivatives (n, k) at times (n,), of an order.
        duration: s.
        limits: of the k joints.
    """
    bounds = [limits.speed, limits.acceleration, *([] if limits.jerk is None else [limits.jerk])]
    worst = 0.0
    for times in np.array_split(np.linspace(0.0, duration, CHECKED_TIMES), CHECKED_TIMES // TIMES_PER_CHUNK):
        for order, bound in enumerate(bounds, start=1):
            worst = max(worst, float((np.abs(at(times, order)) / np.array(bound)).max()) - 1.0)
    return worst if worst > ALLOWED else 0.0


def certified(trajectory: Trajectory, limits: JointLimits) -> bool:
    """Whether speed, acceleration and, where limited, jerk are proven for all t."""
    bounds = [limits.speed, limits.acceleration, *([] if limits.jerk is None else [limits.jerk])]
    allowed = [np.array(bound) * (1.0 + ALLOWED) for bound in bounds]
    return all(trajectory.stays_within(order, -most, most) for order, most in enumerate(allowed, start=1))


def spread(values: Iterable[float], digits: int) -> str:
    """Median and worst of what is better when small."""
    numbers = np.array(list(values))
    return f"{np.median(numbers):.{digits}f} / {numbers.max():.{digits}f}"


def milliseconds(seconds: Iterable[float]) -> str:
    """Median and worst."""
    return spread((1e3 * value for value in seconds), 2)
