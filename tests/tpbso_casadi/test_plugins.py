"""The lookup of everything pluggable; plug-ins that raise, wherever they do: one line, and nothing half-written."""

from __future__ import annotations

import importlib
import json
import sys
from collections import OrderedDict
from numbers import Rational
from pathlib import Path
from typing import Any, TypeGuard

import pytest
from helpers.scenes import SWING, TWO_LINKS, toml

from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.scenario import PluginError
from tpbso_casadi.scenario.catalogues import Catalogue, subclass_of
from tpbso_casadi.storage import read_run, sealed

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
    extras={"rare": ("no_such_package", "rarities")},
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


def test_by_registry_entry_point_and_path() -> None:
    assert CLASSES.find("plain") is dict
    assert CLASSES.find("ordered") is OrderedDict
    assert str(NUMBERS.find("third")) == "1/3"  # offered twice, but it is the same
    assert str(NUMBERS.find("fraction_plugin:third")) == "1/3"
    assert str(NUMBERS.find("fraction_plugin:Holder.half")) == "1/2"
    assert NUMBERS.find("seven") == 7  # the registry goes before entry points


def test_all_names() -> None:
    assert NUMBERS.names() == ["seven", "both", "broken", "class", "third"]


def error_of(catalogue: Catalogue[Any], name: str) -> str:
    with pytest.raises(PluginError) as caught:
        catalogue.find(name)
    return str(caught.value)


WRONG = [
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
]


def test_every_error_is_one_line() -> None:
    for name, message in WRONG:
        assert error_of(NUMBERS, name) == message


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
    assert error_of(NUMBERS, "odd_plugin:third").startswith(f"cannot load number 'odd_plugin:third': {reason}")


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


WRONG_CLASSES = [
    ("rare", "rare needs the package no_such_package: pip install 'tpbso-casadi[rarities]'"),
    ("list", "mapping 'list' is not a subclass of dict"),
    ("plane", "no mapping 'plane'; did you mean plain?"),
    ("fraction_plugin:third", "mapping 'fraction_plugin:third' is not a subclass of dict"),
]


def test_errors_of_a_catalogue_of_classes() -> None:
    for name, message in WRONG_CLASSES:
        assert error_of(CLASSES, name) == message


def test_an_empty_catalogue_has_nothing_to_offer() -> None:
    empty: Catalogue[Rational] = Catalogue(
        kind="limit", group="no.such.group", registry={}, accepts=is_rational, requirement="a limit"
    )
    with pytest.raises(PluginError, match="no limit 'x'; there are none"):
        empty.find("x")


RAISING = """
from dataclasses import dataclass
from typing import ClassVar

from problems import Constraint, Limit, PlanarArm
from solvers import Solver
from tpbso_casadi.scenario.model import TaskSection


@dataclass(frozen=True)
class Raising(Limit):
    name: ClassVar[str] = "raising"

    @classmethod
    def for_robot(cls, robot, obstacles):
        return cls()

    def constraints_at(self, samples, margin=0.0):
        raise RuntimeError("no such\\nsensor")


@dataclass(frozen=True)
class Speed(Raising):
    name: ClassVar[str] = "speed"


@dataclass(frozen=True)
class Broken(Solver):
    population: int = 5

    def search(self, box, rng, iterations):
        yield box.sample(rng, self.population)
        raise KeyError("step")


@dataclass(frozen=True)
class Torn(PlanarArm):
    def positions(self, theta):
        raise ZeroDivisionError("no tool")


class Own(BaseException):
    pass


@dataclass(frozen=True)
class Exits(Broken):
    def search(self, box, rng, iterations):
        yield box.sample(rng, self.population)
        raise SystemExit(0)


@dataclass(frozen=True)
class Unmade(Solver):
    def __post_init__(self):
        raise Own("not today")

    def search(self, box, rng, iterations):
        yield


class Plain(Solver):
    def search(self, box, rng, iterations):
        yield box.sample(rng, 5)


@dataclass(frozen=True)
class Deaf(Solver):
    def search(self, box, rng, iterations):
        return [box.sample(rng, 5)]


class Chore(TaskSection):
    def check(self):
        raise RuntimeError("no work")
"""
OWN = {"arm": TWO_LINKS, "task": SWING}
TORN = {"robot": {"model": "raising:Torn", "settings": TWO_LINKS}, "task": SWING}


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "raising.py").write_text(RAISING)
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def scenario(folder: Path, **tables: Any) -> str:
    path = folder / "own.toml"
    path.write_text(toml(**tables))
    return str(path)


