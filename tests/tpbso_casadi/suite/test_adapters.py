"""Problems of other libraries: the same values, and a search by each of them."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from helpers.evaluation import needs_compiler

import tpbso_casadi as tp
from tpbso_casadi.suite import InvalidSuite, adapters

pytestmark = needs_compiler
SUITE = tp.suite()
ONE, CONSTRAINED, TWO = (SUITE[name] for name in ("spline-2@1", "constrained-3@1", "time-length-4@1"))


def candidates(problem: object, rows: int = 12) -> np.ndarray:
    return np.random.default_rng(2).uniform(*problem.bounds, (rows, problem.dimension))  # type: ignore[attr-defined]


def test_scipy() -> None:
    optimize = pytest.importorskip("scipy.optimize")
    function, x = ONE.to("scipy"), candidates(ONE)
    assert [function(row) for row in x] == ONE.merit(x).tolist()
    assert np.array_equal(function.vectorized(x.T), ONE.merit(x))
    search = {"maxiter": 15, "popsize": 4, "vectorized": True, "updating": "deferred", "polish": False, "rng": 1}
    found = optimize.differential_evolution(function.vectorized, function.bounds, **search)
    assert found.fun == function(found.x) <= ONE.feasible_merit


def test_pymoo() -> None:
    pytest.importorskip("pymoo")
    from pymoo.algorithms.moo.nsga2 import NSGA2  # noqa: PLC0415
    from pymoo.optimize import minimize  # noqa: PLC0415

    for problem in (ONE, CONSTRAINED, TWO):
        x, adapted = candidates(problem), problem.to("pymoo")
        out = adapted.evaluate(x, return_as_dictionary=True)
        assert np.array_equal(out["F"].squeeze(), problem.evaluate(x))
        if problem is ONE:
            assert adapted.n_ieq_constr == 0
        else:
            assert np.array_equal(out["G"], problem.constraints(x))
    found = minimize(TWO.to("pymoo"), NSGA2(pop_size=40), ("n_gen", 60), seed=1)
    assert found.F is not None and found.F.shape[1] == 2
    assert np.array_equal(TWO.constraints(found.X), np.zeros((len(found.X), len(TWO.constraint_names))))


def test_pygmo() -> None:
    pygmo = pytest.importorskip("pygmo")
    for problem, further in ((ONE, 0), (CONSTRAINED, 5), (TWO, 3)):
        x, adapted = candidates(problem), problem.to("pygmo")
        assert adapted.get_name() == problem.name
        assert (adapted.get_nobj(), adapted.get_nic()) == (len(problem.objectives), further)
        rows = np.array([adapted.fitness(row) for row in x])
        assert np.array_equal(rows[:, : adapted.get_nobj()].squeeze(), problem.evaluate(x))
        assert np.array_equal(rows[:, adapted.get_nobj() :], problem.constraints(x)[:, :further])
        assert np.array_equal(adapted.batch_fitness(x.ravel()), rows.ravel())
    population = pygmo.algorithm(pygmo.sade(60, seed=1)).evolve(pygmo.population(ONE.to("pygmo"), 20, seed=1))
    assert population.champion_f[0] == ONE.merit(population.champion_x[None])[0] <= ONE.feasible_merit


@pytest.mark.slow  # to load
def test_nevergrad() -> None:
    pytest.importorskip("nevergrad")
    import nevergrad as ng  # noqa: PLC0415

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        function, x = ONE.to("nevergrad"), candidates(ONE)
        assert [function(row) for row in x] == ONE.merit(x).tolist()
        optimizer = ng.optimizers.DE(parametrization=function.parametrization, budget=100)
        found = optimizer.minimize(function)
    lower, upper = ONE.bounds
    assert (found.value >= lower).all() and (found.value <= upper).all()
    assert function(found.value) < ONE.merit(x).max()


def test_ioh(tmp_path: object) -> None:
    ioh = pytest.importorskip("ioh")
    function, x = ONE.to("ioh"), candidates(ONE)
    lower, upper = ONE.bounds
    shares = (x - lower) / (upper - lower)
    logger = ioh.logger.Analyzer(root=str(tmp_path), algorithm_name="drawn")
    function.attach_logger(logger)
    values = [function(row) for row in shares]
    np.testing.assert_allclose(values, ONE.merit(lower + shares * (upper - lower)), rtol=0.0)
    assert function.state.evaluations == len(x) and function.meta_data.n_variables == ONE.dimension
    logger.close()


@pytest.mark.parametrize("library", ["ioh", "nevergrad", "scipy"])
def test_one_number_does_not_say_two_objectives(library: str) -> None:
    pytest.importorskip(library)
    with pytest.raises(InvalidSuite, match=f"has two objectives, and {library} takes one"):
        TWO.to(library)


def test_no_such_library(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidSuite, match="no adapter for 'nope'; there are ioh, nevergrad, pygmo, pymoo, scipy"):
        ONE.to("nope")
    monkeypatch.setitem(adapters.ADAPTERS, "pygmo", ("not_installed_at_all", adapters.pygmo_problem))
    with pytest.raises(InvalidSuite, match="pygmo is not installed: pip install pygmo"):
        ONE.to("pygmo")
