"""Two objectives as one number, against numbers by hand and the area of a front computed anew."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tpbso_casadi.suite.fronts import CORNER, FEASIBLE, Attainment, BestFront
from tpbso_casadi.trade_off.front import hypervolume

BOUND = 50.0
UNIT = BestFront(
    ideal=np.zeros(2), nadir=np.ones(2), hypervolume=0.5, x=np.empty((0, 3)), values=np.empty((0, 2)), ways={}
)
PAIRS = st.lists(st.tuples(st.integers(0, 14), st.integers(0, 14)), min_size=1, max_size=40)


def test_from_nothing_feasible_to_a_front() -> None:
    run = Attainment(UNIT, BOUND)
    assert run.value == inf
    assert run.add((BOUND + 3.0, BOUND + 3.0)) == FEASIBLE + 3.0
    assert run.add((BOUND + 4.0, BOUND + 4.0)) == FEASIBLE + 3.0
    assert run.add((CORNER + 3.0, CORNER + 4.0)) == pytest.approx(1.0 + 5.0 / 6.0)
    assert run.add((0.5, CORNER + 1.0)) == pytest.approx(1.5)
    assert run.add((0.6, 0.6)) == pytest.approx(1.0 - 0.25 / 0.5)
    assert run.add((0.7, 0.7)) == pytest.approx(0.5)  # dominated
    assert run.add((0.1, 1.0)) == pytest.approx(1.0 - (0.25 + 0.05) / 0.5)
    assert run.add((0.1, 0.1)) == pytest.approx(1.0 - 1.0 / 0.5)  # better than what is known
    assert run.add((BOUND + 9.0, BOUND + 9.0)) == pytest.approx(-1.0)


@given(PAIRS)
def test_the_volume_is_that_of_the_front(pairs: list[tuple[int, int]]) -> None:
    values = np.array(pairs) / 10.0
    run = Attainment(UNIT, BOUND)
    values_of_run = [run.add(pair) for pair in values.tolist()]
    assert run.hypervolume == pytest.approx(hypervolume(values, (CORNER, CORNER)), abs=1e-12)
    assert values_of_run == sorted(values_of_run, reverse=True)
    assert run._first == sorted(run._first) and run._second == sorted(run._second, reverse=True)
    assert len({*run._first}) == len(run._first) and len({*run._second}) == len(run._second)


@given(PAIRS, st.randoms(use_true_random=False))
def test_neither_the_order_nor_the_units_matter(pairs: list[tuple[int, int]], shuffle: object) -> None:
    shuffled = list(pairs)
    shuffle.shuffle(shuffled)  # type: ignore[attr-defined]
    scaled = replace(UNIT, ideal=np.array([20.0, -8.0]), nadir=np.array([30.0, -4.0]))
    one, other = Attainment(UNIT, BOUND), Attainment(scaled, BOUND)
    for (a, b), (c, d) in zip(pairs, shuffled, strict=True):
        one.add((a / 10.0, b / 10.0))
        other.add((20.0 + c, -8.0 + 0.4 * d))
    assert other.value == pytest.approx(one.value, abs=1e-9)


@given(st.floats(0.0, 40.0), st.floats(0.0, 40.0))
def test_any_feasible_candidate_is_better_than_any_other(first: float, second: float) -> None:
    value = Attainment(UNIT, BOUND).add((first, second))
    assert value < FEASIBLE < Attainment(UNIT, BOUND).add((np.nextafter(BOUND, inf), 0.0))
    if first >= CORNER or second >= CORNER:
        away = hypot(max(first - CORNER, 0.0), max(second - CORNER, 0.0))
        assert value == pytest.approx(2.0 - 1.0 / (1.0 + away))
