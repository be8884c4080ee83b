"""``NAME(setting=value)+polish``: one reader of it for every place where a solver is named."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from helpers.running import refusal

import tpbso_casadi as tp
from tpbso_casadi.cli.commands.solve import main, parser, with_options
from tpbso_casadi.judging.grid import parse_solver
from tpbso_casadi.scenario import NamedSolver, ScenarioError, named_solver

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
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)


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
