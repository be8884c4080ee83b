"""The adapters of nevergrad and mealpy in short: what test_solvers.py shows at length when slow tests run."""

from __future__ import annotations

import logging
import random

import numpy as np
import pytest
from helpers.named_solvers import LIBRARIES_OF_MANY, named_solver

from solvers import Box, Budget, Result, StopReason, minimize

BOX = Box(np.array([-3.0, 1.0, 2.0]), np.array([4.0, 1.0, 6.0]))  # flat in one coordinate
CENTRE = np.array([0.5, 1.0, 3.0])
CHOICES = {
    "nevergrad": [{"optimizer": "PSO"}, {"optimizer": "CMA"}, {"optimizer": "RecombiningPortfolioDiscreteOnePlusOne"}],
    "mealpy": [{"algorithm": "GWO.OriginalGWO"}, {"algorithm": "SHADE.L_SHADE"}],
}


def sphere(x: np.ndarray) -> np.ndarray:
    return ((x - CENTRE) ** 2).sum(axis=1)


def search(name: str, seed: int = 1, evaluations: int = 300, **settings: str) -> Result:
    return minimize(sphere, BOX, named_solver(name)(**settings), Budget(evaluations), seed)


@pytest.mark.parametrize("name", LIBRARIES_OF_MANY)
def test_known_candidates_come_first_and_holes_count_as_worst(name: str) -> None:
    seen: list[np.ndarray] = []

    def holes(x: np.ndarray) -> np.ndarray:
        seen.append(x.copy())
        assert ((x >= BOX.lower) & (x <= BOX.upper)).all()
        return np.where(x[:, 0] < 0.0, np.nan, sphere(x))

    known = np.array([[1.0, 1.0, 4.0], [2.0, 1.0, 5.0]])
    result = minimize(holes, BOX, named_solver(name)(), Budget(500), 1, known=known)
    assert np.concatenate(seen)[:2] == pytest.approx(known, abs=1e-12)
    assert (result.evaluations, result.stop_reason) == (500, StopReason.EVALUATIONS)
    assert result.cost < 0.3 < sphere(known).min()


@pytest.mark.parametrize(
    ("name", "settings"), [(name, choice) for name in LIBRARIES_OF_MANY for choice in [{}, *CHOICES[name]]]
)
def test_same_seed_same_result_and_nothing_global_is_left_changed(
    name: str, settings: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    named_solver(name)  # imports the library
    handlers = logging.getLogger().handlers[:]
    random.seed(7)
    np.random.seed(7)  # noqa: NPY002 (this is about it)
    first = search(name, **settings)
    assert random.random() == random.Random(7).random()
    assert np.random.random() == np.random.RandomState(7).random()  # noqa: NPY002
    again, other = search(name, **settings), search(name, seed=2, **settings)
    assert first.history.cost.tolist() == again.history.cost.tolist()
    assert first.x.tolist() == again.x.tolist()
    assert first.x.tolist() != other.x.tolist()
    assert logging.getLogger().handlers == handlers
    assert capfd.readouterr() == ("", "")


def test_an_optimizer_that_works_alone() -> None:
    result = search("nevergrad", optimizer="OnePlusOne", population=1, evaluations=100)  # type: ignore[arg-type]
    assert result.iterations == 99
    assert result.cost < 1.0
