"""Whether stored numbers are those that a recomputation gives."""

from __future__ import annotations

from typing import Any

import pytest

from tpbso_casadi.storage.recomputation import Contradiction, Tolerance, compare

TREE = {
    "a": {"number": 1.0, "beside": -4.0},
    "rows": [{"name": "one", "value": 0.0}, {"name": "two", "value": 2.0}],
    "words": ["x", "y"],
    "nothing": None,
}
TOLERANCES = {"a.number": Tolerance(1e-9, beside="beside"), "rows.*.value": Tolerance(1e-9, 1.0)}


def edited(path: tuple[str | int, ...], value: Any) -> dict[str, Any]:
    """The tree with one value set, or removed where that is ``...``."""
    tree: Any = {
        "a": dict(TREE["a"]),
        "rows": [dict(row) for row in TREE["rows"]],
        "words": ["x", "y"],
        "nothing": None,
    }
    table = tree
    for key in path[:-1]:
        table = table[key]
    if value is ...:
        del table[path[-1]]
    else:
        table[path[-1]] = value
    return dict(tree)


@pytest.mark.parametrize(
    ("path", "value"),
    [(("a", "number"), 1.0 + 3.9e-9), (("rows", 0, "value"), 9e-10), (("rows", 1, "value"), 2.0 - 1e-9)],
)
def test_what_agrees(path: tuple[str | int, ...], value: float) -> None:
    compare(edited(path, value), TREE, TOLERANCES)


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        (("a", "number"), 1.0 + 4.1e-9, "a.number: 1.0000000041 is stored, 1.0 is computed"),
        (("a", "number"), None, "a.number: None is stored, 1.0 is computed"),
        (("a", "beside"), -4.000000000001, "a.beside: "),
        (("a", "number"), ..., "a.number: missing key"),
        (("a", "other"), 1, "a.other: 1 is stored, nothing is computed"),
        (("nothing",), 1.0, "nothing: 1.0 is stored, None is computed"),
        (("rows", 0, "value"), 1.1e-9, "rows.one.value: "),
        (("rows", 1, "name"), "three", "rows: ['one', 'three'] is stored, ['one', 'two'] is computed"),
        (("rows",), [], "rows: [] is stored, ['one', 'two'] is computed"),
        (("words", 1), "z", "words.1: 'z' is stored, 'y' is computed"),
        (("words",), "x" * 1000, f"words: '{'x' * 199}... is stored"),
    ],
)
def test_what_does_not(path: tuple[str | int, ...], value: Any, reason: str) -> None:
    with pytest.raises(Contradiction) as caught:
        compare(edited(path, value), TREE, TOLERANCES)
    assert str(caught.value).startswith(reason)


def test_the_tolerance_is_that_of_the_closest_path() -> None:
    looser = {"rows.two.value": Tolerance(1e-3)}
    for tolerances in (TOLERANCES | looser, looser | TOLERANCES):
        compare(edited(("rows", 1, "value"), 2.0019), TREE, tolerances)
        with pytest.raises(Contradiction, match=r"^rows\.one\.value"):
            compare(edited(("rows", 0, "value"), 1e-4), TREE, tolerances)


def test_no_number_is_infinite_to_some_tolerance() -> None:
    with pytest.raises(Contradiction, match=r"^a: 99\.0 is stored, inf is computed$"):
        compare({"a": 99.0}, {"a": float("inf")}, {"a": Tolerance(1e-9)})
