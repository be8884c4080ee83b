"""Numbers of a campaign: summaries, pairs, quantiles and targets by hand; ranks by Demsar and SciPy."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from helpers.comparisons import convergence, final, random_results, results
from helpers.comparisons import record as made
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from scipy.stats import f as f_distribution
from scipy.stats import rankdata, wilcoxon

from tpbso_casadi.judging.figures import gap_curve
from tpbso_casadi.judging.results import Results
from tpbso_casadi.judging.run import RunRecord
from tpbso_casadi.judging.statistics import (
    Relation,
    cases_needed,
    compare_summaries,
    friedman,
    groups_of,
    holm,
    judge,
    p_text,
    pairs_of,
    ranking,
    signed_rank,
    summarise,
    with_ties,
)
from tpbso_casadi.judging.tables import HEADER, print_tables, rows
from tpbso_casadi.judging.targets import (
    PLANS,
    TIE_TOLERANCE,
    VALUES,
    expected_running_time,
    gap,
    quantile,
    shares_reached,
)

INF = np.inf


def record(solver: str, objective: float | None, error: str = "") -> RunRecord:
    return made("case", solver, 1, [] if objective is None else [(10.0, objective)], done=10, error=error)


def test_summaries_by_hand() -> None:
    records = [record("a", 1.0), record("a", 3.0), record("a", None), record("b", 2.0), record("a", None, "E: x")]
    a, b = summarise(records)
    assert (a.solver, a.mean, a.std, a.best, a.infeasible, a.failed) == ("a", 2.0, np.sqrt(2.0), 1.0, 1, 1)
    assert a.median == 3.0
    assert np.isnan(b.std)
    assert b.rank_key < a.rank_key  # one infeasible run weighs more than any mean
    [nothing] = summarise([record("c", None)])
    assert np.isnan(nothing.mean) and nothing.median == np.inf


def test_comparisons_by_hand() -> None:
    a, b = summarise([*(record("a", value) for value in (1, 2, 3)), *(record("b", value) for value in (2, 5, None))])
    pair = compare_summaries(a, b)
    assert pair.a12 == (3 + 2.5 + 2) / 9.0  # of the nine pairs
    assert pair.ahead and pair.p == pytest.approx(0.3) and pair.smallest_p == 0.1  # twice 3 of 20 partitions
    assert compare_summaries(b, a).a12 == pytest.approx(1.0 - pair.a12)
    same = summarise([record("a", 1.0), record("a", 1.00001), record("b", 1.00005), record("b", 1.0)])
    assert compare_summaries(*same).p == 1.0


def searched(solver: str, objectives: Sequence[float | None], seeds: Sequence[int]) -> list[RunRecord]:
    return [
        replace(record(solver, value), search=f"search {seed}") for value, seed in zip(objectives, seeds, strict=True)
    ]


def test_runs_of_the_same_searches_are_compared_pair_by_pair() -> None:
    """Five searches far apart, each a little better after its polish: no rank sum shows that, signed ranks do."""
    before = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    after = [0.9, 1.9, 2.8, 3.7, 4.6, 5.5]
    search, polished = summarise([*searched("s", before, range(6)), *searched("s+polish", after, range(6))])
    pair = compare_summaries(polished, search)
    assert pair.paired and pair.test == "signed rank"
    assert pair.p == pytest.approx(wilcoxon(after, before).pvalue) == pair.smallest_p == 2.0**-5
    assert pair.a12 == 1.0 and compare_summaries(search, polished).a12 == 0.0
    independent = compare_summaries(*(replace(each, searches=()) for each in (polished, search)))
    assert not independent.paired and independent.test == "rank sum" and independent.p > 0.5


def test_pairs_are_of_runs_that_both_have_in_whatever_order() -> None:
    search = summarise([*searched("s", [2.0, 3.0, None], (1, 2, 3)), record("s", None, "E: x")])[0]
    [polished] = summarise(searched("s+polish", [None, 2.5, 9.0, 2.0], (3, 2, 4, 1)))
    assert pairs_of(polished, search) == [(0, 2), (1, 1), (3, 0)]
    pair = compare_summaries(polished, search)  # no plan twice, better, the same: ranks 1.5, 3 and 1.5
    assert (pair.a12, pair.p, pair.smallest_p) == ((1.5 / 2 + 3.0 + 1.5 / 2) / 6.0, 1.0, 0.25)
    alike = compare_summaries(search, search)
    assert (alike.paired, alike.a12, alike.p) == (True, 0.5, 1.0)


def test_expected_running_times_by_hand() -> None:
    needed, done = np.array([100.0, INF, 300.0]), np.array([1000.0, 500.0, 1000.0])
    assert expected_running_time(needed, done) == (100.0 + 500.0 + 300.0) / 2.0
    assert expected_running_time(np.array([INF]), np.array([10.0])) == INF
    steps = [[(10.0, 2.0), (40.0, 1.005)], [(10.0, 1.0)], [(10.0, 1.02)], []]  # 1 % of the best is 1.01
    found = results({("x", "a"): steps, ("x", "b"): final([5.0])}, done=100)
    a, b = found.summaries
    assert (a.expected_running_time, b.expected_running_time) == ((40.0 + 10.0 + 100.0 + 100.0) / 2.0, INF)
    table = [dict(zip(HEADER, row, strict=True)) for row in rows(found.summaries)]
    assert [row["expected_running_time"] for row in table] == [125.0, None]
    assert [row["test"] for row in table] == [None, "rank sum"]
    assert np.isnan(summarise([record("c", 1.0)])[0].expected_running_time)


def test_what_a_family_of_comparisons_shows() -> None:
    low, high, same = (
        [record(name, start + seed / 100.0) for seed in range(10)]
        for name, start in (("low", 1.0), ("high", 2.0), ("same", 1.0))
    )
    first, second, third = summarise([*low, *high, *same])
    pairs = [compare_summaries(first, second), compare_summaries(second, first), compare_summaries(first, third)]
    judged = judge(pairs)
    assert [one.relation for one in judged] == [Relation.BETTER, Relation.WORSE, Relation.NOT_SHOWN]
    assert [str(one.relation) for one in judged] == ["better", "worse", "no difference shown"]
    assert [p_text(one.p) for one in judged] == ["< 0.001", "< 0.001", "1.000"]


@pytest.mark.parametrize(("runs", "relation"), [(3, Relation.NOT_JUDGED), (4, Relation.BETTER)])
def test_three_runs_show_nothing_not_even_with_ties(runs: int, relation: Relation) -> None:
    """2 / C(6, 3) = 0.1, 2 / C(8, 4) = 0.029: the approximation for large samples gives 0.05 and less."""
    a, b = summarise([record(name, value) for name, value in (("a", 1.0), ("b", 2.0)) for _ in range(runs)])
    pair = compare_summaries(a, b)
    assert pair.p == pytest.approx(pair.smallest_p)
    [one] = judge([pair])
    assert one.relation is relation


def test_a_table_fits_80_columns_whatever_the_labels(capsys: pytest.CaptureFixture[str]) -> None:
    labels = ("bso", "bso(lambda_=0.4,antenna_sign=printed)+polish12", "pso+polish", "bso(printed,lambda_=0.4)")
    records = [
        replace(record(label, 123456.7 + 0.001 * index), evaluations=1_000_000, seconds=1234.5, search=f"{index}")
        for index, label in enumerate(labels)
        for seed in range(20)
    ]
    for columns in (80, 20):
        timed = [replace(each, expected_running_time=7_654_321.0) for each in summarise(records)]
        print_tables(timed, Console(file=sys.stdout, width=columns))
        text = capsys.readouterr().out
        lines = text.splitlines()
        assert max(map(len, lines)) <= 80
        numbers = ("1.2346e+05", "1000000", "7654321", "1234.50", "20 of 20")
        assert [text.count(number) for number in numbers] == [4] * 5
        for part in ("lambda_=0.4", "antenna_sign=printed", "+polish12", "no difference shown", "against bso"):
            assert any(part in line for line in lines), part
        assert "…" not in text


def test_objectives_near_the_best_count_as_equal() -> None:
    a, b = with_ties(np.array([1.0, 1.00009, 1.2]), np.array([1.00005, np.inf]))
    assert a.tolist() == [1.0, 1.0, 1.2] and b.tolist() == [1.0, np.inf]


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03, 0.5]) == pytest.approx([0.04, 0.09, 0.09, 0.5])
    assert holm([]) == []


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=9), st.floats(0.0, 1.0))
def test_finite_quantiles_are_numpys(values: list[float], share: float) -> None:
    assert quantile(np.array(values), share) == pytest.approx(np.quantile(values, share), rel=1e-9, abs=1e-6)


def test_what_has_no_plan_comes_last() -> None:
    columns = np.array([[INF, 1.0], [3.0, INF], [1.0, INF], [2.0, INF]])  # sorted 1, 2, 3, inf and 1, inf, inf, inf
    assert quantile(columns, 0.5).tolist() == [2.5, INF]
    assert quantile(columns, 0.25).tolist() == [1.75, INF]
    assert quantile(columns, 0.75).tolist() == [INF, INF]
    assert quantile(columns, 2.0 / 3.0).tolist() == [3.0, INF]  # exactly the third


def test_gaps_by_hand() -> None:
    assert gap(np.array([2.0, 3.0, INF]), 2.0).tolist() == [0.0, 0.5, INF]
    assert gap(np.array([-3.0]), -4.0).tolist() == [0.25]
    assert gap(np.array([0.5]), 0.0).tolist() == [0.5]  # absolute


def test_the_table_has_quartiles_and_gaps() -> None:
    found = results({("x", "a"): final([1.0, 2.0, 3.0, None]), ("x", "b"): final([4.0, None, None, None])})
    a, b = (dict(zip(HEADER, row, strict=True)) for row in rows(found.summaries))
    assert [a[key] for key in ("median", "lower_quartile", "upper_quartile", "median_gap")] == [2.5, 1.75, None, 1.5]
    assert [b[key] for key in ("median", "lower_quartile", "upper_quartile", "median_gap")] == [None] * 4
    [nothing] = rows(summarise([made("x", "a", 1, [], error="ValueError: no")]))
    assert nothing[-3:] == [None] * 3


def test_targets_are_those_that_are_said() -> None:
    assert (PLANS.span, VALUES.span) == ("1000 % to 0.01 %", "100 to 1e-08")
    assert len(PLANS.targets) == len(VALUES.targets) == 51
    assert np.isclose(PLANS.targets[-1], TIE_TOLERANCE)
    np.testing.assert_allclose(PLANS.targets[:-1] / PLANS.targets[1:], 10.0**0.1)
    np.testing.assert_allclose(VALUES.targets[:-1] / VALUES.targets[1:], 10.0**0.2)


def test_gaps_in_words() -> None:
    gaps = (0.0, 1e-9, 0.012345, INF)
    assert [PLANS.shown(gap) for gap in gaps] == ["0 %", "< 0.01 %", "1.23 %", "-"]
    assert [VALUES.shown(gap) for gap in gaps] == ["0", "< 1e-08", "0.0123", "-"]


def test_gaps_of_values_are_absolute_and_measured_from_the_known_minimum() -> None:
    runs = results({("f", "a"): final([0.5, 2.0, None]), ("f", "b"): final([1e-9, 1e-12, 1e-10])})
    found = Results(runs.records, runs.convergences, VALUES)
    assert found.references == {"f": 0.0}
    assert found.scores().tolist() == [[2.0, 0.0]]  # below 1e-8 all is reached
    assert found.effect_sizes("f").tolist() == [[0.5, 0.0], [1.0, 0.5]]
    for runs_of_b in found.runs_of("b"):
        assert np.isfinite(found.needed(runs_of_b)).all()
    several = results({("f", "a"): final([1e-9] * 5), ("f", "b"): final([1e-15] * 5)})
    assert compare_summaries(*Results(several.records, several.convergences, VALUES).summaries).a12 == 0.5
    assert compare_summaries(*several.summaries).a12 == 0.0
    nothing = results({("f", "a"): final([None])})
    assert Results(nothing.records, nothing.convergences, VALUES).references == {"f": None}


def test_evaluations_needed_by_hand() -> None:
    run = convergence([(5, 3.0), (20, 1.5), (40, 1.0)])
    targets = np.array([5.0, 2.0, 1.0, 0.5, 0.1, 0.0])  # gaps of the run: 2, 0.5, 0
    assert run.needed(1.0, targets).tolist() == [5.0, 5.0, 20.0, 20.0, 40.0, 40.0]
    assert run.needed(0.5, targets).tolist() == [5.0, 20.0, 40.0, INF, INF, INF]
    assert convergence([]).needed(1.0, targets).tolist() == [INF] * 6
    assert convergence([]).needed(None, targets).tolist() == [INF] * 6


def test_shares_by_hand() -> None:
    evaluations, shares = shares_reached([np.array([5.0, 20.0]), np.array([5.0, INF])])
    assert evaluations.tolist() == [5.0, 20.0] and shares.tolist() == [0.5, 0.75]
    assert [part.tolist() for part in shares_reached([np.array([INF])])] == [[], []]


def test_a_curve_of_gaps_counts_runs_without_a_plan_as_the_worst() -> None:
    steps = [[(10.0, 3.0), (50.0, 2.0)], [(20.0, 2.0)], [(20.0, 4.0)], []]
    found = results({("x", "a"): steps, ("x", "b"): final([2.0, 2.0, 2.0])})
    curve = gap_curve(found, "x", "a")
    assert curve.end == 100 and curve.evaluations[[0, -1]].tolist() == [1.0, 100.0]
    lower, median, upper = curve.quartiles
    before, early, last = (curve.evaluations.searchsorted(number) for number in (9.0, 15.0, 99.0))
    assert (lower[before], median[before]) == (INF, INF)
    assert (lower[early], median[early]) == (INF, INF)  # one of four
    assert lower[last] == 0.0 and median[last] == 0.5 and upper[last] == INF  # gaps 0, 0, 1, inf
    few = gap_curve(found, "x", "b")
    assert (few.quartiles == few.quartiles[1]).all()


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


@given(st.lists(st.integers(1, 1000), min_size=6, max_size=12, unique=True), st.integers(0, 2**12))
def test_signed_ranks_without_ties_are_scipys(sizes: list[int], signs: int) -> None:
    differences = np.array([size if signs >> bit & 1 else -size for bit, size in enumerate(sizes)], dtype=np.float64)
    expected = float(wilcoxon(differences, method="exact").pvalue)
    assert signed_rank(differences, np.zeros(differences.size)) == pytest.approx(expected)


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
