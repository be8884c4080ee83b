"""Overhead of each solver per evaluation, and ways to evaluate a path's spline.

Medians within one run on one core; compare ratios, not seconds, between machines. What an evaluation itself
takes: ``benchmarks.population``.

    python -m benchmarks.evaluation
"""

from __future__ import annotations

from functools import partial
from importlib.util import find_spec

import casadi as ca
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.stopwatch import medians
from problems import PathFollowingProblem
from problems.evaluation import EvaluationOptions, PopulationFunction
from solvers import EXTERNAL, SOLVERS, Budget, SearchBox, minimize
from tpbso_casadi import find_solver
from tpbso_casadi.scenario.cases import builtin

EVALUATIONS = 20_000


def overheads(console: Console) -> None:
    """Overhead of each solver that is installed per evaluation: a search whose cost function takes no time."""
    table = Table("solver", "overhead [us]", title="a solver's own overhead per evaluation, 10 variables, defaults")
    box = SearchBox(np.zeros(10), np.ones(10))
    installed = [name for name, each in EXTERNAL.items() if not each.package or find_spec(each.package)]
    jobs = {
        name: partial(minimize, lambda x: x[:, 0], box, find_solver(name)(), Budget(EVALUATIONS), 1)  # type: ignore[arg-type]
        for name in (*SOLVERS, *installed)
    }
    for name, seconds in medians(jobs).items():
        table.add_row(name, f"{seconds / EVALUATIONS * 1e6:.2f}")
    console.print(table)


def spline_structure(console: Console) -> None:
    """Three ways from knot angles to the angles at the samples, and the time of each per candidate."""
    problem = builtin("pentagram-rotation").problem()
    assert isinstance(problem, PathFollowingProblem)
    spline, grid = problem.motion.spline, problem.motion.parameters_u
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
    table = Table(
        "structure", "operations", "backend", "us", title=f"{spline.knots.size} knots, {grid.size} samples, 3 joints"
    )
    points = np.random.default_rng(1).random((50, count))
    functions = {
        name: ca.Function("way", [angles], [ca.sum1(ca.sum2(expression))]) for name, expression in ways.items()
    }
    for backend in ("vm", "native"):
        evaluators = {
            name: PopulationFunction(function, EvaluationOptions(backend)) for name, function in functions.items()
        }
        for evaluate in evaluators.values():
            evaluate(np.tile(points, (60, 1)))  # warms up
        taken = medians({name: partial(evaluate, points) for name, evaluate in evaluators.items()})
        for name, seconds in taken.items():
            table.add_row(name, str(functions[name].n_instructions()), backend, f"{seconds / 50 * 1e6:.2f}")
    console.print(table)


if __name__ == "__main__":
    shown = Console()
    overheads(shown)
    spline_structure(shown)
