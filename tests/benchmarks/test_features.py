"""Features of landscapes, against what they are by hand; instances that differ."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from math import log

import numpy as np
import pytest

from benchmarks.freeze import features as suite_features
from benchmarks.freeze import freezing
from benchmarks.freeze.definitions import DEFINITIONS
from benchmarks.freeze.features import (
    FEATURES,
    Sample,
    _dispersions,
    _information,
    _nearest_better,
    alike_part,
    features,
    sample_of,
)
from benchmarks.freeze.freezing import NotFrozen, chosen, different

LINE = Sample(np.array([[0.0], [0.1], [0.3], [0.6], [1.0]]))
CUBE = sample_of(3)


def named(sample: Sample, values: object) -> dict[str, float]:
    return dict(zip(FEATURES, features(sample, np.asarray(values, dtype=np.float64)).tolist(), strict=True))


def rugged(x: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(17.0 * x @ [1.0, 2.0, 3.0]) + (x**2).sum(axis=1) + x[:, 0] * x[:, 1])


def test_a_sample_is_the_same_each_time_and_fills_the_cube() -> None:
    assert CUBE.points.shape == (150, 3)
    assert np.array_equal(np.sort((150 * CUBE.points).astype(int), axis=0), np.arange(150)[:, None] + np.zeros((1, 3)))
    sample_of.cache_clear()
    assert np.array_equal(sample_of(3).points, CUBE.points)


def test_adjusted_r2_is_that_of_least_squares() -> None:
    x, y = CUBE.points, rugged(CUBE.points)
    terms = np.column_stack([np.ones(150), x, x**2])
    left = y - terms @ np.linalg.lstsq(terms, y)[0]
    expected = 1.0 - (left @ left / (150 - 7)) / y.var(ddof=1)
    assert named(CUBE, y)["R2 quadratic"] == pytest.approx(expected, rel=1e-9)


def of_line(part: Callable[[Sample, np.ndarray], Iterator[float]], values: list[float]) -> list[float]:
    return list(part(LINE, np.array(values)))


def test_nearest_better_points() -> None:
    """Rising away from the first point everyone's nearest better is the neighbour before it; then it is the next."""
    sd, mean, correlation, variation, degree = of_line(_nearest_better, [0.0, 1.0, 2.0, 3.0, 4.0])
    assert sd == mean == pytest.approx(1.0)
    assert correlation == pytest.approx(1.0) and variation == pytest.approx(0.0)
    assert degree == pytest.approx(np.corrcoef([1, 1, 1, 1, 0], range(5))[0, 1])
    _, mean, _, variation, _ = of_line(_nearest_better, [0.0, 4.0, 3.0, 2.0, 1.0])
    to_any, to_better = np.array([0.1, 0.1, 0.2, 0.3, 0.4]), np.array([0.1, 0.1, 0.3, 0.4, 1.0])
    assert mean == pytest.approx(to_any.sum() / to_better.sum())
    assert variation == pytest.approx(np.std(to_any / to_better, ddof=1) / np.mean(to_any / to_better))


def test_dispersion_is_small_where_the_best_lie_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suite_features, "BEST", (0.25,))  # the two best of five
    every = np.mean([abs(a - b) for a in LINE.points[:, 0] for b in LINE.points[:, 0] if a != b])
    assert of_line(_dispersions, [0.0, 1.0, 2.0, 3.0, 4.0]) == [pytest.approx(0.1 / every)]
    assert of_line(_dispersions, [0.0, 2.0, 3.0, 4.0, 1.0]) == [pytest.approx(1.0 / every)]


def test_information_content() -> None:
    content, settled, turns = of_line(_information, [0.0, 1.0, 0.0, 1.0, 0.0])  # slopes 10, -5, 10/3, -5/2
    assert turns == 1.0 and content >= -(2 / 3 * log(2 / 3) + 1 / 3 * log(1 / 3)) / log(6)
    assert 10.0**settled == pytest.approx(10.0, rel=0.13)  # of a step of the grid
    content, _, turns = of_line(_information, [0.0, 0.1, 0.3, 0.6, 1.0])  # of one slope
    assert turns == 1 / 4 and content == 0.0


# Instances


def test_the_farthest_are_taken_and_others_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(freezing, "INSTANCES", 4)
    table = np.array([[0.1], [-3.0], [4.0], [3.9], [-1.5], [1.9]])
    assert different(table, lambda row: True) == [0, 2, 1, 5]
    assert different(table, lambda row: row != 2) == [0, 3, 1, 5]
    assert different(table, lambda row: row > 3) == [4, 5]


def test_a_part_that_is_like_the_rest() -> None:
    """Of two pairs and two single points far apart, one of each pair and none, or both, of the singles."""
    table = np.array([[0.0], [10.0], [20.0], [0.1], [10.1], [20.1]])
    part = alike_part(table, 3)
    assert len({row % 3 for row in part}) == 3
    rest = [row for row in range(6) if row not in part]
    assert table[part].mean() == pytest.approx(table[rest].mean(), abs=0.1)


def test_instances_of_a_function_are_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in (("SURVEYED", 2), ("POOL", 6), ("INSTANCES", 4), ("TUNING", 1), ("EVALUATIONS", 200)):
        monkeypatch.setattr(freezing, name, value)
    [definition] = [each for each in DEFINITIONS if each.name == "paper-rotation-4"]
    first, again = chosen(definition), chosen(definition)
    assert [each.tables for each in first] == [each.tables for each in again] and len(first) == 4
    assert len({each.key for each in first}) == 1
    drawn = [each.tables for each in islice(freezing.drawn(definition), 6)]
    assert all(each.tables in drawn for each in first)
    monkeypatch.setattr(freezing.Instance, "is_worth_judging", False)
    with pytest.raises(NotFrozen, match="paper-rotation-4: only 0 instances of 6"):
        chosen(definition)
