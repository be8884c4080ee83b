"""Solvers by name, those that other packages bring, and random scenarios for all of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.slow import slow_except
from helpers.space_scenarios import space_scenario

import tpbso_casadi as tp
from benchmarks.random_scenarios import random_scenario, random_scenarios
from solvers import EXTERNAL, IPOPT, SOLVERS, Solver
from tpbso_casadi import Scenario, find_solver, parse_scenario
from tpbso_casadi.cli.commands.solve import parser
from tpbso_casadi.judging.grid import function_grid, parse_solvers, suite_grid
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import PluginError, ScenarioError, named_solver

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
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "still_plugin.py").write_text(PLUGIN)
    info = tmp_path / "still_plugin-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: still-plugin\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[tpbso_casadi.solvers]\nstill = still_plugin:Still\n")
    monkeypatch.syspath_prepend(str(tmp_path))


def test_our_own() -> None:
    assert {name: find_solver(name) for name in SOLVERS} == SOLVERS
    assert find_solver("ipopt") is IPOPT


def test_direct_and_its_former_name() -> None:
    assert find_solver("direct") is find_solver("ladder") is SOLVERS["abso"]
    assert named_solver("ladder(antenna=0.2)+polish").table("direct", {"momentum": 0.5}) == {
        **{"name": "direct", "settings": {"momentum": 0.5, "antenna": 0.2}, "polish_starts": 1},
    }
    stated = parse_scenario(space_scenario(solver={"name": "ladder"})).solver
    assert (stated.name, stated.is_direct) == ("direct", True)


@pytest.mark.parametrize("name", ["direct", "ladder"])
def test_direct_searches_nothing_else(name: str) -> None:
    line = "direct plans motions and searches nothing else; DIRECT of SciPy is scipy-direct"
    with pytest.raises(ValueError, match=line):
        tp.minimize(np.sum, [(0.0, 1.0)], name)
    with pytest.raises(ScenarioError, match=line):
        function_grid(["sphere-10"], parse_solvers(name), [1])
    with pytest.raises(ScenarioError, match=line):
        suite_grid(tp.suite()[:1], parse_solvers(name), 1, 10)


@pytest.mark.parametrize("name", EXTERNAL)
def test_those_of_other_libraries(name: str) -> None:
    if EXTERNAL[name].package:
        pytest.importorskip(EXTERNAL[name].package)
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


def test_the_help_names_every_solver() -> None:
    text = " ".join(parser().format_help().split())
    assert all(name in text for name in (*SOLVERS, "ipopt", *EXTERNAL))


@pytest.fixture(scope="module")
def some() -> list[Scenario]:
    return random_scenarios(11, 12)


def test_the_same_seed_gives_the_same_scenarios_of_many_kinds(some: list[Scenario]) -> None:
    assert random_scenarios(11, 3) == some[:3]
    assert random_scenarios(12, 3) != some[:3]
    assert random_scenario(np.random.default_rng(11)) == some[0]
    assert {scenario.task.kind for scenario in some} == {"point-to-point", "path"}
    assert {scenario.task.objective for scenario in some} == {"time", "rotation", "length"}
    assert {scenario.model.formulation for scenario in some} == {"paper", "reduced"}
    assert {len(scenario.arm.link_lengths) for scenario in some if scenario.arm} >= {2, 3, 4, 5, 6}
    assert any(scenario.obstacles for scenario in some)


@pytest.mark.parametrize("number", slow_except(range(12), (3, 9)))
def test_each_random_scenario_can_be_solved(number: int, some: list[Scenario]) -> None:
    content = some[number].table()
    content["solver"] |= {"name": "abso", "evaluations": 6000}
    assert plan(parse_scenario(content)).feasible


def test_every_solver_takes_them(some: list[Scenario]) -> None:
    content = some[3].table()
    for name in SOLVERS:
        content["solver"] |= {"name": name, "evaluations": 300}
        assert plan(parse_scenario(content)).search.evaluations == 300
