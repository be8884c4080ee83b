"""Tables of files: what every type and mark reads and refuses, the paths of keys, and tables written and read back."""

from __future__ import annotations

import json
import pickle
from collections.abc import Mapping
from dataclasses import InitVar, dataclass, field
from datetime import date
from enum import Enum
from math import inf, nan
from typing import Annotated, Any, Literal, TypeAlias

import pytest
from hypothesis import given
from hypothesis import strategies as st

from problems.base import (
    Checked,
    Coordinate,
    Count,
    InvalidProblem,
    InvalidTable,
    Length,
    Quantity,
    Range,
    ReadBy,
    Table,
    check_fields,
)
from problems.base.readers import reader
from problems.base.refusals import flat


class Colour(Enum):
    """Values of words."""

    RED = "red"
    BLUE = "blue"


@dataclass(frozen=True)
class Place:
    """A dataclass that checks itself, with a variable of its constructor alone."""

    center: tuple[Coordinate, Coordinate]
    sizes: Annotated[tuple[Length, ...] | None, Count(1, 2)] = None
    doubled: InitVar[bool] = False

    def __post_init__(self, doubled: bool) -> None:
        check_fields(self)


class Part(Table):
    """A table in a table."""

    name: str
    weight: Annotated[float, Range(above=0.0)] = 1.0


class Everything(Table):
    """A key of every kind, all of which JSON can hold."""

    count: Annotated[int, Range(least=1, most=9)]
    size: float = 0.0
    word: Annotated[str, Count(1, 5)] = "word"
    on: bool = False
    kind: Literal["a", 1] = "a"
    either: Annotated[float, Range(least=0.0)] | list[float] | None = None
    few: Annotated[list[int], Count(1, 3)] = field(default_factory=lambda: [1])
    pair: tuple[float, str] | None = None
    many: tuple[Annotated[float, Range(least=-1e9, most=1e9)], ...] = ()
    by_name: dict[str, Annotated[float, Range(above=0.0)]] = field(default_factory=dict)
    colour: Colour = Colour.RED
    place: Place | None = None
    inner: Part | None = None
    parts: list[Part] = field(default_factory=list)
    anything: Any = None

    def check(self) -> None:
        """Refuse one pair of values."""
        if self.count == 9 and self.on:
            raise InvalidTable("not with count = 9", "on")


def even(value: int) -> int:
    """Half of an even number."""
    if value % 2:
        raise ValueError("an even number is needed")
    return value // 2


def refusal(hint: Any, value: object) -> str:
    with pytest.raises(InvalidTable) as refused:
        reader(hint)(value)
    assert "\n" not in str(refused.value)
    return str(refused.value)


Positive: TypeAlias = Annotated[float, Range(above=0)]
WITHIN: Any = Annotated[float, Range(-1, 1)]
READ: list[tuple[Any, object, object]] = [
    (float, 3, 3.0),
    (int, -3, -3),
    (bool, True, True),
    (str, "", ""),
    (Literal[1, "1"], "1", "1"),
    (float | str, "x", "x"),
    (str | list[float], [1], [1.0]),
    (float | None, None, None),
    (tuple[int, float], [1, 2], (1, 2.0)),
    (tuple[float, ...], [], ()),
    (list[list[float]], ((1, 2), ()), [[1.0, 2.0], []]),
    (list, [1, "a"], [1, "a"]),
    (dict, {"a": 1}, {"a": 1}),
    (Mapping[str, int], {"a": 1}, {"a": 1}),
    (Colour, "blue", Colour.BLUE),
    (Colour, Colour.BLUE, Colour.BLUE),
    (Place, {"center": [1, 2], "sizes": [1], "doubled": True}, Place((1.0, 2.0), (1.0,))),
    (Place, {"center": [1, 2], "sizes": None}, Place((1.0, 2.0))),
    (Part, {"name": "a"}, Part(name="a")),
    (Annotated[float | None, Range(least=0)], None, None),
    (Annotated[tuple[float, float], Quantity((0.0, 1.0), "m")], [1, 1], (1.0, 1.0)),
    (Annotated[int, Checked(even)], 4, 2),
    (Annotated[int, Checked(even), Checked(even)], 4, 1),
    (Annotated[Any, ReadBy(str)], 4, "4"),
    (Any, {1: 2}, {1: 2}),
]


def test_what_a_type_reads() -> None:
    for hint, value, expected in READ:
        found = reader(hint)(value)
        assert (found, type(found)) == (expected, type(expected)), (hint, value)


