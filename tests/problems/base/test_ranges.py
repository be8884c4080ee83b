"""Numbers that cannot be computed with: one line names the field; what is accepted gives finite costs."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import following, moving
from hypothesis import given
from hypothesis import strategies as st

from problems import Ellipse, InvalidProblem, Path, PathFollowing, PlanarArm, closed_curve, pentagram
from problems.base import ANGLES, COORDINATES, LENGTHS, RATES, TIMES, check_within, largest
from problems.evaluation import EvaluationOptions
from solvers import SearchBox

EXTREME: list[Any] = [1e308, 5e-324, -1e308, float("inf"), float("nan"), 10**400, 10**5000, -(10**5000), 0.0]
ARM = PlanarArm((0.7, 0.6, 0.7), (4.0,) * 3, (20.0,) * 3)
STAR = pentagram((0.0, 0.0), 0.9)
pytestmark = pytest.mark.filterwarnings("error")


def test_what_no_arm_has() -> None:
    for value in EXTREME:
        for field in ("link_lengths", "max_speed", "max_acceleration"):
            numbers = {"link_lengths": (1.0, 1.0), "max_speed": (4.0, 4.0), "max_acceleration": (20.0, 20.0)}
            with pytest.raises(InvalidProblem) as error:
                PlanarArm(**{**numbers, field: (1.0, value)})
            assert error.value.field == field
            assert len(str(error.value)) < 200
    for value in EXTREME[:-1]:
        if value != 5e-324:
            with pytest.raises(InvalidProblem, match=r"^joint_limits: "):
                PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0), ((-1.0, 1.0), (-1.0, value)))


def test_an_arm_has_so_many_links_and_none_that_is_nothing_beside_another() -> None:
    assert PlanarArm((0.01,) * 100, (1.0,) * 100, (1.0,) * 100).dof == 100
    with pytest.raises(InvalidProblem, match=r"^link_lengths: 101 links are more than 100$"):
        PlanarArm((0.01,) * 101, (1.0,) * 101, (1.0,) * 101)
    with pytest.raises(InvalidProblem, match=r"^link_lengths: the shortest link"):
        PlanarArm((1e3, 1e-4), (1.0, 1.0), (1.0, 1.0))


ATTEMPTS: dict[str, Callable[[Any], object]] = {
    "center": lambda value: Ellipse((1.0, value), (1.0, 1.0)),
    "angle": lambda value: Ellipse((1.0, 1.0), (1.0, 1.0), value),
    "start": lambda value: moving(ARM, (value, 0.0), (0.5, 1.5)),
    "points": lambda value: Path(((0.0, 1.0), (1.0, value))),
    "semi_axes": lambda value: Ellipse((1.0, 1.0), (1.0, value)),
    "segment_time": lambda value: moving(ARM, (1.0, 0.0), (0.5, 1.5), segment_time=(value, 1.0)),
    "total_time": lambda value: following(ARM, STAR, 0.1, total_time=(0.1, value)),
    "accuracy": lambda value: PathFollowing(ARM, STAR, value),
}


def test_what_no_obstacle_or_task_has() -> None:
    for value, (field, attempt) in product(EXTREME, ATTEMPTS.items()):
        if value in {5e-324, 0.0} and field in {"center", "angle", "start", "points"}:
            continue
        with pytest.raises(InvalidProblem) as error:
            attempt(value)
        assert error.value.field == field
        assert len(str(error.value)) < 200


def test_a_path_has_so_many_points() -> None:
    with pytest.raises(InvalidProblem, match=r"^count: more than 2000 points$"):
        pentagram((0.0, 0.0), 0.9, count=10**9)
    with pytest.raises(InvalidProblem, match=r"^count: more than 2000 points$"):
        closed_curve((0.0, 0.0), 0.9, 0.0, 3, 0.1, 10**5000)
    many = Path(tuple((1.0, 1e-4 * i) for i in range(2001)))
    with pytest.raises(InvalidProblem, match=r"^points: more than 2000 points$"):
        PathFollowing(ARM, many, 0.1)
    assert len(many.resampled(50).points) == 50


@pytest.mark.parametrize(
    ("length", "rate", "formulation"),
    [
        (3.0 * LENGTHS[0], RATES[0], "paper"),
        (3.0 * LENGTHS[0], RATES[1], "reduced"),
        (LENGTHS[1] / 3.0, RATES[0], "reduced"),
        (LENGTHS[1] / 3.0, RATES[1], "paper"),
    ],
)
def test_at_the_ends_of_the_ranges_costs_are_numbers(length: float, rate: float, formulation: str) -> None:
    arm = PlanarArm((length,) * 3, (rate,) * 3, (rate,) * 3, ((ANGLES[0], ANGLES[1]),) * 3)
    oval = Ellipse((length, length), (LENGTHS[0], max(LENGTHS[0], 0.1 * length)))
    start, goal = (length, 0.0), (0.5 * length, 1.5 * length)
    move = moving(arm, start, goal, "length", "free", formulation, obstacles=(oval,), segment_time=TIMES)
    path = Path(tuple((x * length, y * length) for x, y in pentagram((0.0, 0.0), 0.9, count=21).points))
    for problem in (move, following(arm, path, 0.1 * length, "time", "up", formulation, total_time=TIMES)):
        points = SearchBox(*problem.bounds).sample(np.random.default_rng(0), 5)
        assert np.isfinite(problem.evaluator(EvaluationOptions("vm"))(points)).all()
    assert COORDINATES[1] >= LENGTHS[1]


def test_a_number_just_outside_is_told_from_its_bound() -> None:
    with pytest.raises(InvalidProblem, match=r"3\.0000001 is not within -3 and 3 m"):
        check_within("size", (3.0000001,), (-3.0, 3.0), "m")


@given(st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=40), st.integers(1, 3))
def test_largest(values: list[float], columns: int) -> None:
    matrix = np.array(values * columns).reshape(-1, columns)
    assert float(largest(ca.DM(matrix))) == matrix.max()
