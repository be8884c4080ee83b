"""Orders of visits against all permutations."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from tpbso_casadi.planning import visits
from tpbso_casadi.planning.visits import Visits


def drawn(seed: int, stops: int, cyclic: bool) -> Visits:
    rng = np.random.default_rng(seed)
    sizes = (2 if cyclic else 1, *rng.integers(1, 4, stops).tolist())
    return Visits(sizes, rng.uniform(0.1, 1.0, (sum(sizes), sum(sizes))), cyclic)


@pytest.mark.parametrize("cyclic", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_the_best_of_all_permutations(seed: int, cyclic: bool) -> None:
    stated = drawn(seed, 5, cyclic)
    order, bound = stated.best_order()
    best = min(stated.cost(each) for each in permutations(range(1, 6)))
    assert bound == pytest.approx(best)
    assert stated.cost(order) == pytest.approx(best)


@pytest.mark.parametrize("cyclic", [False, True])
def test_many_stops_are_improved_and_bounded(cyclic: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = drawn(1, 8, cyclic).sizes
    points = np.random.default_rng(2).uniform(0.0, 1.0, (sum(sizes), 2))
    stated = Visits(sizes, np.linalg.norm(points[:, None] - points, axis=2), cyclic)
    best = stated.best_order()[1]
    monkeypatch.setattr(visits, "EXACT", 3)
    order, bound = stated.best_order()
    assert sorted(order) == list(range(1, 9))
    assert bound <= best <= stated.cost(order) <= 1.2 * best
