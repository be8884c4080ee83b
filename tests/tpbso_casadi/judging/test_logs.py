"""Logs for COCO and IOHprofiler: what they hold, read back by small parsers and the real readers."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tpbso_casadi.judging.logs import entries_of, falls_of, folder_names, grouped, write_coco, write_ioh
from tpbso_casadi.judging.targets import Convergence


def trace(solver: str = "bso", case: str = "sphere-2", seed: int = 1, **changes: object) -> Convergence:
    values = {
        "dimension": 2,
        "evaluations": np.array([30.0, 60.0, 90.0, 120.0]),
        "values": np.array([np.inf, 5.0, 5.0, 2.5]),
        "done": 130,
        "worst": 7.0,
        "optimum": 0.5,
    }
    return Convergence(**({"case": case, "solver": solver, "seed": seed} | values | changes))  # type: ignore[arg-type]


TRACES = [
    trace(solver, case, seed, dimension=dimension)
    for seed in (1, 2)
    for case, dimension in (("sphere-2", 2), ("time-3 (mine)", 6))
    for solver in ("bso", "bso(c1=1.5)")
]


def test_entries_by_hand() -> None:
    assert entries_of(trace()) == [(1, 7.0), (60, 5.0), (90, 5.0), (120, 2.5), (130, 2.5)]
    assert falls_of(trace()) == [(1, 7.0), (60, 5.0), (120, 2.5), (130, 2.5)]
    exact = trace(evaluations=np.array([1.0, 3.0]), values=np.array([4.0, 1.0]), done=3)
    assert entries_of(exact) == falls_of(exact) == [(1, 4.0), (3, 1.0)]
    assert entries_of(trace(values=np.full(4, np.inf))) == []
    assert grouped([trace(values=np.full(4, np.inf))]) == {}


def test_folder_names_are_plain_and_differ() -> None:
    names = folder_names(["bso", "bso(c1=1.5)", "bso(c1=1.5", "a/../b", "...", "mine:Solver"])
    assert list(names.values()) == ["bso", "bso_c1=1.5", "bso_c1=1.5~2", "a_.._b", "solver", "mine_Solver"]


def test_coco(tmp_path: Path) -> None:
    write_coco(tmp_path / "coco", TRACES)
    assert (tmp_path / "coco/cases.txt").read_text().splitlines() == [
        *("f1: sphere-2", "f2: time-3 (mine)"),
        *("bso: bso", "bso_c1=1.5: bso(c1=1.5)"),
    ]
    folder = tmp_path / "coco/bso_c1=1.5"
    head, comment, runs = (folder / "bbobexp_f2.info").read_text().splitlines()
    stated = dict(part.split(" = ") for part in head.split(", "))
    assert {key: ast.literal_eval(value) for key, value in stated.items()} == {
        "suite": "sbox-cost",
        "funcId": 2,
        "DIM": 6,
        "Precision": 1e-8,
        "algId": "bso(c1=1.5)",
        "logger": "bbob",
        "data_format": "bbob-new2",
    }
    assert comment == "% time-3 (mine)"
    assert runs == "data_f2/bbobexp_f2_DIM6.dat, 1:130|2.0e+00, 2:130|2.0e+00"
    for suffix, expected in (("dat", falls_of(trace())), ("tdat", entries_of(trace()))):
        blocks = re.split(r"^%.*\n", (folder / f"data_f2/bbobexp_f2_DIM6.{suffix}").read_text(), flags=re.MULTILINE)
        assert blocks[0] == ""
        assert len(blocks) == 3
        rows = np.loadtxt(blocks[1].splitlines())
        assert rows[:, 0].tolist() == [evaluations for evaluations, _ in expected]
        assert rows[:, 1].tolist() == [0.0] * len(expected)
        assert rows[:, 2] == pytest.approx([value - 0.5 for _, value in expected])
        assert rows[:, 4] == pytest.approx([value for _, value in expected])


IOH_KEYS = {  # what ioh 0.3.18 itself writes
    *("version", "suite", "function_id", "function_name", "maximization", "algorithm", "attributes", "scenarios")
}


def test_ioh(tmp_path: Path) -> None:
    write_ioh(tmp_path / "ioh", TRACES)
    assert sorted(path.name for path in (tmp_path / "ioh").iterdir()) == ["bso", "bso_c1=1.5"]
    folder = tmp_path / "ioh/bso"
    meta = json.loads((folder / "IOHprofiler_f2_time-3-mine-.json").read_text())
    assert set(meta) == IOH_KEYS
    assert (meta["function_id"], meta["maximization"], meta["algorithm"]["name"]) == (2, False, "bso")
    [scenario] = meta["scenarios"]
    assert scenario["dimension"] == 6
    run = {"instance": 1, "evals": 130, "best": {"evals": 120, "y": 2.5, "x": []}}
    assert scenario["runs"] == [run, run | {"instance": 2}]
    blocks = (folder / scenario["path"]).read_text().split("evaluations raw_y\n")
    assert blocks == ["", *2 * ["1 7.0\n60 5.0\n120 2.5\n130 2.5\n"]]


def keys(content: object) -> object:
    """The structure of JSON, values left out."""
    if isinstance(content, dict):
        return {key: keys(value) for key, value in content.items()}
    return [keys(content[0])] if isinstance(content, list) and content and isinstance(content[0], dict) else None


def test_ioh_has_the_structure_of_its_own_logger(tmp_path: Path) -> None:
    ioh = pytest.importorskip("ioh")
    logger = ioh.logger.Analyzer(root=str(tmp_path), folder_name="theirs", algorithm_name="a", algorithm_info="b")
    problem = ioh.get_problem("Sphere", instance=1, dimension=2, problem_class=ioh.ProblemClass.BBOB)
    problem.attach_logger(logger)
    for x in np.random.default_rng(1).uniform(-5.0, 5.0, (20, 2)):
        problem(x)
    problem.reset()
    logger.close()
    write_ioh(tmp_path / "ours", [trace()])
    [theirs], [ours] = (tmp_path / "theirs").glob("*.json"), (tmp_path / "ours/bso").glob("*.json")
    first, second = (json.loads(path.read_text()) for path in (theirs, ours))
    assert keys(first) == keys(second)
    assert first["attributes"] == second["attributes"]
    assert ours.name == theirs.name.replace("Sphere", "sphere-2")
    data = [path.parent / meta["scenarios"][0]["path"] for path, meta in ((theirs, first), (ours, second))]
    assert data[1].parent.name == data[0].parent.name.replace("Sphere", "sphere-2")
    assert data[0].read_text().splitlines()[0] == data[1].read_text().splitlines()[0]


@pytest.mark.process
@pytest.mark.slow
def test_cocopp_reads_the_logs(tmp_path: Path) -> None:
    pytest.importorskip("six")  # which cocopp needs
    pytest.importorskip("cocopp")
    write_coco(tmp_path / "coco", TRACES)
    command = [sys.executable, "-m", "cocopp", "-o", str(tmp_path / "out"), "bso", "bso_c1=1.5"]
    done = subprocess.run(command, cwd=tmp_path / "coco", capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    assert "ALL done" in done.stdout
    assert list((tmp_path / "out").glob("*/ppfigs_f002.svg"))
