"""Targets reached, by hand."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.comparisons import convergence, final, results
from hypothesis import given
from hypothesis import strategies as st

from tpbso_casadi.campaign import Results, compare_summaries
from tpbso_casadi.campaign.measures import PLANS, TIE_TOLERANCE, VALUES
from tpbso_casadi.campaign.results import evaluations_needed, gap_curve, shares_reached

INF = np.inf


def test_targets_are_those_that_are_said() -> None:
    assert (PLANS.span, VALUES.span) == ("1000 % to 0.01 %", "100 to 1e-08")
    assert len(PLANS.targets) == len(VALUES.targets) == 51
    assert np.isclose(PLANS.targets[-1], TIE_TOLERANCE)
    np.testing.assert_allclose(PLANS.targets[:-1] / PLANS.targets[1:], 10.0**0.1)
    np.testing.assert_allclose(VALUES.targets[:-1] / VALUES.targets[1:], 10.0**0.2)


@pytest.mark.parametrize(
    ("gap", "of_plan", "of_value"),
    [
        (0.0, "0 %", "0"),
        (1e-9, "< 0.01 %", "< 1e-08"),
        (0.012345, "1.23 %", "0.0123"),
        (INF, "-", "-"),
    ],
)
def test_gaps_in_words(gap: float, of_plan: str, of_value: str) -> None:
    assert (PLANS.shown(gap), VALUES.shown(gap)) == (of_plan, of_value)


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
    assert evaluations_needed(run, 1.0, targets).tolist() == [5.0, 5.0, 20.0, 20.0, 40.0, 40.0]
    assert evaluations_needed(run, 0.5, targets).tolist() == [5.0, 20.0, 40.0, INF, INF, INF]
    assert evaluations_needed(convergence([]), 1.0, targets).tolist() == [INF] * 6
    assert evaluations_needed(convergence([]), None, targets).tolist() == [INF] * 6


def test_shares_by_hand() -> None:
    evaluations, shares = shares_reached([np.array([5.0, 20.0]), np.array([5.0, INF])])
    assert evaluations.tolist() == [5.0, 20.0] and shares.tolist() == [0.5, 0.75]
    assert [part.tolist() for part in shares_reached([np.array([INF])])] == [[], []]


STEPS = st.lists(st.tuples(st.integers(1, 99), st.floats(1.0, 50.0)), max_size=6)


@given(STEPS)
def test_needed_agrees_with_the_convergence_itself(steps: list[tuple[int, float]]) -> None:
    evaluations = sorted({number for number, _ in steps})
    objectives = sorted({value for _, value in steps}, reverse=True)
    run = convergence(list(zip(evaluations, objectives, strict=False)))
    everywhere = np.arange(1.0, 101.0)
    gaps = run.at(everywhere) - 1.0
    for target, needed in zip(PLANS.targets, evaluations_needed(run, 1.0, PLANS.targets), strict=True):
        reached = everywhere[gaps <= target * (1.0 + 1e-12)]
        assert needed == (reached[0] if reached.size else INF)


def test_a_curve_of_gaps_counts_runs_without_a_plan_as_the_worst() -> None:
    steps = [[(10.0, 3.0), (50.0, 2.0)], [(20.0, 2.0)], [(20.0, 4.0)], []]
    found = results({("x", "a"): steps, ("x", "b"): final([2.0, 2.0, 2.0])})
    curve = gap_curve(found, "x", "a")
    assert curve.end == 100 and curve.evaluations[[0, -1]].tolist() == [1.0, 100.0]
    before, early, last = (curve.evaluations.searchsorted(number) for number in (9.0, 15.0, 99.0))
    assert (curve.lower[before], curve.median[before]) == (INF, INF)
    assert (curve.lower[early], curve.median[early]) == (INF, INF)  # one of four
    assert curve.lower[last] == 0.0 and curve.median[last] == 0.5 and curve.upper[last] == INF  # gaps 0, 0, 1, inf
    few = gap_curve(found, "x", "b")
    assert (few.lower == few.median).all() and (few.upper == few.median).all()
