"""Statements and their symbolic copies: which numbers become arguments, and what formulas make of them."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from hypothesis import given
from hypothesis import strategies as st

from problems import Ball, Ellipse, PlanarArm, Polygon
from problems.base import Arguments, Parametric, Reading, as_array
from problems.limits import limits_of
from problems.limits.joint_limits import AccelerationLimit, SpeedLimit


@dataclass(frozen=True)
class Inner(Parametric):
    numbers: ClassVar[tuple[str, ...]] = ("length", "ranges", "turn")
    zero_is_structure: ClassVar[tuple[str, ...]] = ("turn",)

    length: float
    ranges: tuple[tuple[float, float], ...] | None = None
    turn: float = 0.0
    name: str = "inner"


@dataclass(frozen=True)
class Outer(Parametric):
    numbers: ClassVar[tuple[str, ...]] = ("place", "weight")

    place: tuple[float, ...]
    weight: float
    parts: tuple[Inner, ...]
    twice: Inner
    count: int = 3

    def formula(self) -> Any:
        """Of its own numbers and those of its parts."""
        sizes = sum(part.length * self.count for part in self.parts)
        return self.place[0] * self.place[1] + self.weight**2 * sizes + self.twice.length


def check_formula(outer: Outer) -> None:
    arguments = Arguments()
    expression = arguments.symbolic_copy(outer).formula()
    evaluate = ca.Function("f", [arguments.symbols], [expression])
    assert float(evaluate(arguments.values)) == pytest.approx(float(outer.formula()), rel=1e-12)


def test_values_are_in_the_order_of_the_fields() -> None:
    first, second = Inner(1.0, ((2.0, 3.0), (4.0, 5.0)), 6.0), Inner(7.0)
    outer = Outer((8.0, 9.0), 10.0, (first, second), first)
    arguments = Arguments()
    symbolic_copy = arguments.symbolic_copy(outer)
    assert arguments.values.tolist() == [8.0, 9.0, 10.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    assert arguments.symbols.shape == (10, 1)
    assert [str(symbol) for symbol in (*symbolic_copy.place, symbolic_copy.weight, symbolic_copy.parts[0].turn)] == [
        "p0",
        "p1",
        "p2",
        "p8",
    ]
    check_formula(outer)


def test_what_occurs_twice_has_one_twin() -> None:
    shared, arguments = Inner(1.0), Arguments()
    outer = Outer((1.0, 2.0), 3.0, (shared, Inner(1.0)), shared)
    symbolic_copy = arguments.symbolic_copy(outer)
    assert symbolic_copy.parts[0] is symbolic_copy.twice
    assert symbolic_copy.parts[1] is not symbolic_copy.twice
    assert arguments.symbolic_copy(shared) is symbolic_copy.twice
    assert arguments.symbolic_copy(outer) is symbolic_copy
    assert arguments.values.size == 5
    assert arguments.symbolic_copy((shared, shared))[0] is symbolic_copy.twice


def test_none_and_what_is_no_number_stay() -> None:
    arguments = Arguments()
    symbolic_copy = arguments.symbolic_copy(Inner(1.0, None, 0.0, "name"))
    assert (symbolic_copy.ranges, symbolic_copy.name) == (None, "name")
    assert type(symbolic_copy) is Inner
    assert arguments.values.tolist() == [1.0]
    assert arguments.symbol(None) is None
    assert arguments.symbolic_copy(5.0) == 5.0
    assert arguments.symbolic_copy("word") == "word"


def test_a_zero_may_be_structure() -> None:
    for turn, values in ((0.0, [1.0]), (-0.0, [1.0]), (0.5, [1.0, 0.5])):
        arguments = Arguments()
        symbolic_copy = arguments.symbolic_copy(Inner(1.0, turn=turn))
        assert arguments.values.tolist() == values
        assert isinstance(symbolic_copy.turn, float) == (turn == 0.0)
    arguments = Arguments()
    arguments.symbolic_copy(Inner(0.0))
    assert arguments.values.tolist() == [0.0]  # only where the statement says so


ARM = equal_links(3, margin=0.01)
STATEMENTS = {
    "inner": Inner(1.0, ((1.0, 2.0), (3.0, 4.0)), 0.5),
    "outer": Outer((1.0, 2.0), 3.0, (Inner(1.0), Inner(2.0, turn=0.1)), Inner(5.0)),
    "robot": ARM,
    "limits": limits_of(ARM, (Ellipse((1.5, 1.5), (0.1, 0.2)), Ellipse((-1.5, 1.5), (0.1, 0.2)))),
    "nothing": None,
}


@pytest.mark.parametrize("statement", STATEMENTS.values(), ids=STATEMENTS)
def test_a_reading_has_the_numbers_of_the_twin(statement: object) -> None:
    arguments = Arguments()
    arguments.symbolic_copy((statement, statement))
    assert Reading((statement, statement)).values.tolist() == arguments.values.tolist()


def test_a_make_is_all_but_the_numbers() -> None:
    make = Reading(Inner(1.0, ((1.0, 2.0),), 0.5, "a")).structure_key
    assert make == Reading(Inner(9.0, ((7.0, 8.0),), -3.0, "a")).structure_key
    others = [
        Inner(1.0, ((1.0, 2.0),), 0.5, "b"),
        Inner(1.0, ((1.0, 2.0),), 0.0, "a"),
        Inner(1.0, ((1.0, 2.0), (1.0, 2.0)), 0.5, "a"),
        Inner(1.0, None, 0.5, "a"),
        Outer((1.0,), 2.0, (), Inner(1.0)),
    ]
    assert all(Reading(other).structure_key != make for other in others)


def test_a_make_knows_what_occurs_twice() -> None:
    one, other = Inner(1.0), Inner(1.0)
    assert Reading((one, one)).structure_key == Reading((other, other)).structure_key
    assert Reading((one, one)).structure_key != Reading((one, other)).structure_key
    assert Reading((one, one)).values.tolist() == [1.0]


def test_nothing_to_say() -> None:
    arguments = Arguments()
    assert arguments.symbols.shape == (0, 1)
    assert arguments.values.shape == (0,)


def test_the_statement_itself_stays_as_it_is() -> None:
    arm = equal_links(3)
    symbolic_copy = Arguments().symbolic_copy(arm)
    assert arm == equal_links(3)
    assert isinstance(symbolic_copy, PlanarArm)
    assert symbolic_copy.links == 3
    assert all(isinstance(length, ca.SX) for length in symbolic_copy.link_lengths)


@given(st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4))
def test_formulas_of_a_twin_give_the_same_numbers(numbers: list[float]) -> None:
    a, b, c, d = numbers
    check_formula(Outer((a, b), c, (Inner(d), Inner(a)), Inner(b)))


@given(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3), st.floats(-2.0, 2.0))
def test_kinematics_and_clearance_of_twins(theta: list[float], angle: float) -> None:
    arm, obstacle = equal_links(3), Ellipse((0.8, 0.7), (0.2, 0.3), angle)
    arguments = Arguments()
    robot, ellipse = arguments.symbolic_copy((arm, obstacle))
    posture = ca.DM(theta).T

    def formulas(of: Any, around: Any) -> Any:
        positions = of.positions(posture)
        return ca.vertcat(*(around.segment_clearance(*pair) for pair in itertools.pairwise(positions)))

    evaluate = ca.Function("f", [arguments.symbols], [formulas(robot, ellipse)])
    expected = as_array(formulas(arm, obstacle))
    assert as_array(evaluate(arguments.values)) == pytest.approx(expected, abs=1e-12)


def test_limits_share_their_robot() -> None:
    arm = equal_links(3, joint_limits=((-1.0, 1.0),) * 3)
    arguments = Arguments()
    symbolic_copies = arguments.symbolic_copy(limits_of(arm, [Ellipse((0.8, 0.8), (0.1, 0.1))]))
    assert len({id(limit.robot_or_none) for limit in symbolic_copies}) == 1
    speed, acceleration = (limit for limit in symbolic_copies if isinstance(limit, SpeedLimit | AccelerationLimit))
    assert speed.bounds is not None
    assert acceleration.bounds is not None
    numbers = arguments.values[[int(str(symbol)[1:]) for symbol in (*speed.bounds, *acceleration.bounds)]]
    assert numbers.tolist() == [4.0] * 3 + [20.0] * 3
    assert np.unique(arguments.values).size < arguments.values.size


def make_of(statement: object) -> object:
    return Reading(statement).structure_key


def test_a_make_of_obstacles_can_be_hashed() -> None:
    assert make_of(Ellipse((0.1, 0.2), (0.3, 0.4), 0.5)) == make_of(Ellipse((1.0, 2.0), (3.0, 4.0), 5.0))
    assert make_of(Ellipse((0.1, 0.2), (0.3, 0.4))) != make_of(Ellipse((0.1, 0.2), (0.3, 0.4), 0.5))
    upright, turned = (Ball(center=(0.0, 0.0, 0.0), radius=0.1, quaternion=q) for q in (None, (0.0, 0.0, 0.0, 1.0)))
    assert make_of(upright) != make_of(turned)
    assert hash(make_of((upright, turned))) is not None


def test_polygons_with_other_parts_have_another_make() -> None:
    """As many corners, but one is convex and the other not: their formulas differ."""
    square, arrow = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), ((0.0, 0.0), (1.0, 0.0), (0.2, 0.2), (0.0, 1.0))
    assert make_of(Polygon(square)) != make_of(Polygon(arrow))
    assert make_of(Polygon(square)) == make_of(Polygon(tuple((2.0 * x, 3.0 * y) for x, y in square)))