def test_every_type_says_what_it_needs() -> None:
    needs = {int: "a whole number", float: "a number", str: "a word", bool: "true or false", list[int]: "a list"}
    needs |= {tuple[int, int]: "a list", dict[str, int]: "a table", Part: "a table", Place: "a table"}
    wrong = {int: 1.0, float: "1", str: 1, bool: 1, dict[str, int]: []}
    for hint, words in needs.items():
        for value in (wrong.get(hint, "x"), object, date(1979, 5, 27), None, True if hint is not bool else 0):
            said = refusal(hint, value)
            assert said.startswith(f"{words} is needed, not "), (hint, value)
            assert said.endswith("1979-05-27") or not isinstance(value, date)
            assert refusal(dict[str, list[hint]], {"a": [value]}) == f"a.0: {said}"  # type: ignore[valid-type]


REFUSED: list[tuple[Any, object, str]] = [
    *((float, value, "a finite number is needed, not ") for value in (nan, inf, -inf, 10**400)),
    (float, 10**5000, "a finite number is needed, not a number of thousands of digits"),
    (Positive, 0, "input should be greater than 0, not 0"),
    (WITHIN, 1.5, "input should be less than or equal to 1, not 1.5"),
    (WITHIN, -2, "input should be greater than or equal to -1, not -2"),
    (Annotated[float, Range(below=0.5)], 0.5, "input should be less than 0.5, not 0.5"),
    (Length, -1.0, "input should be greater than 0, not -1.0"),
    (str, "\udcff", "not text in UTF-8"),
    (Annotated[str, Count(2, 3)], "abcd", "a shorter word is needed, not 'abcd'"),
    (Annotated[str, Count(2, 3)], "a", "a longer word is needed, not 'a'"),
    (Annotated[list[int], Count(2, 3)], [1], "a list of at least 2 items is needed, not of 1"),
    (Annotated[list[int], Count(2, 3)], [1] * 4, "at most 3 items, not 4"),
    (tuple[float, float], [1.0], "1: missing key"),
    (list[tuple[float, str]], [[1.0, "a"], [1.0, 2]], "1.1: a word is needed, not 2"),
    (Literal["red", "blue"], "blu", "input should be 'red' or 'blue', not 'blu'; did you mean blue?"),
    (Literal[1, 2, 3], True, "input should be 1, 2 or 3, not True"),
    (Colour, "rad", "input should be 'red' or 'blue', not 'rad'; did you mean red?"),
    (float | list[float], "x", "a number is needed, not 'x'"),
    (float | list[float], [1.0, "x"], "1: a number is needed, not 'x'"),
    (dict[str, Positive], {"a": {}}, "a: a number is needed, not {}"),
    (dict[str, int], {1: 2}, "1: a word is needed, not 1"),
    (list[Annotated[int, Checked(even)]], [2, 3], "1: an even number is needed"),
    (Place, {"center": [0.0, 1e9]}, "center: 1e+09 is not within -1e+08 and 1e+08 m"),
    (Place, {"center": [0.0, 0.0], "sizes": [1.0] * 3}, "sizes: at most 2 items, not 3"),
    (list[Place], [{"centre": [0.0, 0.0]}], "0.centre: unknown key; did you mean center?"),
    (Part, {}, "name: missing key"),
    (Part, {"nam": "a"}, "nam: unknown key; did you mean name?"),
    (Part, {"name": "a", 1: 2}, "1: unknown key"),
    (Everything, {"count": 9, "on": True}, "on: not with count = 9"),
    (Everything, {"count": 1, "parts": [{"name": "a"}, {"name": 3}]}, "parts.1.name: a word is needed, not 3"),
    (Everything, {"count": 1, "inner": {"name": "a", "weight": 0}}, "inner.weight: input should be greater than 0"),
]  # fmt: skip


def test_what_a_type_refuses() -> None:
    for hint, value, said in REFUSED:
        assert refusal(hint, value).startswith(said), (hint, said)


def test_an_error_tells_its_keys() -> None:
    with pytest.raises(InvalidTable) as refused:
        Everything.from_table({"count": 1, "parts": [{"name": 3}]})
    assert (refused.value.keys, refused.value.reason) == (("parts", 0, "name"), "a word is needed, not 3")
    with pytest.raises(InvalidTable, match=r"^0\.name: a word"), flat("parts"):
        raise refused.value
    with pytest.raises(InvalidProblem, match=r"^center: "):  # what is made in Python is no table
        Place(("a", 0.0))  # type: ignore[arg-type]


