"""The lookup of everything pluggable, and each of its errors."""

from __future__ import annotations

import importlib
import sys
from collections import OrderedDict
from numbers import Rational
from pathlib import Path
from typing import TypeGuard

import pytest

from tpbso_casadi.scenario import PluginError
from tpbso_casadi.scenario.catalogues import Catalogue, subclass_of

MODULE = """
from fractions import Fraction

class Shape: ...
class Third(Fraction): ...
third = Fraction(1, 3)

class Holder:
    half = Fraction(1, 2)
"""


CLASSES: Catalogue[type[dict]] = Catalogue(
    kind="mapping",
    group="no.such.group",
    registry={"plain": dict, "ordered": "collections:OrderedDict", "rare": "no_such_package:Rare", "list": list},
    accepts=subclass_of(dict),
    requirement="a subclass of dict",
    extras={"rare": "no_such_package"},
)


def is_rational(candidate: object) -> TypeGuard[Rational]:
    return isinstance(candidate, Rational)


NUMBERS: Catalogue[Rational] = Catalogue(
    kind="number",
    group="tpbso_casadi.test_numbers",
    registry={"seven": 7},
    accepts=is_rational,
    requirement="a rational number",
)


@pytest.fixture(autouse=True)
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A module with fractions, one that cannot be imported, and two packages with entry points."""
    (tmp_path / "fraction_plugin.py").write_text(MODULE)
    (tmp_path / "broken_plugin.py").write_text("raise RuntimeError('two\\nlines')\n")
    entries = {
        "first": "third = fraction_plugin:third\nboth = fraction_plugin:third\nbroken = broken_plugin:x\nseven = x:y\n",
        "second": "both = fraction_plugin:Holder.half\nthird = fraction_plugin:third\nclass = fraction_plugin:Third\n",
    }
    for name, lines in entries.items():
        info = tmp_path / f"{name}_dist-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}-dist\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[tpbso_casadi.test_numbers]\n{lines}")
    monkeypatch.syspath_prepend(str(tmp_path))


def test_from_the_registry_directly_or_by_path() -> None:
    assert CLASSES.find("plain") is dict
    assert CLASSES.find("ordered") is OrderedDict


def test_by_entry_point_and_by_path() -> None:
    assert str(NUMBERS.find("third")) == "1/3"  # offered twice, but it is the same
    assert str(NUMBERS.find("fraction_plugin:third")) == "1/3"
    assert str(NUMBERS.find("fraction_plugin:Holder.half")) == "1/2"


def test_the_registry_goes_before_entry_points() -> None:
    assert NUMBERS.find("seven") == 7


def test_all_names() -> None:
    assert NUMBERS.names() == ["seven", "both", "broken", "class", "third"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("thrid", "no number 'thrid'; did you mean third?"),
        ("qqq", "no number 'qqq'; there are both, broken, class, seven, third"),
        ("both", "number 'both' is ambiguous: say fraction_plugin:Holder.half or fraction_plugin:third"),
        ("broken", "cannot load number 'broken': importing broken_plugin failed: RuntimeError: two lines"),
        (
            "nowhere:x",
            "cannot load number 'nowhere:x': importing nowhere failed: ModuleNotFoundError: No module named 'nowhere'",
        ),
        (
            "fraction_plugin:thrid",
            "cannot load number 'fraction_plugin:thrid': fraction_plugin has no thrid; did you mean third?",
        ),
        (":x", "cannot load number ':x': ':x' is not package.module:Attribute"),
        ("x:", "cannot load number 'x:': 'x:' is not package.module:Attribute"),
        (".x:y", "cannot load number '.x:y': '.x:y' is not package.module:Attribute"),
        ("fraction_plugin:Shape", "number 'fraction_plugin:Shape' is not a rational number"),
        ("class", "number 'class' is not a rational number"),
    ],
)
def test_every_error_is_one_line(name: str, message: str) -> None:
    with pytest.raises(PluginError) as caught:
        NUMBERS.find(name)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("raise SystemExit(0)", "importing odd_plugin failed: SystemExit: 0"),
        ("class Own(BaseException): ...\nraise Own('x')", "importing odd_plugin failed: Own: x"),
        ("def f(): f()\nf()", "importing odd_plugin failed: RecursionError: "),
        ("class (", "importing odd_plugin failed: SyntaxError: "),
        (
            "def __getattr__(name): raise ZeroDivisionError(name)",
            "third of odd_plugin failed: ZeroDivisionError: third",
        ),
    ],
)
def test_whatever_a_module_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, reason: str) -> None:
    (tmp_path / "odd_plugin.py").write_text(text + "\n")
    monkeypatch.delitem(sys.modules, "odd_plugin", raising=False)
    importlib.invalidate_caches()
    with pytest.raises(PluginError) as caught:
        NUMBERS.find("odd_plugin:third")
    assert str(caught.value).startswith("cannot load number 'odd_plugin:third': " + reason)


def test_what_a_module_prints_is_no_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "talking_plugin.py").write_text("print('hello')\nfrom fraction_plugin import third\n")
    importlib.invalidate_caches()
    assert str(NUMBERS.find("talking_plugin:third")) == "1/3"
    assert capsys.readouterr() == ("", "hello\n")


def test_interruption_passes(tmp_path: Path) -> None:
    (tmp_path / "stopped_plugin.py").write_text("raise KeyboardInterrupt\n")
    importlib.invalidate_caches()
    with pytest.raises(KeyboardInterrupt):
        NUMBERS.find("stopped_plugin:third")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("rare", "rare needs the package no_such_package: pip install 'tpbso-casadi[no_such_package]'"),
        ("list", "mapping 'list' is not a subclass of dict"),
        ("plane", "no mapping 'plane'; did you mean plain?"),
        ("fraction_plugin:third", "mapping 'fraction_plugin:third' is not a subclass of dict"),
    ],
)
def test_errors_of_a_catalogue_of_classes(name: str, message: str) -> None:
    with pytest.raises(PluginError) as caught:
        CLASSES.find(name)
    assert str(caught.value) == message


def test_an_empty_catalogue_has_nothing_to_offer() -> None:
    empty: Catalogue[Rational] = Catalogue(
        kind="limit", group="no.such.group", registry={}, accepts=is_rational, requirement="a limit"
    )
    with pytest.raises(PluginError, match="no limit 'x'; there are none"):
        empty.find("x")
