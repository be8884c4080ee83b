"""What is kept under a structure: which things have the same name, and what is found again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from problems.base import cached_function, cached_text, structure_cache, structure_key
from problems.robots import built_in
from problems.scene import Box, Capsule

pytestmark = pytest.mark.usefixtures("cache_folder")


@dataclass(frozen=True)
class Foreign:
    """No class of the package."""

    number: float = 1.0


BOX = Box(center=(0.1, 0.2, 0.3), size=(1.0, 2.0, 3.0))
DIFFERENT = [
    *(1, 1.0, True, "1", b"1", None, (), [], (1,), (1.0,), [1.0], ("1",), ((1.0,), ()), ((), (1.0,)), {"a": 1}),
    *(np.zeros(2), np.zeros((2, 1)), np.zeros(2, dtype=np.int64), np.array([0.0, -0.0]), 0.0, -0.0, float("nan")),
    *(BOX, replace(BOX, size=(1.0, 2.0, 3.5)), Box, Capsule),
]


def test_what_is_different_has_different_names() -> None:
    names = [structure_key(each) for each in DIFFERENT]
    assert None not in names
    assert len({*names}) == len(names)
    assert structure_key(1.0, 2.0) != structure_key(1.0, (2.0,))
    assert structure_key("ab", "c") != structure_key("a", "bc")


def test_the_same_has_the_same_name() -> None:
    assert structure_key(Box(center=(0.1, 0.2, 0.3), size=(1.0, 2.0, 3.0))) == structure_key(BOX)
    one, other = (built_in("panda").arm() for _ in range(2))
    assert structure_key(one) == structure_key(other) is not None
    assert structure_key(replace(one, max_speed=(1.0,) * 7)) != structure_key(one)


@pytest.mark.parametrize("value", [Foreign(), Foreign, ca.SX.sym("x"), ca.DM(1.0), {1, 2}, len, object()])
def test_what_is_not_ours_has_no_name(value: object) -> None:
    assert structure_key("a", (value,)) is None


def test_other_sources_mean_other_names(monkeypatch: pytest.MonkeyPatch) -> None:
    before = structure_key(1)
    monkeypatch.setattr(structure_cache, "sources", lambda: "other")
    assert structure_key(1) != before


def test_texts_are_made_once(cache_folder: Path) -> None:
    made: list[int] = []

    def make() -> str:
        made.append(1)
        return "text"

    key = structure_key("a text")
    assert [cached_text(key, "pairs", make) for _ in range(2)] == ["text", "text"]
    assert len(made) == 1
    assert [cached_text(None, "pairs", make) for _ in range(2)] == ["text", "text"]
    assert len(made) == 3
    [file] = cache_folder.glob("*.pairs")
    file.write_bytes(file.read_bytes()[:-1])  # no longer whole
    assert cached_text(key, "pairs", make) == "text"
    assert len(made) == 4


def test_functions_are_found_again_to_the_bit() -> None:
    x = ca.SX.sym("x", 3)

    def make() -> ca.Function:
        return ca.Function("f", [x], [ca.sin(x) / 3.0 + x[0] ** 2, x[2]])

    first = cached_function(make, "f", 3)
    assert cached_function(lambda: pytest.fail("made again"), "f", 3) is first
    structure_cache._by_key.cache_clear()
    again = cached_function(lambda: pytest.fail("made again"), "f", 3)
    values = np.random.default_rng(0).normal(size=(3, 50))
    for one, other in zip(make()(values), again(values), strict=True):
        assert np.array_equal(np.array(one), np.array(other))
    assert cached_function(make, "f", Foreign()) is not cached_function(make, "f", Foreign())
