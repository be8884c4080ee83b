"""Single steps of each solver, by hand: the test drives the generator, and draws its random numbers again."""

from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from solvers import (
    BAS,
    BSO,
    GA,
    LSHADE,
    PSO,
    AdaptiveBeetleSwarm,
    Budget,
    Iterations,
    RandomSearch,
    SearchBox,
    Solver,
    minimize,
)
from solvers.abso import AXES_KEPT, principal_axes
from solvers.differential import Population, binomial_mask, initial_population, midpoint_repair
from solvers.driver import Archive
from solvers.lshade import SuccessMemory

BOX = SearchBox(np.zeros(2), np.array([10.0, 20.0]))
SEED = 5


class Drawn:
    """The first numbers of a swarm of three: positions, velocities, and the factors of one step."""

    def __init__(self, velocity_range: float) -> None:
        rng = np.random.default_rng(SEED)
        self.v_max = velocity_range * BOX.span
        self.x = rng.uniform(BOX.lower, BOX.upper, (3, 2))
        self.v = rng.uniform(-self.v_max, self.v_max, (3, 2))
        self.r1, self.r2 = rng.random((2, 3, 2))

    def velocity(self, inertia: float, c1: float, c2: float, best: np.ndarray) -> np.ndarray:
        pull = c1 * self.r1 * (self.x - self.x) + c2 * self.r2 * (best - self.x)
        return np.clip(inertia * self.v + pull, -self.v_max, self.v_max)


def drive(solver: Solver, *costs: list[float], progress: float = 0.0) -> list[np.ndarray]:
    """What the solver yields while it receives the given costs."""
    search = solver.search(BOX, np.random.default_rng(SEED), Iterations([progress] * 9))
    yielded = [next(search).copy()]
    yielded += [search.send(np.array(cost)).copy() for cost in costs]
    return yielded


def test_particle_step() -> None:
    drawn = Drawn(0.2)
    solver = PSO(population=3, c1=1.5, c2=2.0, inertia_first=0.9, inertia_last=0.4, velocity_range=0.2)
    first, second = drive(solver, [3.0, 1.0, 2.0], progress=0.5)
    assert (first == drawn.x).all()
    v = drawn.velocity(0.65, 1.5, 2.0, best=drawn.x[1])
    assert second == pytest.approx(BOX.clip(drawn.x + v))


def test_one_beetle() -> None:
    rng = np.random.default_rng(SEED)
    x, directions = rng.uniform(BOX.lower, BOX.upper, (2, 2)), rng.standard_normal((2, 2))
    directions *= BOX.span / np.linalg.norm(directions, axis=1, keepdims=True)
    solver = BAS(population=2, first_step=0.1, eta=0.5, shortest_antenna=0.02, last_step=0.06)
    costs = [1.0, 1.0], [5.0, 1.0, 4.0, 3.0], [0.0, 0.0], [1.0, 2.0, 1.0, 2.0], [0.0, 0.0]
    first, antennae, second, again, fresh, _ = drive(solver, *costs)
    assert (first == x).all()
    assert antennae == pytest.approx(BOX.clip(np.concatenate([x + 0.1 * directions, x - 0.1 * directions])))
    assert second == pytest.approx(BOX.clip(x + 0.1 * directions * np.array([[-1.0], [1.0]])))  # left of 5, 4; of 1, 3
    new = rng.uniform(BOX.lower, BOX.upper, (2, 2))  # the step of 0.05 is below the last one
    directions = rng.standard_normal((2, 2))
    directions *= BOX.span / np.linalg.norm(directions, axis=1, keepdims=True)
    assert again == pytest.approx(BOX.clip(np.concatenate([new + 0.1 * directions, new - 0.1 * directions])))
    assert (fresh == new).all()  # both antennae cost the same: it stays


def test_random_candidates() -> None:
    rng = np.random.default_rng(SEED)
    expected = [rng.uniform(BOX.lower, BOX.upper, (2, 2)) for _ in range(3)]
    assert np.array_equal(drive(RandomSearch(population=2), [1.0, 2.0], [0.0, 3.0]), expected)