@pytest.mark.parametrize("marked", [WITHIN, Annotated[float, Range(-1, 1), Checked(abs)]], ids=["at once", "each"])
def test_a_long_list_of_numbers_is_read_as_each_of_them(marked: Any) -> None:
    numbers = [0.5] * 1000
    assert reader(list[marked])(numbers) == numbers
    assert reader(list[marked])([*numbers, 1]) == [*numbers, 1.0]
    assert reader(tuple[marked, ...])(numbers) == tuple(numbers)
    for value in (nan, inf, -inf, 1.5, -1.5, True, "1", None, 2):
        said = refusal(marked, value)
        assert refusal(list[marked], [*numbers, value, nan]) == f"1000: {said}"
    assert reader(list[float])([1e308] * 3) == [1e308] * 3  # their sum is no number


def test_which_keys_were_stated() -> None:
    read = Everything.from_table({"size": 2, "count": 3, "inner": {"name": "a"}})
    assert read.stated_keys == {"size", "count", "inner"}
    assert read.inner is not None and read.inner.stated_keys == {"name"}
    assert Everything.from_table(read) is read
    changed = read.with_keys({"count": 4, "word": "x"})
    assert (changed.count, changed.size, changed.stated_keys) == (4, 2.0, read.stated_keys | {"word"})
    with pytest.raises(InvalidTable, match=r"^count: input should be less than or equal to 9, not 10$"):
        read.with_keys({"count": 10})
    replaced, filled = read.replaced(word="believed"), read.filled_in(word="believed", count=10)
    assert (replaced.word, replaced.stated_keys) == ("believed", read.stated_keys | {"word"})
    assert (filled.count, filled.stated_keys, read.count) == (10, read.stated_keys, 3)
    assert read.inner is replaced.inner and read == read.replaced() != replaced
    with pytest.raises(AttributeError):
        read.count = 5  # type: ignore[misc]


def test_a_table_like_an_object() -> None:
    read = Everything(count=2, colour=Colour.BLUE)
    assert Part.like(Part(name="a", weight=2.0)) == Part(name="a", weight=2.0)
    assert Everything.like(read) == read and Everything.like(read).stated_keys == set(Everything.schema())
    with pytest.raises(InvalidTable, match=r"^weight: a number is needed, not None$"):
        Part.like(type("Thing", (), {"name": "a", "weight": None}))


def test_keys_and_their_defaults() -> None:
    schema = Everything.schema()
    assert [name for name, key in schema.items() if key.is_needed] == ["count"]
    assert (schema["few"].usual, schema["size"].usual, schema["count"].usual) == ([1], 0.0, None)
    one, other = Everything(count=1), Everything(count=1)
    assert one == other and one.parts is not other.parts
    assert one.values()["colour"] is Colour.RED and one.table()["colour"] == "red"


numbers, words = st.floats(allow_nan=False, allow_infinity=False), st.text(max_size=5)
weights = st.floats(1e-300, 1e300)
tables = st.fixed_dictionaries(
    {"count": st.integers(1, 8)},
    optional={
        "size": numbers | st.integers(-99, 99),
        "word": st.text(min_size=1, max_size=5),
        "on": st.booleans(),
        "kind": st.sampled_from(["a", 1]),
        "either": st.none() | st.floats(0.0, 1e9) | st.lists(numbers, max_size=3),
        "few": st.lists(st.integers(), min_size=1, max_size=3),
        "pair": st.none() | st.tuples(numbers, words),
        "many": st.lists(st.floats(-1e9, 1e9) | st.integers(-9, 9), max_size=30),
        "by_name": st.dictionaries(words, weights, max_size=3),
        "colour": st.sampled_from(["red", "blue"]),
        "place": st.none() | st.fixed_dictionaries({"center": st.tuples(*[st.floats(-1e8, 1e8)] * 2)}),
        "inner": st.none() | st.fixed_dictionaries({"name": words}, optional={"weight": weights}),
        "parts": st.lists(st.fixed_dictionaries({"name": words}), max_size=3),
        "anything": st.none() | words | st.dictionaries(words, numbers, max_size=2),
    },
)


@given(tables)
def test_what_is_written_is_read_back(content: dict[str, Any]) -> None:
    made = Everything.from_table(content)
    written = made.table()
    assert written == json.loads(made.as_text())
    again = Everything.from_table(written)
    assert again == made and again.table() == written
    assert made.stated_keys == set(content) and again.stated_keys == set(Everything.schema())
    copy = pickle.loads(pickle.dumps(made))
    assert copy == made and copy.stated_keys == made.stated_keys
