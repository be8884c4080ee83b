"""Backends of evaluation from the command line: the same plan whatever evaluates it, and names that do not exist."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from helpers.evaluation import needs_compiler

from problems.evaluation import BACKENDS, population
from tpbso_casadi.cli.commands import solve

pytestmark = pytest.mark.usefixtures("cache_folder")


@needs_compiler
def test_a_plan_is_the_same_whatever_evaluates_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    results = []
    for backend in BACKENDS:
        arguments = ["time-2", "--evaluations", "3000", "--no-plots", "--quiet", "--backend", backend, "--out", backend]
        assert solve.main([*arguments, "--threads", "2"]) == 0
        result = json.loads((Path(backend) / "result.json").read_text())
        del result["seconds"], result["polish"]["seconds"], result["seal"]
        results.append(result)
    assert results[0] == results[1] == results[2]


def test_a_backend_that_does_not_exist(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv(population.VARIABLE, "gpu")
    assert solve.main(["time-2", "--json"]) == 2
    assert capsys.readouterr().err == "error: evaluation backend 'gpu' is none of auto, vm, native\n"
