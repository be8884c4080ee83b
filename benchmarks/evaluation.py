"""What an evaluation costs: the model, and each solver's own overhead.

Times are medians over repetitions within one run on one core; compare ratios, not seconds, between machines.

    python -m benchmarks.evaluation
"""

from __future__ import annotations

import time
from collections.abc import Callable

import casadi as ca
import numpy as np
from rich.console import Console
from rich.table import Table

from problems import PathFollowing, Problem
from problems.pricing import PopulationFunction
from solvers import SOLVERS, Box, Budget, minimize
from tpbso_casadi.builtin import TITLES, builtin
from tpbso_casadi.scenario import Scenario, parse_scenario

REPETITIONS = 9
EVALUATIONS = 20_000


def median_seconds(job: Callable[[], object]) -> float:
    """Median time of a job, after a first run that is not counted."""
    job()
    seconds = []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        job()
        seconds.append(time.perf_counter() - start)
    return float(np.median(seconds))


def microseconds(problem: Problem, population: int, evaluations: int = 2000) -> float:
    """Microseconds a candidate in batches of ``population``."""
    points = Box(*problem.bounds).sample(np.random.default_rng(1), population)
    batches = max(1, evaluations // population)
    return median_seconds(lambda: [problem.cost(points) for _ in range(batches)]) / (batches * population) * 1e6


def changed(scenario: Scenario, **model: object) -> Scenario:
    """A scenario with other keys in [model]."""
    content = scenario.model_dump()
    content["model"] |= model
    return parse_scenario(content)


def models(console: Console) -> None:
    """Every built-in case in both formulations."""
    table = Table("case", "paper [us]", "reduced [us]", "operations", title="cost of an evaluation, population 50")
    for name in TITLES:
        problems = [changed(builtin(name), formulation=form).problem() for form in ("paper", "reduced")]
        times = [f"{microseconds(problem, 50):.1f}" for problem in problems]
        table.add_row(name, *times, " / ".join(str(p.cost_function.n_instructions()) for p in problems))
    console.print(table)


def growth(console: Console) -> None:
    """Log-log slopes: 1 is linear."""
    table = Table("what grows", "values", "us a candidate", "slope", title="growth")
    links = [2, 4, 8, 16]
    by_links = [parse_scenario(with_links(k)).problem() for k in links]
    add_growth(table, "links (time)", links, [microseconds(p, 50, 500) for p in by_links])
    samples = [25, 50, 100, 200]
    by_samples = [changed(builtin("time-3"), samples=n).problem() for n in samples]
    add_growth(table, "samples (time-3)", samples, [microseconds(p, 50, 500) for p in by_samples])
    population = [1, 10, 100, 1000, 10_000]
    problem = builtin("time-3").problem()
    seconds = [microseconds(problem, m, 10_000) * m for m in population]
    add_growth(table, "population (time-3; us a batch)", population, seconds)
    console.print(table)


def with_links(links: int) -> dict[str, object]:
    """The least-time case with any number of links."""
    scenario = builtin("time-2")
    return scenario.model_dump() | {"arm": scenario.arm.with_links(links).model_dump()}


def add_growth(table: Table, what: str, sizes: list[int], times: list[float]) -> None:
    slope = np.polyfit(np.log(sizes), np.log(times), 1)[0]
    table.add_row(what, str(sizes), ", ".join(f"{t:.1f}" for t in times), f"{slope:.2f}")


def overheads(console: Console) -> None:
    """What a solver itself adds to an evaluation: the search of a cost that takes no time."""
    table = Table(
        "solver", "overhead [us]", title="a solver's own overhead per evaluation, population 50, 10 variables"
    )
    box = Box(np.zeros(10), np.ones(10))
    for name, solver in SOLVERS.items():
        job = solver(population=50)
        seconds = median_seconds(lambda job=job: minimize(lambda x: x[:, 0], box, job, Budget(EVALUATIONS), 1))
        table.add_row(name, f"{seconds / EVALUATIONS * 1e6:.2f}")
    console.print(table)


def spline_structure(console: Console) -> None:
    """Three ways from knot angles to the angles at the samples, and what each costs a candidate."""
    problem = builtin("pentagram-rotation").problem()
    assert isinstance(problem, PathFollowing)
    spline, grid = problem.spline, problem.grid
    count = 3 * spline.knots.size
    angles = ca.SX.sym("angles", count)
    knots = ca.reshape(angles, spline.knots.size, 3)
    ways = {
        "one dense matrix": ca.mtimes(ca.DM(spline.operator(grid)), knots),
        "dense coefficients, four terms a sample": ca.mtimes(
            spline.sampling_matrix(grid), ca.mtimes(ca.DM(np.linalg.inv(spline.conditions)), spline.known(knots))
        ),
        "banded solve, four terms a sample (ours)": ca.mtimes(spline.sampling_matrix(grid), spline.coefficients(knots)),
    }
    table = Table("structure", "operations", "us", title=f"{spline.knots.size} knots, {grid.size} samples, 3 joints")
    points = np.random.default_rng(1).random((50, count))
    for name, expression in ways.items():
        function = ca.Function("way", [angles], [ca.sum1(ca.sum2(expression))])
        price = PopulationFunction(function)
        seconds = median_seconds(lambda price=price: price(points))
        table.add_row(name, str(function.n_instructions()), f"{seconds / 50 * 1e6:.1f}")
    console.print(table)


if __name__ == "__main__":
    shown = Console()
    models(shown)
    growth(shown)
    overheads(shown)
    spline_structure(shown)
