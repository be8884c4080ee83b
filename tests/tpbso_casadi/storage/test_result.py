"""result.json is read as it was written, and all that is wrong is named; folders are replaced as a whole."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from problems.base import FloatArray
from solvers import Search, SearchBox, Solver
from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.plain import as_json, plain, settings_of
from tpbso_casadi.planning import PlannedMotion, plan
from tpbso_casadi.storage import (
    InvalidResult,
    InvalidRun,
    OutputError,
    RunResult,
    add_to_plan,
    read_run,
    result_of,
    sealed,
    write_plan,
)
from tpbso_casadi.storage import files as staging
from tpbso_casadi.storage.files import TEMPORARY, replacing

KINDS: dict[str, dict[str, Any]] = {
    "search": {"name": "pso", "evaluations": 1000},
    "polish": {"name": "pso", "evaluations": 1000, "polish_starts": 1},
    "ipopt": {"name": "ipopt", "iterations": 1},
    "plug-in": {"name": "my_module:Peculiar", "evaluations": 40},
}


class Colour(Enum):
    RED = "red"


@dataclass(frozen=True)
class Inner:
    rate: float = 0.5


@dataclass(frozen=True)
class Peculiar(Solver):
    """Settings of every type that a plug-in may have."""

    population: int = 10
    weights: tuple[float, ...] = (0.1, float("inf"))
    colour: Colour = Colour.RED
    inner: Inner = Inner()
    folder: Path = Path("here")
    table: FloatArray = field(default_factory=lambda: np.eye(2))
    function: Callable[[float], float] = abs

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterator[float]) -> Search:
        yield box.sample(rng, self.population)
        for _ in iterations:
            yield box.sample(rng, self.population)


@cache
def result(kind: str, case: str = "time-2") -> RunResult:
    content = builtin(case).table()
    content["model"]["formulation"] = "reduced"
    content["solver"] |= KINDS[kind]
    return result_of(plan(parse_scenario(content)))


@pytest.fixture(autouse=True)
def plug_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "my_module", SimpleNamespace(Peculiar=Peculiar))


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_read_again(kind: str) -> None:
    written = result(kind)
    text = written.to_json()
    read = RunResult.from_json(text)
    assert read == written
    assert read.to_json() == text
    assert ("polish" in json.loads(text)) == (kind == "polish")
    assert (read.solution.variables is None) == (kind == "ipopt")
    assert list(json.loads(text))[:5] == ["scenario", "solver", "seed", "objective", "cost"]


def test_settings_of_any_solver_fit() -> None:
    settings = result("plug-in").solver.settings
    assert settings == settings_of(Peculiar())
    assert settings["weights"] == [0.1, None] and settings["colour"] == "red" and settings["inner"] == {"rate": 0.5}
    assert settings["table"] == [[1.0, 0.0], [0.0, 1.0]] and settings["folder"] == "here"
    assert "abs" in settings["function"]


def test_a_number_that_is_not_finite_is_null() -> None:
    content = result("search").table()
    content["cost"] = float("inf")
    content["history"]["cost"][0] = float("nan")
    content["constraints"][0]["worst"] = float("-inf")
    odd = RunResult.from_table(content)
    assert (odd.cost, odd.history.cost[0], odd.constraints[0].worst) == (None, None, None)
    assert '"cost": null' in odd.to_json() and "NaN" not in odd.to_json() and "Infinity" not in odd.to_json()
    assert RunResult.from_json(odd.to_json()) == odd
    assert plain([np.float64(1.5), np.nan, {1: np.int64(2)}]) == [1.5, None, {"1": 2}]
    assert as_json({"a": float("inf")}, indent=None) == '{"a": null}\n'


def edited(path: str, value: object, seal: bool = False) -> str:
    """The text of a polished result with one key set, or removed where the value is ``...``; sealed again or not."""
    content = json.loads(result("polish").to_json())
    *keys, last = [int(key) if key.isdecimal() else key for key in path.split(".")]
    table: Any = content
    for key in keys:
        table = table[key]
    if value is ...:
        del table[last]
    else:
        table[last] = value
    if seal:
        content = sealed({key: value for key, value in content.items() if key != "seal"})
    return json.dumps(content)


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("feasibel", True, "unknown key; did you mean feasible?"),
        ("polish.before.objectiv", 1.0, "unknown key; did you mean objective?"),
        ("cost", ..., "missing key"),
        ("scenario.arm", ..., "missing key"),
        ("scenario.task.gaol", [1.0, 0.0], "unknown key; did you mean goal?"),
        ("scenario.arm.max_speed", -1.0, "input should be greater than 0, not -1.0"),
        ("scenario", "time-2", "a scenario is needed"),
        ("seed", -1, "input should be greater than or equal to 0, not -1"),
        ("constraints.0.status", "certain", "input should be 'certified', 'violated' or 'undecided', not 'certain'"),
        ("solution.coefficients.0.0", [1.0], "an array (order, pieces, joints) is needed"),
        ("solution.coefficients.0.0.0", float("nan"), "a finite number is needed, not nan"),
        ("solver.settings.c1", float("nan"), "holds a number that is not finite"),
        ("versions.casadi", 3, "a word is needed, not 3"),
    ],
)
def test_what_is_wrong_is_named(path: str, value: object, reason: str, tmp_path: Path) -> None:
    text = edited(path, value)
    with pytest.raises(InvalidResult) as caught:
        RunResult.from_json(text)
    key, _, message = str(caught.value).partition(": ")
    assert path.startswith(key) and message.startswith(reason), str(caught.value)
    if value is ... or "unknown" in reason:
        assert key == path
    (tmp_path / "result.json").write_text(text)
    with pytest.raises(InvalidRun) as refused:
        read_run(tmp_path)
    assert str(refused.value) == f"{tmp_path / 'result.json'}: {caught.value}"
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "null", '"text"', "[" * 100_000, '{"seed": ' + "1" * 5000 + "}"])
def test_what_is_no_result_at_all(text: str) -> None:
    with pytest.raises(InvalidResult) as caught:
        RunResult.from_json(text)
    assert "\n" not in str(caught.value)


def test_a_key_that_is_there_twice_is_refused() -> None:
    text = result("polish").to_json().replace('"feasible"', '"feasible": false, "feasible"', 1)
    with pytest.raises(InvalidResult, match="feasible: is there twice"):
        RunResult.from_json(text)


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("iterations", 10**6, "iterations: 1000000 with "),
        ("polish.starts", 50, "polish.starts: 50 where the scenario asks for 1"),
        ("rounds", 2, "rounds: one is all that the scenario asks for"),
        ("polish", ..., "polish: missing key"),
        ("objective.unit", "h", "objective.unit: 'h' is stored, 's' is computed"),
        ("solver.settings.c1", 1.0, "solver.settings.c1: 1.0 is stored"),
        ("history.cost.0", 0.0, "history.cost: the best so far grows"),
        ("versions", {}, "versions.python: missing key"),
        ("polish.before.objective", 9.0, "polish.before.objective: 9.0 is stored"),
        ("files", {"../result.json": ""}, "files."),
        ("seed", 7, "seed: 7 is stored, 1 is computed"),
        ("solver.name", "bso", "solver.name: 'bso' is stored, 'pso' is computed"),
        ("constraints.0.bound", 5.0, "constraints.speed.bound: 5.0 is stored"),
        ("constraints.0.worst", None, "constraints.speed.worst: None is stored"),
        ("constraints.0.satisfied", False, "constraints.speed.satisfied: False is stored"),
        ("constraints.0.name", "pace", "constraints: ['pace', "),
        ("certificate.verdict", "undecided", "certificate.verdict: 'undecided' is stored, 'certified' is computed"),
        ("scenario.task.goal", [9.0, 9.0], "scenario.task.goal: (9.0, 9.0) is 12.7279 m from the base"),
    ],
)
def test_what_contradicts_a_recomputation_is_named(path: str, value: object, reason: str, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(edited(path, value, seal=True))
    with pytest.raises(InvalidRun) as refused:
        read_run(tmp_path)
    assert str(refused.value).startswith(f"{tmp_path / 'result.json'}: {reason}"), str(refused.value)


def leaves(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """The paths of all keys, and of the first and last entry of every list."""
    keys = list(value) if isinstance(value, dict) else sorted({0, len(value) - 1}) if isinstance(value, list) else []
    for key in keys if value else []:
        yield (*path, key)
        yield from leaves(value[key], (*path, key))


def other(value: Any) -> Any:
    """Another value of the same kind."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return value + 1
    if isinstance(value, list):
        return value[:-1]
    return {} if isinstance(value, dict) else f"{value}x"


