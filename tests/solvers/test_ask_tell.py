"""Ask and tell: the candidates are those of minimize, misuse is an error, a saved search goes on as it was."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.named_solvers import PARAMETERS, named_solver

import tpbso_casadi as tp
from solvers.solver import Search
from tpbso_casadi import AskTell, Budget, StopReason

BOUNDS = [(-3.0, 4.0), (-2.0, 5.0), (0.0, 6.0)]


def cost(x: np.ndarray) -> np.ndarray:
    return (100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2).sum(axis=1)


def holes(x: np.ndarray) -> np.ndarray:
    return np.where(x[:, 0] < 0.0, np.nan, cost(x))


def finish(search: AskTell, f: Callable[[np.ndarray], np.ndarray] = cost) -> list[np.ndarray]:
    """Every batch from here to the end."""
    asked = []
    while not search.done:
        asked.append(search.ask())
        search.tell(asked[-1], f(asked[-1]))
    return asked


@pytest.mark.parametrize("name", PARAMETERS)
def test_the_candidates_are_those_of_minimize(name: str) -> None:
    named_solver(name)
    budgets = [Budget(120), *([Budget(iterations=3), Budget(400, stagnation=2)] if name in ("bso", "scipy-de") else [])]
    for budget in budgets:
        same_candidates(name, budget)


def same_candidates(name: str, budget: Budget) -> None:
    evaluated: list[np.ndarray] = []
    expected = tp.minimize(
        lambda x: (evaluated.append(x.copy()), holes(x))[1], BOUNDS, name, budget, seed=5, vectorized=True
    )
    search = AskTell(name, BOUNDS, budget=budget, seed=5)
    asked = finish(search, holes)
    assert np.concatenate(asked).tolist() == np.concatenate(evaluated).tolist()
    result = search.result
    assert search.stop_reason is result.stop_reason is expected.stop_reason
    assert (result.x.tolist(), result.cost, result.seed) == (expected.x.tolist(), expected.cost, 5)
    assert result.history.evaluations.tolist() == expected.history.evaluations.tolist()
    assert result.history.cost.tolist() == expected.history.cost.tolist()


@pytest.mark.parametrize("name", PARAMETERS)
def test_a_saved_search_goes_on_bit_for_bit(name: str, tmp_path: Path) -> None:
    named_solver(name)
    search = AskTell(name, BOUNDS, budget=240, seed=2, known=[[1.0, 1.0, 1.0]])
    for _ in range(2):
        search.tell(search.ask(), holes(search.ask()))
    loaded = AskTell.load(search.save(tmp_path / "search.npz"))
    rest, again = finish(search, holes), finish(loaded, holes)
    assert [batch.tolist() for batch in rest] == [batch.tolist() for batch in again]
    assert len(rest) > 0
    assert search.result.history.cost.tolist() == loaded.result.history.cost.tolist()


def test_a_search_that_has_ended_can_be_saved_too(tmp_path: Path) -> None:
    search = AskTell("pso", BOUNDS, budget=70)
    finish(search)
    loaded = AskTell.load(search.save(tmp_path / "search.npz"))
    assert loaded.done
    assert loaded.result.x.tolist() == search.result.x.tolist()


def test_asking_twice_changes_nothing_and_what_is_asked_is_a_copy() -> None:
    search = AskTell("pso", BOUNDS, budget=100)
    first = search.ask()
    first[:] = 0.0
    second = search.ask()
    assert second.tolist() == tp.AskTell("pso", BOUNDS, budget=100).ask().tolist()
    search.tell(second, cost(second))
    assert search.status.evaluations == len(second)
    assert search.status.cost == cost(second).min()


def test_stopping_before_the_budget_is_spent() -> None:
    search = AskTell("bso", BOUNDS, budget=1000)
    with pytest.raises(RuntimeError, match="no cost was told yet"):
        search.stop()
    candidates = search.ask()
    search.tell(candidates, cost(candidates))
    assert search.stop_reason is None
    with pytest.raises(RuntimeError, match="result: the search has not ended"):
        _ = search.result
    search.stop()
    search.stop()
    assert search.result.stop_reason is search.stop_reason is StopReason.INTERRUPTED
    assert search.result.cost == cost(candidates).min()


def test_misuse_is_one_line_and_leaves_the_search_as_it_was() -> None:
    search = AskTell("pso", BOUNDS, budget=60, population=30)
    candidates = tp.AskTell("pso", BOUNDS, budget=60, population=30).ask()
    with pytest.raises(RuntimeError, match=r"^tell: nothing was asked for; ask\(\) first$"):
        search.tell(candidates, cost(candidates))
    search.ask()
    for wrong in (candidates[:-1], candidates[::-1], np.nan * candidates):
        with pytest.raises(ValueError, match=r"^tell: these are not the 30 candidates that ask\(\) gave"):
            search.tell(wrong, cost(candidates))
    with pytest.raises(ValueError, match=r"^tell: costs of shape \(29,\) for 30 candidates; \(30,\)$"):
        search.tell(candidates, cost(candidates)[:-1])
    with pytest.raises(ValueError, match=r"^tell: costs of shape \(30, 1\) for 30 candidates; \(30,\)$"):
        search.tell(candidates, cost(candidates)[:, None])
    with pytest.raises(ValueError, match=r"^tell: costs are 'cheap' where real numbers are needed$"):
        search.tell(candidates, "cheap")
    with pytest.raises(ValueError, match=r"^tell: costs are array.* where real numbers are needed$"):
        search.tell(candidates, 1j * cost(candidates))
    search.tell(candidates, cost(candidates))
    with pytest.raises(RuntimeError, match="nothing was asked for"):
        search.tell(candidates, cost(candidates))
    finish(search)
    assert search.result.cost == tp.minimize(cost, BOUNDS, "pso", 60, vectorized=True, population=30).cost
    with pytest.raises(RuntimeError, match=r"^ask: the search has ended \(evaluations\)"):
        search.ask()
    with pytest.raises(RuntimeError, match=r"^tell: the search has ended \(evaluations\)"):
        search.tell(candidates, cost(candidates))


def test_it_says_what_it_is() -> None:
    search = AskTell("pso", BOUNDS, budget=60, population=30, c1=1.0)
    assert repr(search).startswith("AskTell(PSO(population=30, c1=1.0,")
    assert repr(search).endswith("0 evaluations, cost=inf, running)")
    finish(search)
    assert repr(search).endswith(", evaluations)")


def test_a_library_in_a_thread_ends_with_its_search() -> None:
    before = threading.active_count()
    search = AskTell("scipy-de", BOUNDS, budget=200)
    search.tell(search.ask(), cost(search.ask()))
    assert threading.active_count() == before + 1
    search.stop()
    assert threading.active_count() == before


@dataclass(frozen=True)
class Wanderer(tp.Solver):
    """Asks for other candidates than before when it is made again."""

    population: int = 4
    made = [0]  # noqa: RUF012 (shared on purpose)
    grows: bool = False

    def search(self, box: tp.SearchBox, rng: np.random.Generator, iterations: tp.Iterations) -> Search:
        self.made[0] += 1
        size = self.population + self.made[0] * self.grows
        yield box.from_unit(np.full((size, box.dimension), 0.5 / self.made[0]))
        yield box.sample(rng, size)


@pytest.mark.parametrize(("grows", "reason"), [(False, "asks for other candidates"), (True, "takes another course")])
def test_another_course_is_noticed(tmp_path: Path, grows: bool, reason: str) -> None:
    search = AskTell(Wanderer(grows=grows), BOUNDS)
    search.tell(search.ask(), cost(search.ask()))
    file = search.save(tmp_path / "search.npz")
    with pytest.raises(ValueError, match=f"search.npz: the search {reason}"):
        AskTell.load(file)


def test_what_cannot_be_saved(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="a budget of seconds depends on the clock"):
        AskTell("pso", BOUNDS, budget=Budget(seconds=9.0)).save(tmp_path / "a.npz")
    with pytest.raises(ValueError, match="a generator for its seed"):
        AskTell("pso", BOUNDS, seed=np.random.default_rng(1)).save(tmp_path / "a.npz")  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_files_that_are_none(tmp_path: Path) -> None:
    file = tmp_path / "x.npz"
    for content in (b"", b"no archive", b"PK\x03\x04 cut"):
        file.write_bytes(content)
        with pytest.raises(ValueError, match=r"x.npz: not a saved search"):
            AskTell.load(file)
    np.savez(file, stated=np.array("{}"), sizes=np.ones(1), costs=np.ones(1), known=np.ones(1))
    with pytest.raises(ValueError, match=r"x.npz: not a saved search: 'format'"):
        AskTell.load(file)


CHANGES: list[tuple[str, Callable[[Any], Any]]] = [
    ("stated", lambda stated: stated | {"seed": -3}),
    ("stated", lambda stated: stated | {"solver": "os:system"}),
    ("stated", lambda stated: stated | {"settings": [1]}),
    ("stated", lambda stated: stated | {"settings": {"population": "many"}}),
    ("stated", lambda stated: stated | {"budget": {"evaluations": 1.5}}),
    ("costs", lambda costs: costs * 1j),
    ("costs", lambda costs: costs[:, None]),
    ("costs", lambda costs: costs.astype(str)),
]


def test_an_archive_that_was_changed(tmp_path: Path) -> None:
    search = AskTell("pso", BOUNDS, budget=60, population=30)
    search.tell(search.ask(), cost(search.ask()))
    file = search.save(tmp_path / "x.npz")
    with np.load(file) as archive:
        kept = dict(archive)
    for name, change in CHANGES:
        part = change(json.loads(str(kept["stated"]))) if name == "stated" else change(kept[name])
        np.savez(file, **(kept | {name: np.array(json.dumps(part)) if name == "stated" else part}))
        with pytest.raises(ValueError, match=r"x.npz: not a saved search: [^\n]+$"):
            AskTell.load(file)
