"""How time grows with the numbers of links and candidates."""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, PopulationFunction
from solvers import SOLVERS, Budget, SearchBox, Solver, minimize
from tpbso_casadi.judging.store import RunStore
from tpbso_casadi.reproduction.experiment import BASES, NAMES, Size, solver_section
from tpbso_casadi.scenario import Scenario, builtin, parse_scenario

Pace: TypeAlias = dict[str, dict[str, dict[str, list[float]]]]  # s by basis, case and solver, one a round

PACE_CASES = ("time-3", "rotation-3", "obstacle-3", "pentagram-time")  # one of each kind
ROUNDS = 15
QUICK_ROUNDS = 1
WARM_UP = 3_000  # candidates, after which everything is prepared that is prepared once


def measure_pace(
    size: Size, backend: str | None, rounds: int, progress: Callable[[str], object] = lambda case: None
) -> Pace:
    """Processor time of the searches of the campaign, s: same populations, budgets and backend.

    A round does each solver once, so that whatever slows the machine down slows all of them down; processor time does
    not count what other processes do meanwhile.

    Args:
        size: of the reproduction.
        backend: evaluates populations; None for that of the environment.
        rounds: of each solver on each case and basis.
        progress: called with the case that is measured next.
    """
    options = EvaluationOptions() if backend is None else EvaluationOptions(backend)
    pace: Pace = {basis: {} for basis in BASES}
    for case in PACE_CASES:
        progress(case)
        problem = builtin(case).problem()
        cost, box = problem.evaluator(options), SearchBox(*problem.bounds)
        cost(box.sample(np.random.default_rng(0), WARM_UP))
        for basis in BASES:
            searches = {name: _pace_search(name, basis, size) for name in NAMES}
            seconds: dict[str, list[float]] = {name: [] for name in NAMES}
            for seed in range(1, rounds + 1):
                for name, (solver, budget) in searches.items():
                    seconds[name].append(_search_seconds(cost, box, solver, budget, seed))
            pace[basis][case] = seconds
    return pace


def _pace_search(name: str, basis: str, size: Size) -> tuple[Solver, Budget]:
    section = solver_section(name, basis, size)
    solver = section.build()
    assert isinstance(solver, Solver)
    return solver, section.budget()


Scaling: TypeAlias = dict[str, dict[str, dict[str, dict[str, Any]]]]  # by experiment, symbol and solver
REPEATS = 3  # of a measurement of time; the fastest counts
CASES = {"point-to-point": "time-3", "path": "pentagram-time"}  # by experiment, the scenario that is resized


@dataclass(frozen=True)
class ScalingPoint:
    """One size of an experiment.

    Attributes:
        experiment: "algorithm", "point-to-point" or "path".
        solver: a key of ``SOLVERS``.
        n_i: iterations.
        n_p: population.
        n_d: dimension; of point-to-point 4 k - 2 with k links, of a path n + 1 with n redundancy values.
        n_o: samples of the output trajectory, a segment.
        n_in: points of the path.
    """

    experiment: str
    solver: str
    n_i: int = 20
    n_p: int = 50
    n_d: int = 10
    n_o: int = 50
    n_in: int = 50


TIME_SIZES: dict[str, dict[str, tuple[int, ...]]] = {
    "algorithm": {"n_p": (1_000, 3_000, 9_000, 27_000), "n_d": (16, 64, 256, 1_024)},
    "point-to-point": {
        "n_i": (20, 60, 180, 540),
        "n_p": (50, 150, 450, 1_350),
        "n_d": (10, 18, 34, 66),
        "n_o": (50, 100, 200, 400),
    },
    "path": {
        "n_i": (20, 60, 180, 540),
        "n_p": (50, 150, 450, 1_350),
        "n_d": (6, 11, 21, 41),
        "n_o": (50, 100, 200, 400),
    },
}
SPACE_SIZES: dict[str, dict[str, tuple[int, ...]]] = {
    "algorithm": {"n_p": (5_000, 20_000, 80_000), "n_d": (20, 80, 320)},
    "point-to-point": {"n_p": (4_000, 16_000, 64_000), "n_d": (18, 34, 66), "n_o": (200, 400, 800)},
    "path": {"n_p": (2_000, 8_000, 32_000), "n_d": (26, 51, 101), "n_o": (200, 400, 800), "n_in": (50, 100, 200)},
}
TIME_BASE = {"algorithm": {"n_i": 5, "n_p": 1_000, "n_d": 16}}
SPACE_BASE = {"algorithm": {"n_i": 1, "n_p": 5_000, "n_d": 20}, "point-to-point": {"n_i": 1}, "path": {"n_i": 1}}


def measure_scaling(quick: bool, progress: Callable[[str], object] = lambda quantity: None) -> dict[str, Any]:
    """Time and memory by experiment, symbol and solver: sizes, values and the exponent of their growth.

    Args:
        quick: the time of TPBSO alone, once, without the largest size.
        progress: called with the quantity that is measured next.

    Returns:
        ``{"time" | "space": {experiment: {symbol: {solver: {"sizes", "values", "exponent"}}}}}``; s of processor
        time and bytes. Space is empty where it is quick, or the system does not report the peak memory of a process.
    """
    progress("time")
    times = _measure(TIME_SIZES, TIME_BASE, quick, lambda points: [_seconds(point, quick) for point in points])
    progress("memory")
    space = {} if quick or sys.platform != "linux" else _measure(SPACE_SIZES, SPACE_BASE, False, _all_bytes)
    return {
        "time": with_exponents(times, exponent),
        "space": with_exponents(space, exponent_above),
    }