def test_every_key_that_is_edited_or_removed_is_refused_by_name() -> None:
    text = result("polish").to_json()
    document, edits = json.loads(text), 0
    for path in leaves(document):
        for removed in (False, True):
            content = json.loads(text)
            table = content
            for key in path[:-1]:
                table = table[key]
            if removed:
                del table[path[-1]]
            else:
                table[path[-1]] = other(table[path[-1]])
            if content == document:
                continue
            with pytest.raises(InvalidResult) as caught:
                RunResult.from_json(json.dumps(content))
            name = next(key for key in reversed(path) if isinstance(key, str))
            assert path[0] == "seal" or name in str(caught.value), (path, str(caught.value))
            edits += 1
    assert edits > 300


@cache
def planned() -> PlannedMotion:
    return plan(parse_scenario(builtin("time-2").table() | {"solver": {"evaluations": 500}}))


def test_a_folder_is_read_as_it_was_written(tmp_path: Path) -> None:
    solution = planned()
    write_plan(tmp_path, solution)
    run = read_run(tmp_path)
    assert run.result.replaced(files={}) == result_of(solution)
    assert set(run.result.files) == {"trajectory.csv"}
    assert run.scenario == solution.scenario
    np.testing.assert_array_equal(run.motion.trajectory.coefficients, solution.trajectory.coefficients)


