"""Time several jobs fairly: in turn, many times, medians."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np

ROUNDS = 9


def medians(
    jobs: Mapping[str, Callable[[], object]], rounds: int = ROUNDS, between: Callable[[], object] = lambda: None
) -> dict[str, float]:
    """Median seconds of each job; the jobs take turns, so that a slow moment of the machine hits all of them.

    Args:
        jobs: by name.
        rounds: how often each is timed, after a first time that does not count.
        between: called before each of them, and not timed.
    """
    for job in jobs.values():
        job()
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(rounds):
        for name, job in jobs.items():
            between()
            start = time.perf_counter()
            job()
            seconds[name].append(time.perf_counter() - start)
    return {name: float(np.median(taken)) for name, taken in seconds.items()}


def slope(sizes: list[int], values: list[float]) -> float:
    """Slope of the line through the points in a log-log plot: 1 is linear growth."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])
