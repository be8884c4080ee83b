"""Statements and their symbolic copies: which numbers become arguments, and what formulas make of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st

from problems import Ball, Ellipse, Polygon
from problems.base import Arguments, Parametric, Reading, Replacement


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


def make_of(statement: object) -> object:
    return Reading(statement).structure_key


def test_a_make_is_all_but_the_numbers() -> None:
    make = make_of(Inner(1.0, ((1.0, 2.0),), 0.5, "a"))
    assert make == make_of(Inner(9.0, ((7.0, 8.0),), -3.0, "a"))
    others = [
        Inner(1.0, ((1.0, 2.0),), 0.5, "b"),
        Inner(1.0, ((1.0, 2.0),), 0.0, "a"),
        Inner(1.0, ((1.0, 2.0), (1.0, 2.0)), 0.5, "a"),
        Inner(1.0, None, 0.5, "a"),
        Outer((1.0,), 2.0, (), Inner(1.0)),
    ]
    assert all(make_of(other) != make for other in others)


def test_a_make_knows_what_occurs_twice() -> None:
    one, other = Inner(1.0), Inner(1.0)
    assert make_of((one, one)) == make_of((other, other))
    assert make_of((one, one)) != make_of((one, other))
    assert Reading((one, one)).values.tolist() == [1.0]


@given(st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4))
def test_formulas_of_a_twin_give_the_same_numbers(numbers: list[float]) -> None:
    a, b, c, d = numbers
    shared, arguments = Inner(d, ((a, b), (c, d)), 0.5), Arguments()
    outer = Outer((a, b), c, (shared, Inner(a)), shared)
    expression = arguments.symbolic_copy(outer).formula()
    evaluate = ca.Function("f", [arguments.symbols], [expression])
    assert float(evaluate(arguments.values)) == pytest.approx(float(outer.formula()), rel=1e-12)
    assert Reading(outer).values.tolist() == arguments.values.tolist()


def test_a_copy_has_another_value_wherever_the_statement_occurs() -> None:
    shared, other = Inner(2.0), Inner(2.0)
    outer = Outer((0.0, 0.0), 1.0, (shared, other), shared)
    copies = Replacement(shared, {"length": -3.0, "name": "longer"})  # what no constructor checks
    copy = copies.copied(outer)
    assert copy.parts[0] is copy.twice and copies.copied((outer, 7)) == (copy, 7)
    assert (copy.twice.length, copy.twice.name, copy.parts[1].length) == (-3.0, "longer", 2.0)
    assert (outer.twice.length, outer.formula(), copy.formula()) == (2.0, 14.0, -6.0)


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