@pytest.mark.parametrize(
    ("failure", "reason"),
    [
        (OSError(28, "No space left on device"), "No space left"),
        (OutputError("no film"), "the run is written, but not all of its files: no film"),
        (KeyError(1), "1"),
    ],
)
def test_a_file_that_cannot_be_written_does_not_lose_the_plan(failure: Exception, reason: str, tmp_path: Path) -> None:
    def fail(folder: Path) -> None:
        (folder / f"{TEMPORARY}half.png").write_text("half")
        raise failure

    with pytest.raises((OutputError, KeyError), match=reason):
        write_plan(tmp_path / "run", planned(), further=[fail])
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == ["result.json", "trajectory.csv"]
    assert read_run(tmp_path / "run").result.feasible == planned().feasible


def test_figures_are_not_put_beside_another_plan_of_the_same_scenario(tmp_path: Path) -> None:
    one, folder = planned(), tmp_path / "run"
    slower = replace(one, motion=replace(one.motion, trajectory=one.trajectory.time_scaled(2.0)))
    write_plan(folder, one)
    write_plan(folder, slower)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(OutputError, match="another run was written there meanwhile"):
        add_to_plan(folder, one, [lambda staged: (staged / "path.png").write_text("figure")])
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    with pytest.raises(OutputError, match="another run was written there meanwhile"):
        add_to_plan(tmp_path / "none", one)
    assert not (tmp_path / "none").exists()


# Folders that are replaced as a whole


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def write(folder: Path, *files: str) -> None:
    with replacing(folder) as staged:
        for file in files:
            (staged / file).write_text(file)


@pytest.mark.parametrize("exchangeable", [True, False], ids=["exchanged", "renamed twice"])
def test_a_folder_is_replaced(exchangeable: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not exchangeable:
        monkeypatch.setattr(staging, "_exchange", lambda one, other: False)
    folder = tmp_path / "deep" / "run"
    write(folder, "a", "b")
    write(folder, "b", "c")
    assert names(folder) == ["b", "c"]
    assert names(folder.parent) == ["run"]


def test_a_failure_leaves_it_as_it_was_and_until_it_is_complete_the_old_one_is_seen(tmp_path: Path) -> None:
    write(tmp_path / "run", "a")
    with pytest.raises(OSError, match="full"), replacing(tmp_path / "run") as staged:
        (staged / "b").write_text("half")
        assert names(tmp_path / "run") == ["a"]
        raise OSError("full")
    assert (names(tmp_path / "run"), names(tmp_path)) == (["a"], ["run"])


def test_a_link_to_a_folder_stays_a_link_and_permissions_are_those_of_any_new_folder(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "other").mkdir()
    (tmp_path / "run").symlink_to(tmp_path / "there")
    write(tmp_path / "run", "a")
    assert (tmp_path / "run").is_symlink()
    assert names(tmp_path / "there") == ["a"]
    assert (tmp_path / "there").stat().st_mode == (tmp_path / "other").stat().st_mode


@pytest.mark.process
def test_what_a_killed_process_left_is_removed(tmp_path: Path) -> None:
    child = os.fork()
    if not child:
        with replacing(tmp_path / "run"):
            os._exit(0)
    os.waitpid(child, 0)
    assert len(names(tmp_path)) == 1
    with replacing(tmp_path / "run") as staged:
        assert names(tmp_path) == [staged.name]  # of this process, which is alive
        write(tmp_path / "run", "a")
        assert staged.exists()
    assert names(tmp_path) == ["run"]
