"""Single steps of each solver, by hand: the generator is driven here, and its random numbers are drawn again."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import BSO, GA, PSO, Box, Solver
from solvers.archive import Archive
from solvers.swarm import scheduled

BOX = Box(np.zeros(2), np.array([10.0, 20.0]))
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
    search = solver.search(BOX, np.random.default_rng(SEED), iter([progress] * 9))
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


def test_particle_remembers_its_own_best() -> None:
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
    arm = v * (2.0 / 4.0) / 2.0  # (29)-(31): d = delta / c
    assert antennae == pytest.approx(np.concatenate([BOX.clip(drawn.x + arm), BOX.clip(drawn.x - arm)]))
    smells = np.sign([5.0 - 4.0, 1.0 - 3.0, 2.0 - 2.0])[:, None]  # F(x_right) - F(x_left)
    step = towards * 2.0 * v * smells  # (28)
    assert second == pytest.approx(BOX.clip(drawn.x + 0.6 * v + 0.4 * step))  # (26)
    assert step[2] == pytest.approx(0.0)
    spread = np.abs(again[:3] - again[3:])
    assert (spread <= drawn.v_max * (1.0 / 4.0) + 1e-12).all()  # (32): delta has halved


def test_beetle_prices_three_candidates_an_iteration() -> None:
    sizes = [len(part) for part in drive(BSO(population=4), [1.0] * 4, [1.0] * 8, [1.0] * 4, [1.0] * 8)]
    assert sizes == [4, 8, 4, 8, 4]


def test_inertia_is_scheduled() -> None:
    assert [scheduled(0.9, 0.4, progress) for progress in (0.0, 0.5, 1.0)] == pytest.approx([0.9, 0.65, 0.4])


def test_tournament_is_won_by_the_best() -> None:
    ga = GA(population=4, tournament=30)
    assert ga.select(np.random.default_rng(0), np.array([3.0, 1.0, 2.0, 4.0])).tolist() == [1, 1, 1, 1]


def test_crossover_keeps_the_middle_of_the_parents() -> None:
    wide = Box(np.full(3, -100.0), np.full(3, 100.0))
    parents = np.random.default_rng(1).normal(size=(7, 3))
    children = GA(population=7, crossover_rate=1.0).cross(np.random.default_rng(0), wide, parents)
    assert children[:3] + children[3:6] == pytest.approx(parents[:3] + parents[3:6])
    assert (children[:3] != parents[:3]).any()
    assert (children[6] == parents[6]).all()


def test_without_crossover_and_mutation_children_are_copies() -> None:
    ga, parents = GA(population=6, crossover_rate=0.0, mutation_rate=0.0), BOX.sample(np.random.default_rng(2), 6)
    children = ga.mutate(np.random.default_rng(0), BOX, ga.cross(np.random.default_rng(0), BOX, parents))
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
