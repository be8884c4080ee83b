"""Fronts and where points are placed on them, on problems whose fronts are known; scenarios of their points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tpbso_casadi as tp
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import overridden, parse_scenario
from tpbso_casadi.trade_off import ENDS, Objectives, Point, Standing
from tpbso_casadi.trade_off.front import Pair, PointFront, Request, Scalarisation, hypervolume, reference_point
from tpbso_casadi.trade_off.placement import EpsilonConstraint, Placement, WeightedSums

POOR = 2.5015  # s, the bound of a plan that comes out poor
COORDINATES = st.tuples(st.integers(0, 20), st.integers(0, 20))


def point(number: int, values: Pair, certified: bool = True, request: Request | None = None) -> Point:
    """A point whose first objective is its duration."""
    counted = {"seed": 1, "evaluations": 100, "seconds": 1.0, "folder": f"points/{number}"}
    return Point(number=number, request=request, values=values, duration=values[0], certified=certified, **counted)  # type: ignore[arg-type]


def placed(placement: Placement, solve: Callable[[Request], Pair]) -> list[Point]:
    """All the points of a placement."""
    points: list[Point] = []
    while (request := placement.next(points)) is not None:
        points.append(point(len(points) + 1, solve(request), request=request))
        assert len(points) < 100
    return points


def test_what_a_point_is_beside_the_others() -> None:
    values = [(1.0, 5.0), (2.0, 3.0), (2.0, 4.0), (1.0, 5.0), (4.0, 1.0), (0.5, 0.5)]
    points = [point(n, v, certified=n != 6) for n, v in enumerate(values, start=1)]
    front = PointFront.of(points)
    assert [p.number for p in front.points] == [1, 2, 5]
    expected = ["front", "front", "dominated", "repeated", "front", "not certified"]
    assert [str(front.standings[p.number]) for p in points] == expected


@given(st.lists(COORDINATES, max_size=30))
def test_nothing_dominates_a_front_and_it_dominates_all_else(values: list[tuple[int, int]]) -> None:
    points = [point(n, (float(a), float(b))) for n, (a, b) in enumerate(values, start=1)]
    front = PointFront.of(points).values
    no_worse = [(front <= p.values).all(axis=1) for p in points]
    assert all(each.any() for each in no_worse)
    for values_on_front in front:
        assert (front <= values_on_front).all(axis=1).sum() == 1


def test_hypervolume_by_hand() -> None:
    values = np.array([[1.0, 3.0], [2.0, 1.0], [5.0, 0.0], [2.5, 2.5]])
    assert hypervolume(values, (4.0, 4.0)) == 1.0 * 1.0 + 2.0 * 3.0  # (1..2) x (3..4), (2..4) x (1..4); 5 is outside
    assert reference_point(np.array([[1.0, 3.0], [2.0, 1.0]])) == pytest.approx((2.1, 3.2))


@given(st.lists(COORDINATES, min_size=1, max_size=12))
def test_hypervolume_counts_cells(values: list[tuple[int, int]]) -> None:
    cells = {(i, j) for a, b in values for i in range(a, 21) for j in range(b, 21)}
    assert hypervolume(np.array(values, dtype=float), (21.0, 21.0)) == len(cells)


def bounded(request: Request) -> Pair:
    """A front 1 / T^3 from T = 1 to 4."""
    asked = request.scalarisation
    duration = 1.0 if asked.weights == ENDS[0] else min(4.0, asked.longest or 4.0)
    return duration, duration**-3


def weighted(request: Request) -> Pair:
    """The front (x, 1 / x), x from 1/4 to 4."""
    first, second = request.scalarisation.weights
    x = float(np.clip(np.sqrt(second / first) if first else 4.0, 0.25, 4.0))
    return x, 1.0 / x


def test_near_the_ends_the_other_objective_counts_a_little() -> None:
    points = placed(WeightedSums(2), weighted)
    asked = [p.request.scalarisation.weights for p in points if p.request]
    assert asked == [*ENDS, (1.0, 1e-3), (1.0, 1e3)]
    points = placed(EpsilonConstraint(2, 0), bounded)
    requests = [p.request for p in points if p.request]
    assert [r.scalarisation.longest for r in requests] == [None, None, 1.003, None]
    assert requests[3].scalarisation.weights[1] == pytest.approx(3.0 / (1.0 - 4.0**-3) / 1e-3)
    assert [r.starts for r in requests] == [(), (), (1,), (2,)]


@pytest.mark.parametrize(("placement", "solve"), [(EpsilonConstraint(12, 0), bounded), (WeightedSums(12), weighted)])
def test_points_are_spread(placement: Placement, solve: Callable[[Request], Pair]) -> None:
    points = placed(placement, solve)
    front = PointFront.of(points)
    assert len(points) == 14 and len(front.points) >= 12
    scale = np.ptp(front.values, axis=0)
    gaps = np.hypot(*(np.diff(front.values, axis=0) / scale).T)
    assert gaps.max() < 2.5 * gaps.mean()


def test_a_line_has_no_point_between_its_ends_for_weighted_sums() -> None:
    def solve(request: Request) -> Pair:
        first, second = request.scalarisation.weights
        return (0.0, 1.0) if first >= second else (1.0, 0.0)

    points = placed(WeightedSums(12), solve)
    assert [p.request.scalarisation.weights for p in points if p.request][4:] == [(1.0, 1.0)]
    assert PointFront.of(points).standings[5] is Standing.REPEATED


def test_what_is_not_the_best_known_answer_is_tried_once_more_from_its_neighbours() -> None:
    def solve(request: Request) -> Pair:
        duration, other = bounded(request)
        poor = request.scalarisation.longest == POOR and request.attempt == 0
        return duration, other + 5.0 * poor

    points = placed(EpsilonConstraint(5, 0), solve)
    first, again = (p for p in points if p.request and p.request.scalarisation.longest == POOR)
    assert len(points) == 8
    front = PointFront.of(points)
    assert front.standings[first.number] is Standing.DOMINATED and front.standings[again.number] is Standing.FRONT
    assert again.request is not None
    kept, left = (points[number - 1].duration for number in again.request.starts)
    assert kept <= POOR < left


def test_a_failure_is_tried_once_more_and_then_left() -> None:
    placement = EpsilonConstraint(3, 0)
    points: list[Point] = []
    while (request := placement.next(points)) is not None:
        values = bounded(request)
        certified = values[0] < 1.1 or values[0] > 3.9
        points.append(point(len(points) + 1, values, certified, request))
    attempts = [(p.request.attempt, p.request.starts) for p in points if p.request and not p.certified]
    assert attempts == [(0, (3, 2)), (1, (3, 2))]


def test_an_end_that_another_plan_equals_in_its_own_objective_is_left() -> None:
    def solve(request: Request) -> Pair:
        first, second = request.scalarisation.weights
        return (request.scalarisation.longest or (1.003 if first else 4.0), 2.0) if second else (1.0, 3.0)

    points = placed(EpsilonConstraint(3, 0), solve)
    assert len(points) == 5
    assert PointFront.of(points).standings[2] is Standing.DOMINATED


def test_either_objective_may_be_the_duration() -> None:
    def solve(request: Request) -> Pair:
        mirrored = Scalarisation(request.scalarisation.weights[::-1], request.scalarisation.longest)
        return bounded(Request(scalarisation=mirrored))[::-1]

    points, mirrored = placed(EpsilonConstraint(6, 0), bounded), placed(EpsilonConstraint(6, 1), solve)
    assert {p.values for p in points} == {p.values[::-1] for p in mirrored}


PLACED = (*ENDS, (1.0, 0.5))


@pytest.mark.parametrize(
    ("objectives", "stated", "anew"),
    [
        (("time", "length"), {}, True),  # the shortest path leaves its time free
        (("rotation", "time"), {}, True),
        (("rotation", "length"), {}, True),
        (("time", "length"), {"retime": False}, False),
        (("time", "length"), {"motion": "spline"}, True),
        (("time", "length"), {"motion": "time-spline"}, False),
    ],
)
def test_points_of_a_front_are_timed_alike(objectives: tuple[str, str], stated: dict[str, Any], anew: bool) -> None:
    content = tp.builtin("time-2").table()
    content["model"] = stated
    if "motion" in stated:
        content["task"]["elbow"] = "free"
    front = Objectives(parse_scenario(content), objectives)
    asked = [front.asked_for(Request(scalarisation=Scalarisation(weights))) for weights in PLACED]
    assert [scenario.model.retime for scenario in asked] == [anew] * len(PLACED)


def test_the_plan_for_the_least_time_of_the_papers_motions_is_the_fastest() -> None:
    scenario = overridden(tp.builtin("time-2"), solver={"evaluations": 60})
    front = Objectives(scenario, ("time", "length"))
    fastest, shortest = (plan(front.asked_for(Request(scalarisation=Scalarisation(end)))).motion for end in ENDS)
    assert fastest.feasible and shortest.feasible
    assert fastest.trajectory.duration < shortest.trajectory.duration