def test_particle_keeps_its_own_best() -> None:
    solver = PSO(population=3, c1=1.0, c2=0.0, inertia_first=0.0, inertia_last=0.0, velocity_range=1.0)
    first, second, third = drive(solver, [3.0, 1.0, 2.0], [9.0, 9.0, 0.5])
    assert (second == first).all()  # no inertia, and each stands on its own best
    assert (third == first).all()


@pytest.mark.parametrize(("sign", "towards"), [("descend", -1.0), ("printed", 1.0)])
def test_beetle_step(sign: str, towards: float) -> None:
    drawn = Drawn(0.1)
    solver = BSO(population=3, lambda_=0.6, c1=1.7, c2=1.3, delta_0=2.0, eta=0.5, c=4.0, antenna_sign=sign)
    first, antennae, second, again = drive(solver, [1.0, 3.0, 2.0], [5.0, 1.0, 2.0, 4.0, 3.0, 2.0], [0.0, 9.0, 9.0])
    assert (first == drawn.x).all()
    v = drawn.velocity(0.9, 1.7, 1.3, best=drawn.x[0])
    antenna = v * (2.0 / 4.0) / 2.0  # (29)-(31): d = delta / c
    assert antennae == pytest.approx(np.concatenate([BOX.clip(drawn.x + antenna), BOX.clip(drawn.x - antenna)]))
    signs = np.sign([5.0 - 4.0, 1.0 - 3.0, 2.0 - 2.0])[:, None]  # F(x_right) - F(x_left)
    step = towards * 2.0 * v * signs  # (28)
    assert second == pytest.approx(BOX.clip(drawn.x + 0.6 * v + 0.4 * step))  # (26)
    assert step[2] == pytest.approx(0.0)
    spread = np.abs(again[:3] - again[3:])
    assert (spread <= drawn.v_max * (1.0 / 4.0) + 1e-12).all()  # (32): delta has halved


def test_a_beetle_as_printed_keeps_all_of_its_velocity() -> None:
    """(27) without inertia, early and late; (28) with the printed sign."""
    drawn = Drawn(0.1)
    for progress in (0.0, 1.0):
        solver = BSO(population=3, lambda_=0.6, **BSO.presets["printed"])
        assert solver.antenna_sign == "printed"
        costs = [1.0, 3.0, 2.0], [5.0, 1.0, 2.0, 4.0, 3.0, 2.0]
        _, _, second = drive(solver, *costs, progress=progress)
        v = drawn.velocity(1.0, 1.7, 1.7, best=drawn.x[0])
        step = 2.0 * v * np.array([[1.0], [-1.0], [0.0]])
        assert second == pytest.approx(BOX.clip(drawn.x + 0.6 * v + 0.4 * step))


def test_tournament_is_won_by_the_best() -> None:
    ga = GA(population=4, tournament=30)
    assert ga.select(np.random.default_rng(0), np.array([3.0, 1.0, 2.0, 4.0])).tolist() == [1, 1, 1, 1]


def test_crossover_keeps_the_middle_of_the_parents() -> None:
    wide = SearchBox(np.full(3, -100.0), np.full(3, 100.0))
    parents = np.random.default_rng(1).normal(size=(7, 3))
    children = GA(population=7, crossover_rate=1.0).crossover(np.random.default_rng(0), wide, parents)
    assert children[:3] + children[3:6] == pytest.approx(parents[:3] + parents[3:6])
    assert (children[:3] != parents[:3]).any()
    assert (children[6] == parents[6]).all()


def test_without_crossover_and_mutation_children_are_copies() -> None:
    ga, parents = GA(population=6, crossover_rate=0.0, mutation_rate=0.0), BOX.sample(np.random.default_rng(2), 6)
    children = ga.mutate(np.random.default_rng(0), BOX, ga.crossover(np.random.default_rng(0), BOX, parents))
    assert children == pytest.approx(parents)


