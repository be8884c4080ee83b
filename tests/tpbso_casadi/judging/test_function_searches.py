"""Searches of benchmark functions: what is recorded and stored of them, and that they are compared from Python."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.running import line_of

import tpbso_casadi as tp
from tpbso_casadi.judging.executors import run_one
from tpbso_casadi.judging.grid import function_grid, parse_solvers
from tpbso_casadi.judging.results import results_of
from tpbso_casadi.judging.searches import Recorder
from tpbso_casadi.judging.store import RunStore
from tpbso_casadi.plain import versions


def test_the_convergence_of_a_function_is_exact(tmp_path: Path) -> None:
    [spec] = parse_solvers("pso")
    [search] = runs = function_grid(["sphere-3"], [replace(spec, table={"evaluations": 200})], [1])
    with RunStore(tmp_path / "runs.sqlite") as store:
        store.add(search, run_one(*search.task))
        [(_, text)] = store.texts(runs)
        [convergence] = results_of(runs, store).convergences
    improvements = json.loads(text or "")["improvements"]
    assert convergence.evaluations.tolist() == improvements["evaluations"]
    assert convergence.values.tolist() == improvements["cost"]
    assert convergence.done == 200


def test_errors_from_python() -> None:
    calls: dict[str, Callable[[], object]] = {
        "time-2: a scenario beside benchmark functions": lambda: tp.compare(["function:sphere-2", "time-2"], "pso"),
        "goal: is of a scenario": lambda: tp.compare("function:sphere-2", "pso", goal=(1, 1)),
        "function:sphere-2: ipopt: IPOPT needs the": lambda: tp.compare("function:sphere-2", "ipopt"),
        "scenarios: function:sphere-2 is a benchmark function; say a list": lambda: tp.compare(
            {"a": "function:sphere-2"}, "pso"
        ),
    }
    for expected, call in calls.items():
        assert expected in line_of(call)


def test_every_improvement_is_recorded_at_its_evaluation() -> None:
    recorder = Recorder(lambda x: x[:, 0])
    for batch in ([5.0, 6.0, 3.0], [], [3.0, 1.0]):
        assert recorder(np.array(batch).reshape(-1, 1)).tolist() == batch
    assert (recorder.evaluations, recorder.values) == ([1, 3, 5], [5.0, 3.0, 1.0])


def test_what_is_stored_of_a_search() -> None:
    [search] = function_grid(["styblinski-tang-2"], parse_solvers("pso(population=20)"), [3])
    content = json.loads(run_one(*search.task).result or "")
    result = tp.minimize(tp.benchmark_function("styblinski-tang-2"), [(-5, 5)] * 2, "pso", 30_000, 3, population=20)
    assert content["x"] == result.x.tolist()
    assert content["objective"]["value"] == content["improvements"]["cost"][-1] == content["history"]["cost"][-1]
    assert content["minimum"]["value"] == pytest.approx(-78.3323314)
    assert 0.0 <= content["cost"] == pytest.approx(result.cost - content["minimum"]["value"], abs=1e-12)
    assert content["improvements"]["evaluations"][0] == 1


def test_the_key_of_a_run_knows_what_decides_it_and_no_label() -> None:
    specs = parse_solvers("pso,pso(population=100),pso(population=99)")
    keys = [search.key for search in function_grid(["sphere-2", "sphere-3"], specs, [1, 2])]
    assert keys[0] == keys[1]  # 100 is its default
    assert len(set(keys)) == 8


def test_a_run_that_fails_is_stored_as_such(tmp_path: Path) -> None:
    searches = function_grid(["sphere-2"], parse_solvers("helpers.campaign:Raises"), range(1, 30))
    search, outcome = next((s, o) for s in searches if (o := run_one(*s.task)).error)
    with RunStore(tmp_path / "store") as store:
        store.add(search, outcome)
        [record] = store.records([search])
    assert record.error == outcome.error != ""
    assert run_one(json.dumps(search.statement), versions() | {"numpy": "0"}).error.startswith("OtherVersions")
