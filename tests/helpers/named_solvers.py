"""Every metaheuristic of the registry, by name; those of libraries that are not installed skip the test."""

from __future__ import annotations

from pkgutil import resolve_name

import pytest

from solvers import EXTERNAL, SOLVERS, Solver

LIBRARIES_OF_MANY = ("nevergrad", "mealpy")  # a tenth to a millisecond a candidate: see test_libraries.py instead
WITHOUT_CHANCE = ("scipy-direct",)  # any seed gives the same search
NAMES = [*SOLVERS, *EXTERNAL]
PARAMETERS = [pytest.param(name, marks=[pytest.mark.slow] * (name in LIBRARIES_OF_MANY)) for name in NAMES]


def named_solver(name: str) -> type[Solver]:
    if name in SOLVERS:
        return SOLVERS[name]
    if EXTERNAL[name].package:
        pytest.importorskip(EXTERNAL[name].package)
    solver: type[Solver] = resolve_name(EXTERNAL[name].path)
    return solver
