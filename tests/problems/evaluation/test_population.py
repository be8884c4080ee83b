"""A population evaluated: the same numbers as one by one, whatever the size and the layout in memory."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin

from benchmarks.array_cost import array_cost
from problems.evaluation.batches import BATCH_AFTER_CANDIDATES, BATCH_SIZE, MAX_UNBATCHED


@pytest.mark.parametrize("case", ["time-3", "obstacle-4", "pentagram-rotation"])
def test_population_equals_a_loop(case: str) -> None:
    problem = builtin(case)
    lower, upper = problem.bounds
    points = np.random.default_rng(0).uniform(lower, upper, (BATCH_AFTER_CANDIDATES + 2 * BATCH_SIZE + 3, lower.size))
    alone = np.array([problem.cost(x[None])[0] for x in points])
    np.testing.assert_allclose(alone[:200], [float(problem.cost_function(x)) for x in points[:200]], rtol=1e-11)
    for size in (0, 1, MAX_UNBATCHED, MAX_UNBATCHED + 1, BATCH_SIZE - 1, BATCH_SIZE, BATCH_SIZE + 1, len(points)):
        assert (problem.cost(points[:size]) == alone[:size]).all()
    assert (problem.cost(points[::-1]) == alone[::-1]).all()
    assert (problem.cost(np.asfortranarray(points)) == alone).all()


@pytest.mark.parametrize(("case", "formulation"), [*product(BUILTIN, ("paper", "reduced"))])
def test_the_benchmark_compares_with_the_same_cost(case: str, formulation: str) -> None:
    problem = builtin(case, formulation)
    points = np.random.default_rng(0).uniform(*problem.bounds, (300, len(problem.variables)))
    np.testing.assert_allclose(array_cost(problem, np)(points), problem.cost(points), rtol=1e-8)


def test_wrong_shapes_are_refused() -> None:
    problem = builtin("time-2")
    for shape in ((3, 5), (6,), (1, 2, 6)):
        with pytest.raises(ValueError, match="is needed"):
            problem.cost(np.zeros(shape))


@pytest.mark.parametrize("case", BUILTIN)
def test_every_problem_names_its_variables_and_constraints(case: str) -> None:
    problem = builtin(case)
    lower, upper = problem.bounds
    assert len({variable.name for variable in problem.variables}) == lower.size
    assert (lower < upper).all()
    assert len({constraint.name for constraint in problem.constraints}) == len(problem.constraints)
    assert all(constraint.unit and constraint.equation for constraint in problem.constraints)
    assert all(len(constraint.columns) == constraint.expression.shape[1] for constraint in problem.constraints)