def with_solver(name: str) -> dict[str, Any]:
    return OWN | {"solver": {"name": f"raising:{name}"}}


NO_DATACLASS = "solver.name: solver 'raising:Plain' is not a dataclass derived from solvers.Solver"
FAILING: dict[str, tuple[dict[str, Any], str]] = {
    "a limit": (OWN | {"model": {"limits": ["raising:Raising"]}}, "RuntimeError: no such sensor"),
    "a robot": (TORN, "ZeroDivisionError: no tool"),
    "a solver that is no dataclass": (with_solver("Plain"), NO_DATACLASS),
    "a solver that yields nothing": (with_solver("Deaf"), "it has to yield its candidates"),
    "a solver that cannot be made": (with_solver("Unmade"), "Own: not today"),
    "a task that fails its check": (OWN | {"task": {"kind": "raising:Chore"}}, "task.kind: plug-in"),
    "a limit of a name there is": (OWN | {"model": {"limits": ["raising:Speed"]}}, "'speed' is there twice"),
}


@pytest.mark.parametrize(("tables", "reason"), FAILING.values(), ids=FAILING)
def test_solve(module: Path, capsys: pytest.CaptureFixture[str], tables: dict[str, Any], reason: str) -> None:
    path = scenario(module, **tables)
    assert solve.main([path, "--evaluations", "200", "--out", str(module / "run"), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and path in said and reason in said
    assert not (module / "run").exists() or not list((module / "run").iterdir())


RAISING_LATER = {"Broken": "KeyError: 'step'", "Exits": "SystemExit: 0"}


@pytest.mark.parametrize("name", RAISING_LATER)
def test_a_solver_that_raises_after_its_first_candidates_leaves_the_best_of_them(
    module: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    path, run = scenario(module, **with_solver(name)), module / "run"
    assert solve.main([path, "--evaluations", "200", "--out", str(run), "--quiet", "--no-plots"]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {path}: plug-ins (raising:{name}) failed: {RAISING_LATER[name]} (raising.py:")
    assert said.count("\n") == 1 and said.endswith(f", is in {run}\n")
    result = read_run(run).result
    assert (result.stop_reason, result.interrupted, result.evaluations) == ("error", True, 5)
    assert solve.main([path, "--evaluations", "200", "--json"]) == 2
    printed = capsys.readouterr()
    assert json.loads(printed.out)["stop_reason"] == "error" and printed.err.endswith(", is printed\n")


@pytest.mark.parametrize("case", ["a limit", "a robot", "a limit of a name there is"])
def test_audit_of_a_scenario(module: Path, capsys: pytest.CaptureFixture[str], case: str) -> None:
    tables, reason = FAILING[case]
    path = scenario(module, **tables)
    assert audit.main([path]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and path in said and reason in said


def test_audit_of_a_run(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, run = scenario(module, **OWN), module / "run"
    assert solve.main([path, "--evaluations", "2000", "--out", str(run), "--quiet", "--no-plots"]) == 0
    result = json.loads((run / "result.json").read_text())
    result["scenario"]["model"]["limits"] = ["raising:Raising"]
    del result["seal"]
    (run / "result.json").write_text(json.dumps(sealed(result)))
    assert audit.main([str(run)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and str(run) in said and "RuntimeError: no such sensor" in said
