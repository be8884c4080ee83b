"""Solvers by name, and those that other packages bring."""

from __future__ import annotations

from pathlib import Path

import pytest

from solvers import EXTERNAL, IPOPT, SOLVERS, Solver
from tpbso_casadi import find_solver
from tpbso_casadi.cli.commands.solve import parser
from tpbso_casadi.scenario import PluginError

PLUGIN = """
from dataclasses import dataclass
from solvers import Solver

@dataclass(frozen=True)
class Still(Solver):
    population: int = 3
    def search(self, box, rng, iterations):
        x = box.sample(rng, self.population)
        for _ in iterations:
            yield x

nothing = 3
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "still_plugin.py").write_text(PLUGIN)
    info = tmp_path / "still_plugin-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: still-plugin\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[tpbso_casadi.solvers]\nstill = still_plugin:Still\nodd = still_plugin:nothing\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))


def test_our_own() -> None:
    assert {name: find_solver(name) for name in SOLVERS} == SOLVERS
    assert find_solver("ipopt") is IPOPT


@pytest.mark.parametrize("name", EXTERNAL)
def test_those_of_other_libraries(name: str) -> None:
    if EXTERNAL[name].extra:
        pytest.importorskip(EXTERNAL[name].extra)
    assert issubclass(find_solver(name), Solver)


@pytest.mark.usefixtures("plugin")
def test_a_class_by_its_path_and_by_its_entry_point() -> None:
    assert find_solver("still_plugin:Still").__name__ == "Still"
    assert find_solver("still") is find_solver("still_plugin:Still")


def test_a_library_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.scenario.catalogues.find_spec", lambda name: None)
    with pytest.raises(PluginError, match=r"cma needs the package cma: pip install 'tpbso-casadi\[cma\]'"):
        find_solver("cma")
    assert find_solver("scipy-de").__name__ == "SciPyDE"


@pytest.mark.usefixtures("plugin")
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("bos", "did you mean bso"),
        ("ippot", "did you mean ipopt"),
        ("stil", "did you mean still"),
        ("no such", "there are .*bso"),
        ("still_plugin:nothing", "not a subclass of solvers.Solver"),
        ("odd", "not a subclass of solvers.Solver"),
        ("still_plugin:Missing", "cannot load"),
        ("no_such_module:Missing", "cannot load"),
        (":Missing", "cannot load"),
    ],
)
def test_what_is_no_solver(name: str, reason: str) -> None:
    with pytest.raises(PluginError, match=reason):
        find_solver(name)


def test_the_help_names_every_solver() -> None:
    text = " ".join(parser().format_help().split())
    assert all(name in text for name in (*SOLVERS, "ipopt", *EXTERNAL))
