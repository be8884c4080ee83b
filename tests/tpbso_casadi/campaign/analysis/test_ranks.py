"""Ranks and tests over cases, against the worked examples of Demsar's paper and SciPy."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from helpers.comparisons import final, random_results, results
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, rankdata, wilcoxon
from scipy.stats import f as f_distribution

from tpbso_casadi.campaign.statistics import cases_needed, friedman, groups_of, ranking, signed_rank

INF = np.inf
AUC = np.array(  # Table 6 of J. Demsar, JMLR 7, 2006: C4.5, C4.5+m, C4.5+cf, C4.5+m+cf on 14 data sets
    [
        [0.763, 0.768, 0.771, 0.798],
        [0.599, 0.591, 0.590, 0.569],
        [0.954, 0.971, 0.968, 0.967],
        [0.628, 0.661, 0.654, 0.657],
        [0.882, 0.888, 0.886, 0.898],
        [0.936, 0.931, 0.916, 0.931],
        [0.661, 0.668, 0.609, 0.685],
        [0.583, 0.583, 0.563, 0.625],
        [0.775, 0.838, 0.866, 0.875],
        [1.000, 1.000, 1.000, 1.000],
        [0.940, 0.962, 0.965, 0.962],
        [0.619, 0.666, 0.614, 0.669],
        [0.972, 0.981, 0.978, 0.975],
        [0.957, 0.978, 0.946, 0.970],
    ]
)
NAMES = ("C4.5", "C4.5+m", "C4.5+cf", "C4.5+m+cf")


def test_the_papers_example_of_friedmans_test() -> None:
    found = ranking(NAMES, -AUC)
    assert found.solvers == ("C4.5+m+cf", "C4.5+m", "C4.5+cf", "C4.5")
    np.testing.assert_allclose(found.ranks, [1.964, 2.000, 2.893, 3.143], atol=5e-4)
    assert found.cases == 14
    chi_squared = 12.0 * 14 / (4 * 5) * ((found.ranks**2).sum() - 4 * 5**2 / 4.0)
    assert chi_squared == pytest.approx(9.28, abs=0.01)  # the paper's, which does not correct for ties
    assert 13 * chi_squared / (14 * 3 - chi_squared) == pytest.approx(3.69, abs=0.01)  # its F
    ties = [2, 2, 4, 2]  # sizes of groups of equal values: iris, lung cancer, mushroom, primary tumor
    chi_squared /= 1.0 - sum(size**3 - size for size in ties) / (14 * (4**3 - 4))
    assert found.p == pytest.approx(f_distribution.sf(13 * chi_squared / (14 * 3 - chi_squared), 3, 39), rel=1e-9)


def test_the_papers_example_of_wilcoxons_test() -> None:
    differences = AUC[:, 1] - AUC[:, 0]
    ranks = rankdata(np.abs(differences).round(6))
    zeros = ranks[differences == 0.0].sum() / 2.0
    assert ranks[differences > 0.0].sum() + zeros == 93.0 and ranks[differences < 0.0].sum() + zeros == 12.0
    assert signed_rank(-AUC[:, 0].round(6), -AUC[:, 1].round(6)) < 0.05  # as in the paper: 12 is below 21


@given(st.lists(st.integers(1, 1000), min_size=6, max_size=12, unique=True), st.integers(0, 2**12))
def test_signed_ranks_without_ties_are_scipys(sizes: list[int], signs: int) -> None:
    differences = np.array([size if signs >> bit & 1 else -size for bit, size in enumerate(sizes)], dtype=np.float64)
    expected = float(wilcoxon(differences, method="exact").pvalue)
    assert signed_rank(differences, np.zeros(differences.size)) == pytest.approx(expected)


def test_signed_ranks_with_ties_are_exact() -> None:
    ones = np.ones(8)
    assert signed_rank(ones, np.zeros(8)) == pytest.approx(2.0 / 2**8)  # all of one sign
    mixed = np.array([1.0] * 7 + [-1.0])  # equal sizes: a sign test
    assert signed_rank(mixed, np.zeros(8)) == pytest.approx(binomtest(7, 8).pvalue)
    assert signed_rank(ones, ones) == 1.0


@given(st.lists(st.integers(-3, 3), min_size=2, max_size=9).filter(any))
def test_signed_ranks_with_ties_are_those_of_all_signs(values: list[int]) -> None:
    differences = np.array(values, dtype=np.float64)
    ranks = rankdata(np.abs(differences))
    every = [(ranks * np.sign(differences) * signs).sum() for signs in product((-1, 1), repeat=len(values))]
    observed = abs((ranks * np.sign(differences)).sum())
    expected = np.mean(np.abs(every) >= observed - 1e-9)
    assert signed_rank(differences, np.zeros(differences.size)) == pytest.approx(expected)


def test_many_signed_ranks_are_nearly_normal() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(0.0, 1.0, (2, 200))
    longer = np.r_[a, 0.01], np.r_[b, 0.0]
    assert signed_rank(a + 0.15, b) == pytest.approx(signed_rank(longer[0] + 0.15, longer[1]), abs=0.01)


def test_no_plan_is_worse_than_any() -> None:
    a, b = np.array([1.0, 2.0, 3.0, 4.0, 5.0, INF]), np.array([2.0, 4.5, 9.0, 90.0, 55.0, INF])
    assert signed_rank(a, b) == pytest.approx(signed_rank(np.r_[a[:5], 7.0], np.r_[b[:5], 7.0]))
    c = np.full(6, INF)
    assert signed_rank(a[[0, 1, 2, 3, 4, 0]], c) == pytest.approx(2.0 / 2**6)
    assert signed_rank(c, c) == 1.0


def test_friedman_at_its_ends() -> None:
    assert friedman(np.full((5, 3), INF)) == 1.0
    assert friedman(np.tile([1.0, 2.0, 3.0], (8, 1))) < 1e-6


@pytest.mark.parametrize(("solvers", "cases"), [(2, 6), (3, 7), (4, 8), (5, 9), (6, 10)])
def test_cases_needed(solvers: int, cases: int) -> None:
    """The smallest p is 2 / 2^n; Holm's factor of the smallest is the number of pairs."""
    pairs = solvers * (solvers - 1) // 2
    assert cases_needed(solvers) == cases
    assert pairs * 2.0 / 2**cases < 0.05 <= pairs * 2.0 / 2 ** (cases - 1)