def test_mutation_changes_its_share_of_genes_within_the_box() -> None:
    ga = GA(population=2000, mutation_rate=0.25)
    before = BOX.sample(np.random.default_rng(3), 2000)
    after = ga.mutate(np.random.default_rng(0), BOX, before)
    assert (after != before).mean() == pytest.approx(0.25, abs=0.03)
    assert (after == BOX.clip(after)).all()


def test_the_best_individual_survives() -> None:
    first, second, third = drive(GA(population=3, tournament=50), [3.0, -1.0, 2.0], [5.0, 6.0, 7.0])
    assert len(second) == len(third) == 3
    copies = drive(GA(population=3, tournament=50, crossover_rate=0.0, mutation_rate=0.0), [3.0, -1.0, 2.0], [5.0] * 3)
    assert copies[2] == pytest.approx(np.tile(first[1], (3, 1)))


def test_archive_keeps_the_better_of_two_neighbours() -> None:
    archive = Archive(BOX)
    archive.add(np.array([[1.0, 1.0], [1.2, 1.5], [9.0, 9.0]]), np.array([2.0, 1.0, 3.0]))
    assert archive.x.tolist() == [[1.2, 1.5], [9.0, 9.0]]
    archive.add(np.array([[9.1, 9.1], [1.1, 1.0], [5.0, 5.0]]), np.array([0.5, 1.5, np.inf]))
    assert archive.x.tolist() == [[9.1, 9.1], [1.2, 1.5]]
    assert archive.cost.tolist() == [0.5, 1.0]


def adaptive(**settings: float) -> AdaptiveBeetleSwarm:
    """Four beetles whose steps go in all directions of the box."""
    plain = {"population": 4, "directions_first": 1.0, "principal": 0.0, "leaders_first": 0.5, "leaders_last": 0.5}
    return AdaptiveBeetleSwarm(**(plain | settings))


class DrawnBeetles:
    """The numbers that :func:`adaptive` draws: positions, and of the first step leaders and differences."""

    def __init__(self, costs: list[float]) -> None:
        rng = np.random.default_rng(SEED)
        self.x = rng.uniform(BOX.lower, BOX.upper, (4, 2))[np.argsort(costs)]
        self.leaders = self.x[rng.integers(2, size=4)]
        first = (np.arange(4) + rng.integers(1, 4, size=4)) % 4
        second = rng.integers(4, size=4)
        while (clash := (second == np.arange(4)) | (second == first)).any():
            second[clash] = rng.integers(4, size=int(clash.sum()))
        self.difference = self.x[first] - self.x[second]

    def antennae(self, length: float) -> list[np.ndarray]:
        """Both sides; a component out of the box is set to the midpoint of the beetle's and the bound."""
        antennae = []
        for side in (1.0, -1.0):
            x = self.x + length * (self.leaders - self.x) + side * length * self.difference
            x = np.where(x < BOX.lower, (self.x + BOX.lower) / 2.0, x)
            antennae.append(np.where(x > BOX.upper, (self.x + BOX.upper) / 2.0, x))
        return antennae


def test_adaptive_beetle_evaluates_right_then_left_and_moves_where_it_is_better() -> None:
    costs = [3.0, 1.0, 4.0, 2.0]
    drawn = DrawnBeetles(costs)
    right, left = drawn.antennae(0.5)
    # of beetles that cost 1, 2, 3, 4 the first improves on the right, the second on the left, the others do not
    yielded = drive(adaptive(momentum=1.0), costs, [0.5, 2.0, 3.5, 4.5], [1.5, 3.0, 5.0])
    assert yielded[1] == pytest.approx(right)
    assert yielded[2] == pytest.approx(left[1:])
    search = adaptive(momentum=0.0, antenna=1e-12).search(BOX, np.random.default_rng(SEED), Iterations([0.0] * 9))
    next(search)
    search.send(np.array(costs))
    search.send(np.array([0.5, 2.0, 3.5, 4.5]))
    still = search.send(np.array([1.5, 3.0, 5.0]))
    assert still == pytest.approx(drawn.x, abs=1e-6)


