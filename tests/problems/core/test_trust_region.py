"""Descents in a trust region, step by step by hand: sizes, what is accepted, when a descent ends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from problems.core import Step, TrustRegion

REGION = TrustRegion(
    first=1.0, least=0.1, largest=3.0, growth=2.0, shrinkage=0.5, rejection=0.25, good=0.6, poor=0.2,
    patience=2, least_gain=0.01, least_promise=0.001,
)  # fmt: skip
UNSOLVED = None


@dataclass(frozen=True)
class Point:
    merit: float


@pytest.mark.parametrize(
    ("steps", "sizes", "merit"),
    [
        ([(10.0, 10.0), (10.0, 20.0), (7.0, 10.0), (2.0, 5.0)], [1.0, 2.0, 2.0, 3.0], 71.0),  # programs run out
        ([(10.0, 100.0), (10.0, 5.0), (-9.0, 9.0), (2.0, 2.0)], [1.0, 0.5, 1.0, 0.25], 78.0),
        ([(-5.0, 9.0), UNSOLVED], [1.0, 0.25], 100.0),  # too small
        ([(0.5, 2.0), (-0.5, 2.0)], [1.0, 1.0], 99.5),  # idle
        ([(0.5, 2.0), (-5.0, 2.0), (0.5, 0.5)], [1.0, 1.0, 0.25], 99.0),  # a loss ends no row of idle programs
        ([(0.5, 2.0), (5.0, 5.0), (0.5, 2.0), (5.0, 5.0)], [1.0, 1.0, 2.0, 2.0], 89.0),  # a gain does
        ([(0.05, 0.05)], [1.0], 99.95),  # promises nothing
    ],
)
def test_steps_by_hand(steps: list[tuple[float, float] | None], sizes: list[float], merit: float) -> None:
    """Steps are gains with what was promised, from a merit of 100."""
    seen, left = list[float](), iter(steps)

    def step(around: Point, size: float) -> Step[Point] | None:
        seen.append(size)
        taken = next(left)
        return None if taken is None else Step(Point(around.merit - taken[0]), taken[1])

    assert REGION.descent(Point(100.0), 4, step).merit == pytest.approx(merit, abs=1e-12)
    assert seen == sizes


def test_a_motion_that_is_good_enough_ends_the_descent() -> None:
    numbers = []

    def is_done(point: Point, number: int) -> bool:
        numbers.append(number)
        return point.merit < 85.0

    found = REGION.descent(Point(100.0), 9, lambda around, _: Step(Point(around.merit - 10.0), 10.0), is_done)
    assert (found, numbers) == (Point(80.0), [0, 1, 2])


def test_where_no_promise_ends_a_descent_a_program_may_promise_a_loss() -> None:
    region = replace(REGION, least_promise=float("-inf"), good=0.0)
    assert region.descent(Point(100.0), 3, lambda around, _: Step(Point(around.merit - 5.0), -1.0)).merit == 85.0