def _measure(
    sizes: dict[str, dict[str, tuple[int, ...]]],
    base: dict[str, dict[str, int]],
    quick: bool,
    measure: Callable[[list[ScalingPoint]], list[float]],
) -> Scaling:
    scaling: Scaling = {}
    for experiment, symbols in sizes.items():
        for symbol, all_sizes in symbols.items():
            chosen = all_sizes[:-1] if quick else all_sizes
            for solver in ("bso",) if quick else NAMES:
                fixed: dict[str, Any] = base.get(experiment, {})
                points = [ScalingPoint(experiment, solver, **(fixed | {symbol: size})) for size in chosen]
                row = {"sizes": list(chosen), "values": measure(points)}
                scaling.setdefault(experiment, {}).setdefault(symbol, {})[solver] = row
    return scaling


def measured(
    store: RunStore, size: Size, quick: bool, backend: str | None, progress: Callable[[str], object]
) -> dict[str, dict[str, Any]]:
    """Growth of time and memory (``scaling``), and the time of searches (``pace``): measured once, then from the store.

    Args:
        store: where they are kept.
        size: of the reproduction.
        quick: whether few repeats are enough.
        backend: that evaluates populations; the usual one where None.
        progress: is told what is measured.
    """
    measures: dict[str, tuple[str, Callable[[], dict[str, Any]]]] = {
        "scaling": ("growth in processor time", lambda: measure_scaling(quick, progress)),
        "pace": ("pace", lambda: measure_pace(size, backend, QUICK_ROUNDS if quick else ROUNDS, progress)),
    }
    found = {}
    for key, (name, measure) in measures.items():
        found[key] = store.measurement(f"{name} {asdict(size)}")
        if found[key] is None:
            found[key] = measure()
            store.keep(f"{name} {asdict(size)}", found[key])
    return found


def with_exponents(scaling: Scaling, of: Callable[[Sequence[float], Sequence[float]], float]) -> Scaling:
    """The measurements with the exponent of each row."""
    return {
        experiment: {
            symbol: {solver: {**row, "exponent": of(row["sizes"], row["values"])} for solver, row in rows.items()}
            for symbol, rows in symbols.items()
        }
        for experiment, symbols in scaling.items()
    }


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """The slope of the line through the points of a log-log plot: 1 is linear growth."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def exponent_above(sizes: Sequence[float], values: Sequence[float]) -> float:
    """The power q of ``a + b size^q`` through three geometric sizes: a constant part does not count."""
    slopes = np.diff(values) / np.diff(sizes)
    middles = np.sqrt(np.array(sizes[1:], dtype=np.float64) * np.array(sizes[:-1]))
    if not (slopes > 0.0).all():
        return 0.0
    return float(1.0 + np.log(slopes[-1] / slopes[0]) / np.log(middles[-1] / middles[0]))


def _seconds(point: ScalingPoint, quick: bool) -> float:
    cost, box = _cost(point)
    solver, budget = _solver(point.solver, point.n_p), Budget(iterations=point.n_i)
    return min(_search_seconds(cost, box, solver, budget) for _ in range(1 if quick else REPEATS))


def _solver(name: str, population: int) -> Solver:
    kind: Any = SOLVERS[name]
    solver: Solver = kind(population=population)
    return solver


def _search_seconds(
    cost: Callable[[FloatArray], FloatArray], box: SearchBox, solver: Solver, budget: Budget, seed: int = 1
) -> float:
    """Processor time of a search, s: what other processes do meanwhile does not count."""
    began = time.process_time()
    minimize(cost, box, solver, budget, seed)
    return time.process_time() - began


def _cost(point: ScalingPoint) -> tuple[Callable[[FloatArray], FloatArray], SearchBox]:
    """The cost of a size and its box; of the algorithm alone, a cost that takes no time."""
    if point.experiment == "algorithm":
        return lambda x: x[:, 0], SearchBox(np.zeros(point.n_d), np.ones(point.n_d))
    return _problem(replace(point, solver="", n_i=0, n_p=0))


@lru_cache(maxsize=8)
def _problem(point: ScalingPoint) -> tuple[PopulationFunction, SearchBox]:
    problem = _scenario(point).problem()
    evaluate, box = problem.evaluator(EvaluationOptions("vm")), SearchBox(*problem.bounds)
    evaluate(box.sample(np.random.default_rng(0), WARM_UP))
    return evaluate, box


def _scenario(point: ScalingPoint) -> Scenario:
    content = builtin(CASES[point.experiment]).table()
    content["model"]["samples"] = point.n_o
    RESIZE[point.experiment](content, point)
    return parse_scenario(content)


def _resize_point_to_point(content: dict[str, Any], point: ScalingPoint) -> None:
    links = (point.n_d + 2) // 4
    content["arm"]["link_lengths"] = [2.0 / links] * links


def _resize_path(content: dict[str, Any], point: ScalingPoint) -> None:
    content["task"]["count"] = point.n_in
    content["model"]["redundancy_values"] = max(point.n_d - 1, 2)


RESIZE = {"point-to-point": _resize_point_to_point, "path": _resize_path}


def _all_bytes(points: list[ScalingPoint]) -> list[float]:
    """The peak memory of each size, measured in a fresh process of its own."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    with ProcessPoolExecutor(1, context, max_tasks_per_child=1) as pool:
        return list(pool.map(_bytes, points))


def _bytes(point: ScalingPoint) -> float:
    import resource  # noqa: PLC0415 (not on every system)

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    cost, box = _cost(point)
    minimize(cost, box, _solver(point.solver, point.n_p), Budget(iterations=point.n_i), 1)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return 1024.0 * max(after - before, 1)
