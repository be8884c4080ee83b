"""What every solver keeps, whatever its algorithm: generated from the registry."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from helpers.named_solvers import PARAMETERS, WITHOUT_CHANCE, named_solver

from solvers import (
    EXTERNAL,
    SOLVERS,
    Budget,
    Iterations,
    RandomSearch,
    Result,
    Search,
    SearchBox,
    Solver,
    Status,
    StopReason,
    minimize,
)

BOX = SearchBox(np.array([-3.0, -2.0, 0.0, -5.0, 1.0]), np.array([4.0, 5.0, 6.0, 1.0, 3.0]))
CENTRE = np.array([0.5, 1.0, 2.0, -1.0, 2.0])
Cost = Callable[[np.ndarray], np.ndarray]


def sphere(x: np.ndarray) -> np.ndarray:
    return ((x - CENTRE) ** 2).sum(axis=1)


@pytest.fixture(params=PARAMETERS)
def solver(request: pytest.FixtureRequest) -> Solver:
    return named_solver(request.param)()


def learns(solver: Solver) -> bool:
    """Whether what it has evaluated tells a solver where to go on."""
    return not isinstance(solver, RandomSearch)


def search(solver: Solver, cost: Cost = sphere, seed: int = 1, **budget: float) -> Result:
    return minimize(cost, BOX, solver, Budget(**(budget or {"evaluations": 3000})), seed)


def test_same_seed_same_result_other_seed_another(solver: Solver) -> None:
    first, again, other = (search(solver, seed=seed, evaluations=500) for seed in (1, 1, 2))
    assert (first.x == again.x).all()
    assert (first.history.cost == again.history.cost).all()
    by_chance = not isinstance(solver, tuple(named_solver(name) for name in WITHOUT_CHANCE))
    assert (first.x != other.x).any() == by_chance
    drawn_on = minimize(sphere, BOX, solver, Budget(500), np.random.default_rng(1))
    assert (drawn_on.x == first.x).all()
    assert drawn_on.seed is None


def test_a_search_finds_the_minimum_of_a_sphere_and_says_how(solver: Solver) -> None:
    """Candidates, statuses and history agree to the last evaluation."""
    sizes: list[int] = []
    statuses: list[Status] = []

    def counted(x: np.ndarray) -> np.ndarray:
        sizes.append(len(x))
        return sphere(x)

    result = minimize(counted, BOX, solver, Budget(10_000), 1, statuses.append)
    assert result.cost < (1e-3 if learns(solver) else 1.0)
    assert result.x == pytest.approx(CENTRE, abs=0.05 if learns(solver) else 1.0)
    assert result.cost == sphere(result.x[None])[0] == result.history.cost[-1]
    assert (result.evaluations, result.stop_reason) == (sum(sizes), StopReason.EVALUATIONS)
    assert result.evaluations == 10_000
    assert [status.evaluations for status in statuses] == result.history.evaluations.tolist()
    assert [status.cost for status in statuses] == result.history.cost.tolist()
    assert (np.diff(result.history.evaluations) > 0).all()
    assert (np.diff(result.history.cost) <= 0.0).all()
    assert (np.diff([status.progress for status in statuses]) > 0.0).all()
    assert sphere(result.history.best) == pytest.approx(result.history.cost)


def test_known_candidates_are_the_first_that_are_evaluated(solver: Solver) -> None:
    evaluated: list[np.ndarray] = []

    def recorded(x: np.ndarray) -> np.ndarray:
        evaluated.append(x.copy())
        return sphere(x)

    known = np.array([CENTRE, CENTRE + 0.1, BOX.upper + 1.0])
    result = minimize(recorded, BOX, solver, Budget(40), 1, known=known)
    first = np.concatenate(evaluated)[: 1 if solver.population == 1 else 3]
    assert first == pytest.approx(np.minimum(known, BOX.upper)[: len(first)], abs=1e-12)
    assert result.cost == pytest.approx(0.0, abs=1e-20)
    assert result.x == pytest.approx(CENTRE, abs=1e-12)


def test_more_known_candidates_than_there_are_places(solver: Solver) -> None:
    known = BOX.sample(np.random.default_rng(5), 500)
    first, again = (minimize(sphere, BOX, solver, Budget(600), 1, known=known) for _ in range(2))
    assert (first.x == again.x).all()
    assert first.cost <= sphere(known[:1])[0]


def test_every_candidate_lies_in_the_box(solver: Solver) -> None:
    def strict(x: np.ndarray) -> np.ndarray:
        assert (x >= BOX.lower).all()
        assert (x <= BOX.upper).all()
        return -x.sum(axis=1)  # drives into a corner

    assert search(solver, strict, evaluations=2000).x == pytest.approx(BOX.upper, rel=0.05 if learns(solver) else 0.5)


def test_nan_and_infinite_costs_count_as_worst(solver: Solver) -> None:
    def holes(x: np.ndarray) -> np.ndarray:
        cost = sphere(x)
        cost[x[:, 0] < 0.0] = np.nan
        cost[x[:, 1] < 0.0] = -np.inf
        cost[x[:, 2] > 5.0] = np.inf
        return cost

    result = search(solver, holes, evaluations=2000)
    assert np.isfinite(result.cost)
    assert result.cost < (0.5 if learns(solver) else 1.0)
    nothing = search(solver, lambda x: np.full(len(x), np.nan), evaluations=300)
    assert (nothing.cost, nothing.evaluations) == (np.inf, 300)


def test_the_least_budgets_are_kept_to_exactly(solver: Solver) -> None:
    for evaluations in (1, 7):
        sizes: list[int] = []
        result = search(solver, lambda x, sizes=sizes: (sizes.append(len(x)), sphere(x))[1], evaluations=evaluations)
        assert sum(sizes) == result.evaluations == evaluations
        assert result.stop_reason is StopReason.EVALUATIONS
    result = search(solver, iterations=5)
    assert (result.iterations, result.stop_reason) == (5, StopReason.ITERATIONS)
    assert len(result.history.cost) == 6


def test_a_target_and_stagnation_end_a_search(solver: Solver) -> None:
    result = search(solver, evaluations=10_000, target=1.0)
    assert (result.cost <= 1.0, result.stop_reason) == (True, StopReason.TARGET)
    assert result.evaluations < 10_000
    level = search(solver, lambda x: np.ones(len(x)), evaluations=10_000, stagnation=4)
    assert (level.iterations, level.stop_reason) == (4, StopReason.STAGNATION)


def test_a_box_may_be_flat_in_a_coordinate(solver: Solver) -> None:
    flat = SearchBox(np.array([1.0, -1.0]), np.array([1.0, 1.0]))
    result = minimize(lambda x: (x**2).sum(axis=1), flat, solver, Budget(1000), 1)
    assert result.x[0] == 1.0
    assert abs(result.x[1]) < 0.01


def test_population_has_a_least_size_and_settings_have_names(solver: Solver) -> None:
    kind = type(solver)
    with pytest.raises(ValueError, match=f"at least {kind.minimum_population}"):
        kind(population=kind.minimum_population - 1)
    with pytest.raises(TypeError, match="popsize"):
        kind(popsize=30)
    smallest = search(kind(population=kind.minimum_population), evaluations=300)
    assert np.isfinite(smallest.cost)


IN_A_THREAD = "scipy-de"  # whose library calls the cost, while those of ours are called
two_kinds = pytest.mark.parametrize("solver", ["bso", IN_A_THREAD], indirect=True)


@two_kinds
def test_seconds_end_a_search(solver: Solver) -> None:
    assert search(solver, seconds=0.05).stop_reason is StopReason.SECONDS


@pytest.mark.process
@two_kinds
def test_interruption_keeps_the_best_and_the_handler(solver: Solver) -> None:
    before, calls = signal.getsignal(signal.SIGINT), []

    def interrupted(x: np.ndarray) -> np.ndarray:
        calls.append(len(x))
        if len(calls) == 4:
            os.kill(os.getpid(), signal.SIGINT)
        return sphere(x)

    result = search(solver, interrupted)
    assert result.stop_reason is StopReason.INTERRUPTED
    assert np.isfinite(result.cost)
    assert result.evaluations == sum(calls)
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.process
@two_kinds
def test_an_ignored_sigint_stays_ignored(solver: Solver) -> None:
    def interrupted(x: np.ndarray) -> np.ndarray:
        os.kill(os.getpid(), signal.SIGINT)
        return sphere(x)

    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        assert search(solver, interrupted, evaluations=300).stop_reason is StopReason.EVALUATIONS
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


@dataclass(frozen=True)
class OneShot(Solver):
    """Evaluates one population and ends."""

    population: int = 5
    leaves_box: bool = False

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        yield box.upper + box.sample(rng, self.population) * self.leaves_box


def test_what_a_solver_may_do() -> None:
    assert search(OneShot()).stop_reason is StopReason.EXHAUSTED
    with pytest.raises(ValueError, match="left its box"):
        search(OneShot(leaves_box=True))
    with pytest.raises(ValueError, match="for 5 candidates"):
        search(OneShot(), lambda x: np.zeros(len(x) + 1))
    for known in (np.zeros(5), np.zeros((2, 4)), np.full((1, 5), np.nan)):
        with pytest.raises(ValueError, match="known candidate"):
            minimize(sphere, BOX, SOLVERS["bso"](), Budget(100), 1, known=known)


@pytest.mark.parametrize(
    ("lower", "upper", "reason"),
    [([0.0], [1.0, 2.0], "shapes"), ([], [], "shapes"), ([0.0], [np.inf], "finite"), ([1.0], [0.0], "swap")],
)
def test_impossible_boxes(lower: list[float], upper: list[float], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        SearchBox(np.array(lower), np.array(upper))


BAD_SETTINGS: dict[str, dict[str, list[object]]] = {
    "bso": {
        **{"lambda_": [1.1], "c1": [-1.0], "inertia_last": [-0.1], "velocity_range": [0.0], "delta_0": [-1.0]},
        **{"eta": [0.0], "c": [0.0], "antenna_sign": ["up"]},
    },
    "pso": {"c2": [-1.0], "inertia_first": [-0.1], "velocity_range": [0.0]},
    "abso": {
        **{"effort": [0], "last_population": [3], "antenna": [0.0], "momentum": [-0.1], "leaders_last": [0.0]},
        **{"directions_first": [1.1], "principal": [-0.1], "archive_rate": [-1.0]},
    },
    "lshade": {"effort": [0], "last_population": [3], "memory_size": [0], "best": [0.0], "archive_rate": [-1.0]},
    "ga": {"tournament": [0], "crossover_rate": [1.5], "mutation_rate": [-0.1], "mutation_eta": [-1.0]},
    "scipy-de": {"recombination": [1.1], "strategy": ["rand3"]},
    "annealing": {"visit": [1.0], "restart_temp_ratio": [1.0]},
    "cma": {"sigma": [0.0], "growth": [0.5]},
    "pymoo": {"algorithm": ["best"]},
    "nevergrad": {"optimizer": ["Best", "SQP"]},
    "mealpy": {"algorithm": ["PSO", "Optimizer"]},
    "bas": {"first_step": [0.0], "eta": [1.0], "shortest_antenna": [-0.1], "last_step": [0.0]},
    "random": {},
    "scipy-direct": {"locally_biased": [2], "eps": [-1.0]},
    "pygmo": {"algorithm": ["best"]},
    "minion": {"algorithm": ["NelderMead"]},
}


@pytest.mark.parametrize("name", BAD_SETTINGS)
def test_settings_out_of_range(name: str) -> None:
    kind = named_solver(name)
    for setting, values in BAD_SETTINGS[name].items():
        for value in values:
            with pytest.raises(ValueError, match=setting.split("_")[0]):
                kind(**{setting: value})


def test_no_solver_lacks_bad_settings() -> None:
    assert set(BAD_SETTINGS) == {*SOLVERS, *EXTERNAL}


def rosenbrock(x: np.ndarray) -> np.ndarray:
    return (100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2).sum(axis=1)


RECORDED = {  # first of the best's variables and its cost; abso along the axes, as eigenvectors depend on the processor
    ("abso", 300): (1.0055465854360035, 0.3156226786091582),
    ("abso", 1500): (-0.9933031462755192, 3.9866758255258405),
    ("lshade", 300): (-0.9353194351619739, 10.163451202391066),
    ("lshade", 1500): (-0.9933167016120759, 3.9866759393111755),
}


@pytest.mark.parametrize(("name", "evaluations"), RECORDED)
def test_same_seed_same_result_as_recorded(name: str, evaluations: int) -> None:
    settings = {"effort": 60} | ({"principal": 0.0} if name == "abso" else {})
    result = minimize(rosenbrock, BOX, named_solver(name)(**settings), Budget(evaluations), 7)
    x, cost = RECORDED[name, evaluations]
    assert (result.x[0], result.cost) == (pytest.approx(x, rel=1e-9), pytest.approx(cost, rel=1e-6))
