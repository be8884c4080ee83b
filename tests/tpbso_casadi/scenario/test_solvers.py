"""Solvers by name, with settings in the name, those that other packages bring, and random scenarios for them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.running import refusal
from helpers.space_scenarios import space_scenario

import tpbso_casadi as tp
from benchmarks.random_scenarios import random_scenario, random_scenarios
from solvers import EXTERNAL, IPOPT, SOLVERS, Solver
from tpbso_casadi import Scenario, find_solver, parse_scenario
from tpbso_casadi.cli.commands.solve import main, parser, with_options
from tpbso_casadi.judging.grid import function_grid, parse_solver, parse_solvers, suite_grid
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import NamedSolver, PluginError, ScenarioError, named_solver

PLUGIN = """
from dataclasses import dataclass
from solvers import Solver


@dataclass(frozen=True)
class Own(Solver):
    population: int = 6
    step: float = 0.5
    word: str = "a"

    def search(self, box, rng, iterations):
        yield box.sample(rng, self.population)
        for _ in iterations:
            yield box.sample(rng, self.population)
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own_plugin.py").write_text(PLUGIN)
    info = tmp_path / "own_plugin-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: own-plugin\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[tpbso_casadi.solvers]\nown = own_plugin:Own\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)


def test_our_own() -> None:
    assert {name: find_solver(name) for name in SOLVERS} == SOLVERS
    assert find_solver("ipopt") is IPOPT


def test_direct_and_its_former_name() -> None:
    assert find_solver("direct") is find_solver("ladder") is SOLVERS["abso"]
    assert named_solver("ladder(antenna=0.2)+polish").table("direct", {"momentum": 0.5}) == {
        **{"name": "direct", "settings": {"momentum": 0.5, "antenna": 0.2}, "polish_starts": 1}
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
    assert find_solver("own_plugin:Own").__name__ == "Own"
    assert find_solver("own") is find_solver("own_plugin:Own")


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


@pytest.mark.slow
@pytest.mark.parametrize("number", range(12))
def test_each_random_scenario_can_be_solved(number: int, some: list[Scenario]) -> None:
    content = some[number].table()
    content["solver"] |= {"name": "abso", "evaluations": 6000}
    assert plan(parse_scenario(content)).feasible


@pytest.mark.slow
def test_every_solver_takes_them(some: list[Scenario]) -> None:
    content = some[3].table()
    for name in SOLVERS:
        content["solver"] |= {"name": name, "evaluations": 100, "polish_starts": 0}
        assert plan(parse_scenario(content)).search.evaluations == 100


READ = {
    "pso": NamedSolver("pso"),
    "bso(printed,inertia_last=0.9)+polish3": NamedSolver(
        "bso", {"inertia_first": 1.0, "inertia_last": 0.9, "antenna_sign": "printed"}, 3
    ),
    "a.b:C(x=1,y=-1.5e-3,z=b)": NamedSolver("a.b:C", {"x": 1, "y": -1.5e-3, "z": "b"}),
    "a.b:C(x=1_0,y=0x2)": NamedSolver("a.b:C", {"x": "1_0", "y": "0x2"}),  # no numbers anywhere else either
    "a.b:C(x=nan,y=-inf,z=1e999)": NamedSolver("a.b:C", {"x": "nan", "y": "-inf", "z": "1e999"}),
    f"a.b:C(x=1{'0' * 400},y=1{'0' * 5000})": NamedSolver("a.b:C", {"x": 10**400, "y": f"1{'0' * 5000}"}),
    "a.b:C()+polish": NamedSolver("a.b:C", {}, 1),
}


def test_what_is_said() -> None:
    for text, expected in READ.items():
        assert named_solver(text) == expected
        spec = parse_solver(text)
        assert (spec.label, spec.name, spec.settings, spec.polish_starts) == (
            *(text, expected.name, expected.settings),
            expected.polish_starts,
        )
    assert [type(value) for value in named_solver("a(x=1,y=1.0)").settings.values()] == [int, float]


def test_settings_of_the_same_solver_stay_those_of_another_go() -> None:
    before = {"c1": 2.0, "eta": 0.9}
    assert named_solver("bso(c1=1.5)").table("bso", before) == {"name": "bso", "settings": {"c1": 1.5, "eta": 0.9}}
    assert named_solver("pso(c1=1.5)+polish2").table("bso", before) == {
        **{"name": "pso", "settings": {"c1": 1.5}},
        "polish_starts": 2,
    }
    assert named_solver("pso").table("bso", before) == {"name": "pso"}


@pytest.mark.usefixtures("plugin")
def test_solve_reads_it_as_compare_does(capsys: pytest.CaptureFixture[str]) -> None:
    stated = "own_plugin:Own(step=0.25,population=9,word=b)+polish"
    assert main(["time-2", "--solver", stated, "--evaluations", "200", "--json", "--quiet"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["solver"] == {"name": "own_plugin:Own", "settings": {"population": 9, "step": 0.25, "word": "b"}}
    compared = parse_solver(stated).applied(tp.builtin("time-2"), 1)
    options = parser().parse_args(["time-2", "--solver", stated])
    for scenario in (with_options(tp.builtin("time-2"), options), tp.scenario_of("time-2", solver=stated)):
        assert scenario.solver.build() == compared.solver.build()
        assert (scenario.solver.polish_starts, compared.solver.polish_starts) == (1, 1)
    further = parser().parse_args(["time-2", "--solver", stated, "--polish-starts", "4", "--population", "12"])
    solver = with_options(tp.builtin("time-2"), further).solver
    assert (solver.polish_starts, solver.build().population) == (4, 12)  # type: ignore[union-attr]


UNREAD = {
    "bso(c1": "'bso(c1' is not NAME, NAME(setting=value) or NAME+polish",
    "bso(c1)": "'bso(c1)': 'c1' is not setting=value",
    "bso(=1)": "'bso(=1)': '=1' is not setting=value",
    "bso+polish0": "'bso+polish0': +polish needs a number of starts from 1 on",
    "bso,pso": "no solver 'bso,pso'; did you mean",
    "bso(c9=1)": "solver.settings.c9: bso has no such setting; did you mean c?",
    f"bso(c1=1{'0' * 400})": "solver.settings.c1: 1000",
    "bso(c1=1_0)": "solver.settings.c1: a number is needed, not '1_0'",
    "own_plugin:Own(stepp=1)": "solver.settings.stepp: own_plugin:Own has no such setting; did you mean step?",
    "own_plugin:Owns(step=1)": "own_plugin has no Owns; did you mean Own?",
    "ipopt+polish": "solver.polish_starts: ipopt has nothing to polish, it descends by itself",
}


@pytest.mark.usefixtures("plugin")
@pytest.mark.parametrize(("stated", "reason"), UNREAD.items(), ids=UNREAD)
def test_what_cannot_be_read_is_one_line(stated: str, reason: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert reason in refusal(capfd, main, "time-2", "--solver", stated)
    with pytest.raises(ScenarioError, match=re.escape(reason)):
        tp.plan("time-2", solver=stated)