def test_groups_by_hand() -> None:
    def groups(solvers: int, *pairs: tuple[int, int]) -> tuple[tuple[int, int], ...]:
        different = np.zeros((solvers, solvers), dtype=bool)
        for pair in pairs:
            different[pair] = True
        return groups_of(different)

    assert groups(3) == ((0, 2),)
    assert groups(3, (0, 2)) == ((0, 1), (1, 2))
    assert groups(3, (0, 1), (0, 2)) == ((1, 2),)
    assert groups(3, (0, 1), (0, 2), (1, 2)) == ()
    assert groups(4, (0, 3), (1, 3)) == ((0, 2), (2, 3))


def test_clear_differences_are_found_and_small_ones_are_not() -> None:
    clear = random_results(cases=8, solvers=3, runs=1)
    found = ranking(clear.solvers, clear.scores())
    assert found.solvers == ("solver-2", "solver-1", "solver-0")
    assert found.ranks.tolist() == [1.0, 2.0, 3.0] and found.groups == ()
    few = random_results(cases=4, solvers=3, runs=1)
    assert ranking(few.solvers, few.scores()).groups == ((0, 2),)


def test_scores_by_hand() -> None:
    found = results(
        {
            ("x", "a"): final([2.0, 2.0, 2.2]),
            ("x", "b"): final([3.0, 2.0001, None]),
            ("y", "a"): final([None, None, 5.0]),
            ("y", "b"): final([4.0, 4.0, 4.0003]),
        }
    )
    assert found.references == {"x": 2.0, "y": 4.0}
    assert found.scores().tolist() == [[0.0, 0.5], [INF, 0.0]]  # a gap below 0.01 % is none
    np.testing.assert_allclose(found.effect_sizes("y"), [[0.5, 0.0], [1.0, 0.5]])
    np.testing.assert_allclose(found.effect_sizes("x")[0, 1], (2 * (1 + 0.5 + 1) + (1 + 0 + 1)) / 9.0)