def test_principal_axes_are_those_of_the_better_half() -> None:
    along = np.array([3.0, 4.0]) / 5.0
    x = np.outer(np.linspace(-1.0, 1.0, 8), along)
    axes = principal_axes(x)
    assert axes.T @ axes == pytest.approx(np.eye(2))
    assert np.abs(axes.T @ along) == pytest.approx([0.0, 1.0])


def test_principal_axes_are_kept_for_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    done, computed = 0, []

    def cost(x: np.ndarray) -> np.ndarray:
        nonlocal done
        done += len(x)
        return (x * x).sum(axis=1)

    def told(x: np.ndarray) -> np.ndarray:
        computed.append(done)
        return principal_axes(x)

    monkeypatch.setattr("solvers.abso.principal_axes", told)
    minimize(cost, BOX, AdaptiveBeetleSwarm(principal=1.0), Budget(1000), 1)
    assert len(computed) >= 20
    assert np.diff(computed).min() >= AXES_KEPT * BOX.dimension


def test_initial_population_fits_the_budget() -> None:
    for evaluations, members in ((600, 20), (2400, 20), (6000, 50), (10**6, 50), (None, 50)):
        x = initial_population(BOX, np.random.default_rng(0), None, 120, evaluations)
        assert (x == BOX.sample(np.random.default_rng(0), members)).all()
        assert len(initial_population(BOX, np.random.default_rng(0), 7, 120, evaluations)) == 7
    for solver in (LSHADE(effort=100), AdaptiveBeetleSwarm(effort=100)):
        search = solver.search(BOX, np.random.default_rng(SEED), Iterations([0.0], evaluations=3000))
        assert len(next(search)) == 30  # at once


def test_success_memory_learns_lehmer_means() -> None:
    memory = SuccessMemory(np.full(2, 0.5), np.full(2, 0.5))
    memory.learn(np.array([0.2, 0.8]), np.array([1.0, 0.5]), np.array([1.0, 3.0]))
    assert memory.f.tolist() == pytest.approx([(0.04 + 3 * 0.64) / (0.2 + 3 * 0.8), 0.5])
    assert memory.cr.tolist() == pytest.approx([(1.0 + 3 * 0.25) / (1.0 + 3 * 0.5), 0.5])
    memory.learn(np.empty(0), np.empty(0), np.empty(0))
    assert memory.position == 1
    memory.learn(np.array([0.4]), np.array([0.0]), np.array([np.inf]))
    assert (memory.f[1], memory.cr[1], memory.position) == (pytest.approx(0.4), -1.0, 0)
    f, cr = memory.draw(np.random.default_rng(0), 500)
    assert ((f > 0.0) & (f <= 1.0)).all()
    assert ((cr >= 0.0) & (cr <= 1.0)).all()
    assert (cr == 0.0).mean() == pytest.approx(0.5, abs=0.1)


def test_differential_step() -> None:
    solver = LSHADE(population=4, best=0.5, memory_size=1)
    first, second = drive(solver, [1.0, 2.0, 3.0, 4.0])
    rng = np.random.default_rng(SEED)
    x = rng.uniform(BOX.lower, BOX.upper, (4, 2))
    assert (first == x).all()
    f, cr = SuccessMemory(np.array([0.5]), np.array([0.5])).draw(rng, 4)
    swarm = Population.of(x, np.arange(4.0))
    step = f[:, None] * (swarm.leaders(rng, 0.5) - x + swarm.differences(rng))
    changed = binomial_mask(rng, cr[:, None], (4, 2))
    assert second == pytest.approx(midpoint_repair(BOX, x + changed * step, x))


def test_the_swarm_rotates_on_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    threads = set()

    def told(x: np.ndarray) -> np.ndarray:
        threads.update(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
        return principal_axes(x)

    monkeypatch.setattr("solvers.abso.principal_axes", told)
    with threadpool_limits(2, user_api="blas"):
        minimize(lambda x: (x * x).sum(axis=1), BOX, AdaptiveBeetleSwarm(principal=1.0), Budget(200), 1)
    assert threads == {1}
