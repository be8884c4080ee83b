"""Time to evaluate a population: every method, on every built-in problem, in one run.

Medians; compare ratios, not microseconds, between machines. The columns: CasADi's ``Function.map`` of the model as it
is; our virtual machine and our compiled code; the same cost written by hand for NumPy; and the same lines under JAX's
``jit(vmap)``, if JAX is installed.

    python -m benchmarks.population              the table
    python -m benchmarks.population --compile    what has to be compiled, for a first scene and for a second one
    python -m benchmarks.population --growth     how costs and memory grow: the paper's Tables 2 and 3
    python -m benchmarks.population --solve      the default command, end to end, with a cold and with a warm cache
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import casadi as ca
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.array_cost import array_cost
from benchmarks.stopwatch import medians, slope
from problems import Problem
from problems.base import FloatArray
from problems.base.cache import VARIABLE
from problems.evaluation import EvaluationOptions, PopulationFunction
from problems.evaluation.kernel import portable
from solvers import SOLVERS, Budget, SearchBox, minimize
from tpbso_casadi.scenario import Scenario, parse_scenario
from tpbso_casadi.scenario.cases import TITLES, builtin

FORMULATIONS = ("paper", "reduced")
AGREEMENT_TOLERANCE = 1e-8  # what postures near a singularity make of rounding in the hand-written versions
MOVE_INSTRUCTIONS = (ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT)

Evaluator = Callable[[FloatArray], FloatArray]


def changed(scenario: Scenario, **model: object) -> Scenario:
    """A scenario with other keys in [model]."""
    content = scenario.table()
    content["model"] |= model
    return parse_scenario(content)


def mapped(function: ca.Function, size: int) -> Evaluator:
    """CasADi's own ``map`` of a function over a population."""
    buffer, call = function.map(size).buffer()
    costs = np.empty(size)
    buffer.set_res(0, costs.data)

    def evaluate(points: FloatArray) -> FloatArray:
        buffer.set_arg(0, points.data)
        call()
        return costs

    return evaluate


def jax_cost(problem: Problem[Any]) -> Evaluator:
    """The hand-written cost of one candidate, vectorised and compiled by JAX."""
    import jax  # noqa: PLC0415

    jax.config.update("jax_enable_x64", True)
    compiled = jax.jit(jax.vmap(array_cost(problem, jax.numpy)))
    return lambda points: np.asarray(compiled(points))


def ways(problem: Problem[Any], population: int) -> dict[str, Evaluator]:
    """All methods that evaluate the populations of a problem."""
    evaluators: dict[str, Evaluator] = {
        "map": mapped(problem.program.inlined(), population),
        "vm": problem.evaluator(EvaluationOptions("vm")),
        "native": problem.evaluator(EvaluationOptions("native")),
        "NumPy": array_cost(problem, np),
    }
    if find_spec("jax") is not None:
        evaluators["JAX"] = jax_cost(problem)
    return evaluators


def operations(function: ca.Function) -> int:
    """Arithmetic operations a candidate takes."""
    return sum(function.instruction_id(k) not in MOVE_INSTRUCTIONS for k in range(function.n_instructions()))


def attainable() -> float:
    """Operations per microsecond of our compiled code when it is limited by arithmetic alone.

    Short independent chains of multiplications and additions, all in registers: lanes x clock x issue width.
    """
    x = ca.SX.sym("x", 8)
    total = ca.SX(0)
    for k in range(500):
        chain = x[k % 8] * (1.0 + k)
        for _ in range(8):
            chain = chain * 0.999 + 0.5
        total += chain
    function = ca.Function("chains", [x], [total])
    evaluate = PopulationFunction(function, EvaluationOptions("native"))
    points = np.random.default_rng(0).random((4000, 8))
    seconds = medians({"chains": lambda: evaluate(points)})["chains"]
    return operations(function) * len(points) / seconds / 1e6


def table(console: Console, population: int, names: list[str]) -> None:
    """Microseconds per candidate, and the ratio to compiled code for the other methods."""
    shown = Table(title=f"microseconds a candidate, population {population}")
    others = ["map", "vm", "NumPy"] + (["JAX"] if find_spec("jax") is not None else [])
    for column in ("case", "form", "operations", "native", "of limit", *others):
        shown.add_column(column, justify="left" if column in ("case", "form") else "right")
    limit = attainable()
    for name in names:
        for formulation in FORMULATIONS:
            problem = changed(builtin(name), formulation=formulation).problem()
            size = operations(portable(problem.program.inlined()))
            taken = microseconds(problem, population)
            cells = [f"{taken[other]:.2f} ({taken[other] / taken['native']:.0f}x)" for other in others]
            share = size / limit / taken["native"]
            shown.add_row(name, formulation, str(size), f"{taken['native']:.3f}", f"{share:.0%}", *cells)
    console.print(shown)
    console.print(f"the limit: {limit:.0f} operations a microsecond")


