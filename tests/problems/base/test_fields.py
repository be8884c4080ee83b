"""Fields are what their types say: conformed, refused, or believed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import pytest

from problems import Ellipse, InvalidProblem
from problems.base import Count, Length, check_fields, conformed


@dataclass(frozen=True)
class Stated:
    """A field of every kind."""

    length: Length
    pair: tuple[float, float] = (0.0, 0.0)
    words: tuple[str, ...] = ()
    several: Annotated[tuple[float, ...] | None, Count(1, 2)] = None
    kind: Literal["a", "b"] = "a"
    anything: Any = None
    table: np.ndarray = None  # type: ignore[type-arg,assignment]

    def __post_init__(self) -> None:
        check_fields(self)


def test_lists_and_arrays_become_tuples_and_numbers_floats() -> None:
    stated = Stated(2, np.array([1, 2]), ["x"], [1])  # type: ignore[arg-type]
    assert (stated.length, stated.pair, stated.words, stated.several) == (2.0, (1.0, 2.0), ("x",), (1.0,))
    assert hash(stated.pair) and isinstance(stated.length, float)


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"length": "1"}, "length: a number is needed, not '1'"),
        ({"length": -1.0}, "length: -1 is not within 1e-12 and 1e+08 m"),
        ({"length": True}, "length: a number is needed, not True"),
        ({"pair": (1.0,)}, "pair: 2 numbers are needed, not (1.0,)"),
        ({"pair": 1.0}, "pair: 2 numbers are needed, not 1"),
        ({"words": (1.0,)}, "words: a word is needed, not 1"),
        ({"words": 5}, "words: words are needed, not 5"),
        ({"several": (1.0, 2.0, 3.0)}, "several: 3 entries are not within 1 and 2"),
        ({"kind": "c"}, "kind: 'c' is not one of a, b"),
        ({"table": 5}, "table: a ndarray is needed, not 5"),
    ],
)
def test_what_is_of_another_kind_is_named(fields: dict[str, Any], reason: str) -> None:
    with pytest.raises(InvalidProblem) as refused:
        Stated(**({"length": 1.0} | fields))
    assert str(refused.value) == reason


@pytest.mark.parametrize(
    ("hint", "value", "reason"),
    [
        (tuple[int | None, ...], "x", "a: numbers are needed, not 'x'"),
        (tuple[()], (1.0,), "a: 0 rows of nothing are needed, not (1.0,)"),
        (float | tuple[float, float], "x", "a: 2 numbers are needed, not 'x'"),
    ],
)
def test_odd_types_are_refused_in_words(hint: Any, value: Any, reason: str) -> None:
    with pytest.raises(InvalidProblem) as refused:
        conformed("a", value, hint)
    assert str(refused.value) == reason
    assert conformed("a", (), tuple[()]) == ()


def test_types_that_nobody_can_look_up_are_believed() -> None:
    """A class in a function, with a field of its own kind."""

    @dataclass(frozen=True)
    class Chained(Ellipse):
        following: Chained | None = None

    assert Chained((0.0, 0.0), (1.0, 1.0), following=Chained((1.0, 1.0), (1.0, 1.0))).following is not None