def microseconds(problem: Problem[Any], population: int) -> dict[str, float]:
    """Time per candidate of every method, after checking that all agree."""
    points = SearchBox(*problem.bounds).sample(np.random.default_rng(1), population)
    evaluators = ways(problem, population)
    expected = evaluators["map"](points).copy()
    for way, evaluate in evaluators.items():
        for _ in range(3000 // population):  # until caches and the virtual machine's batch are ready
            costs = evaluate(points)
        if not np.allclose(costs, expected, rtol=AGREEMENT_TOLERANCE, atol=0.0):
            raise SystemExit(f"{way} does not agree: {np.abs(costs / expected - 1.0).max():.1e}")
    batches = max(1, 2000 // population)
    jobs = {way: partial(repeat, evaluate, points, batches) for way, evaluate in evaluators.items()}
    return {way: seconds / batches / population * 1e6 for way, seconds in medians(jobs).items()}


def repeat(evaluate: Evaluator, points: FloatArray, times: int) -> None:
    """Evaluate the same points several times."""
    for _ in range(times):
        evaluate(points)


def compiling(console: Console, names: list[str]) -> None:
    """Compilations of a first scene and of a second one of the same structure, each case with an empty cache."""
    shown = Table(title="compiled before the first candidate is evaluated, natively")
    for column in ("case", "form", "steps", "operations", "unrolled", "CPU [s]", "files", "second CPU [s]", "files"):
        shown.add_column(column, justify="left" if column in ("case", "form") else "right")
    for name in names:
        for formulation in FORMULATIONS:
            first = changed(builtin(name), formulation=formulation)
            problem = first.problem()
            written = sum(operations(portable(step.function)) for step in problem.program.steps)
            unrolled = operations(portable(problem.program.inlined()))
            with TemporaryDirectory() as folder, patch.dict(os.environ, {VARIABLE: folder}):
                cells = []
                for scenario in (first, moved(first)):
                    seconds, files = compiled(scenario.problem(), Path(folder))
                    cells += [f"{seconds:.2f}", str(files)]
            shown.add_row(name, formulation, str(len(problem.program.steps)), str(written), str(unrolled), *cells)
    console.print(shown)


def moved(scenario: Scenario) -> Scenario:
    """Another scene of the same structure: other places, limits and sizes."""
    content = scenario.table()
    task, arm = content["task"], content["arm"]
    elsewhere = {"start": [0.95, -0.1], "goal": [0.4, 1.45], "center": [0.03, -0.02]}
    task |= {key: value for key, value in elsewhere.items() if key in task}
    arm["max_speed"] = np.multiply(1.1, arm["max_speed"]).tolist()
    for obstacle in content["obstacles"]:
        x, y = obstacle["center"]
        obstacle |= {"center": [x + 0.03, y - 0.02], "semi_axes": [0.9 * axis for axis in obstacle["semi_axes"]]}
    return parse_scenario(content)


def compiled(problem: Problem[Any], cache: Path) -> tuple[float, int]:
    """Processor seconds of compilers, and new files in the cache, until the first candidate is evaluated."""
    files, before = libraries(cache), resource.getrusage(resource.RUSAGE_CHILDREN)
    PopulationFunction(problem.program, EvaluationOptions("native"))(np.mean(problem.bounds, axis=0)[None])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, len(libraries(cache) - files)


def libraries(cache: Path) -> set[Path]:
    """Files in a cache."""
    return {path for path in cache.rglob("*") if path.is_file()}


def growth(console: Console) -> None:
    """Tables 2 and 3 of the paper, measured."""
    shown = Table("what grows", "values", "vm", "slope", "native", "slope", title="time (Table 2): 1 is linear")
    for what, unit, sizes, jobs in growing():
        taken = {backend: [medians({"": job(backend)})[""] for job in jobs] for backend in ("vm", "native")}
        cells = []
        for seconds in taken.values():
            cells += [", ".join(f"{s * 1e3:.2f}" for s in seconds), f"{slope(sizes, seconds):.2f}"]
        shown.add_row(f"{what} ({unit})", str(sizes), *cells)
    console.print(shown)
    shown = Table("what grows", "values", "peak [kB]", "slope", title="memory (Table 3)")
    for what, sizes, bytes_of in remembering():
        peaks = [bytes_of(size) for size in sizes]
        shown.add_row(what, str(sizes), ", ".join(f"{p / 1e3:.0f}" for p in peaks), f"{slope(sizes, peaks):.2f}")
    console.print(shown)


def growing() -> list[tuple[str, str, list[int], list[Callable[[str], Callable[[], object]]]]]:
    """Quantities on which the time of a search depends: name, unit, sizes, and for each size a job of a backend."""

    def evaluating(scenario: Scenario, population: int, backend: str) -> Callable[[], object]:
        problem = scenario.problem()
        evaluate = problem.evaluator(EvaluationOptions(backend))
        points = SearchBox(*problem.bounds).sample(np.random.default_rng(1), population)
        repeat(evaluate, points, 1 + 3000 // population)
        return lambda: evaluate(points)

    def search(iterations: int, backend: str) -> Callable[[], object]:
        problem = builtin("time-3").problem()
        evaluate, box = problem.evaluator(EvaluationOptions(backend)), SearchBox(*problem.bounds)
        return lambda: minimize(evaluate, box, SOLVERS["bso"](population=50), Budget(iterations=iterations), 1)

    links, samples, population, iterations = (
        [2, 4, 8, 16],
        [25, 50, 100, 200],
        [64, 512, 4096, 32768],
        [50, 100, 200, 400],
    )
    by_samples = [changed(builtin("time-3"), samples=n) for n in samples]
    return [
        ("population", "ms a population", population, [partial(evaluating, builtin("time-3"), n) for n in population]),
        ("links", "ms for 1,000", links, [partial(evaluating, with_links(k), 1000) for k in links]),
        ("samples", "ms for 1,000", samples, [partial(evaluating, scenario, 1000) for scenario in by_samples]),
        ("iterations", "ms a search of 50 beetles", iterations, [partial(search, n) for n in iterations]),
    ]


def with_links(links: int) -> Scenario:
    """The least-time case with any number of links."""
    scenario = builtin("time-2")
    return parse_scenario(scenario.table() | {"arm": scenario.arm.with_links(links).table()})


def remembering() -> list[tuple[str, list[int], Callable[[int], float]]]:
    """Quantities on which the memory of a search depends: name, sizes, and the peak in bytes."""

    def search(population: int, iterations: int) -> float:
        problem = builtin("time-3").problem()
        evaluate = problem.evaluator(EvaluationOptions("native"))
        evaluate(np.zeros((1, len(problem.variables))))
        run = partial(minimize, evaluate, SearchBox(*problem.bounds), SOLVERS["bso"](population=population))
        return peak(partial(run, Budget(iterations=iterations), 1))

    def output(rows: int) -> float:
        problem = builtin("time-3").problem()
        trajectory = problem.trajectory(np.mean(problem.bounds, axis=0))
        return peak(partial(trajectory.samples, trajectory.times(rows)))

    return [
        ("population", [1000, 4000, 16000], lambda n: search(n, 3)),
        ("rows of the trajectory", [1001, 4001, 16001], output),
        ("iterations (the best of each is kept)", [1000, 4000, 16000], lambda n: search(10, n)),
    ]


def peak(job: Callable[[], object]) -> float:
    """The most bytes that Python and NumPy hold at once during a job."""
    tracemalloc.start()
    try:
        job()
        return float(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()


def end_to_end(console: Console, names: list[str]) -> None:
    """Seconds of the default command, from the shell's point of view."""
    shown = Table("case", "vm [s]", "auto, cold [s]", "auto, warm [s]", "vm / cold", "vm / warm")
    for name in names:
        taken = solving(name)
        ratios = (f"{taken['vm'] / taken[way]:.2f}" for way in ("cold", "warm"))
        shown.add_row(name, *(f"{seconds:.2f}" for seconds in taken.values()), *ratios)
    console.print(shown)


def solving(name: str) -> dict[str, float]:
    """Seconds of the default command with the virtual machine, a cold and a warm cache."""
    with TemporaryDirectory() as folder:
        caches = (Path(folder) / f"cold{k}" for k in count())
        command = partial(run, name, folder)
        command("native", Path(folder) / "warm")
        jobs = {
            "vm": lambda: command("vm", Path(folder) / "warm"),
            "cold": lambda: command("auto", next(caches)),
            "warm": lambda: command("auto", Path(folder) / "warm"),
        }
        return medians(jobs, rounds=5, between=partial(wait_for_compilers, Path(folder)))


def wait_for_compilers(caches: Path) -> None:
    """Wait until no background compiler is running."""
    while any(caches.glob("*/.*")):
        time.sleep(0.1)


def run(name: str, folder: str, backend: str, cache: Path) -> None:
    """The command as a user gives it."""
    command = [sys.executable, "-m", "tpbso_casadi.solve", name, "--backend", backend, "--quiet", "--no-plots"]
    subprocess.run([*command, "--out", folder], env=os.environ | {VARIABLE: str(cache)}, check=False)


def main() -> None:
    parser = argparse.ArgumentParser("python -m benchmarks.population", description=__doc__)
    parser.add_argument("cases", nargs="*", help="built-in scenarios; all if none")
    parser.add_argument("--population", type=int, default=50)
    parser.add_argument("--compile", action="store_true")
    parser.add_argument("--growth", action="store_true")
    parser.add_argument("--solve", action="store_true")
    options = parser.parse_args()
    console, names = Console(), options.cases or list(TITLES)
    if options.compile:
        compiling(console, names)
    elif options.growth:
        growth(console)
    elif options.solve:
        end_to_end(console, names)
    else:
        table(console, options.population, names)


if __name__ == "__main__":
    main()
