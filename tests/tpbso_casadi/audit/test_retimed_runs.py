"""Audits of motions that are timed path by path: what is recomputed of them, and what an edit gives away."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.cli.commands.audit import main
from tpbso_casadi.figures import write_run
from tpbso_casadi.planning import PlannedMotion, plan
from tpbso_casadi.storage import sealed

ARM = {"link_lengths": [0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
MOVE = {
    "kind": "point-to-point",
    "start": {"joints": [0.1, 0.5, 0.5]},
    "goal": [[0.5, 1.0], [0.2, 1.1]],
    "via": [[0.9, 0.6]],
}
PATH = {"kind": "joint-path", "joints": [[0.0, 0.5, 0.5], [0.4, 0.9, 0.2], [0.8, 0.4, -0.3]]}


@cache
def planned(kind: str) -> PlannedMotion:
    """Of the paper's motion one that is retimed, one that gives way to the closed form; a move; a given path."""
    solver = {"name": "pso", "evaluations": 2000}
    if kind in {"same path", "free space"}:
        content = builtin("rotation-3" if kind == "same path" else "time-3").model_dump()
        content["model"] |= {"retime": True, "formulation": "reduced"}
        content["solver"] |= solver
    elif kind == "path":
        content = {"arm": ARM, "task": PATH}
    else:
        content = {"arm": ARM, "task": MOVE, "solver": solver | {"polish_starts": int(kind == "polished move")}}
    return plan(parse_scenario(content))


def folder_of(kind: str, tmp_path: Path) -> Path:
    write_run(tmp_path / "run", planned(kind), plots=False)
    return tmp_path / "run"


def edited(folder: Path, edit: Callable[[dict[str, Any]], object]) -> None:
    """Edit a result as somebody would who computes its seal anew."""
    content = json.loads((folder / "result.json").read_text())
    edit(content)
    (folder / "result.json").write_text(json.dumps(sealed({k: v for k, v in content.items() if k != "seal"})))


@pytest.mark.parametrize("kind", ["same path", "free space", "move", "polished move", "path"])
def test_all_of_them_are_certified_again(kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = folder_of(kind, tmp_path)
    assert main([str(folder), "--json"]) == 0
    audit = json.loads(capfd.readouterr().out)
    assert audit["certificate"]["verdict"] == "certified"
    assert (audit["optimality"] is None) == (kind == "path")
    assert main([str(folder)]) == 0


def test_vias_and_velocities_have_rows(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    main([str(folder_of("move", tmp_path)), "--json"])
    names = [c["name"] for c in json.loads(capfd.readouterr().out)["constraints"]]
    assert names[-5:] == ["start", "via 1", "goal", "start velocity", "goal velocity"]


def moved(pieces: dict[str, Any]) -> None:
    """The same motion, turned by a millionth of a radian in joint 2."""
    coefficients = np.array(pieces["coefficients"])
    coefficients[-1, :, 1] += 1e-6
    pieces["coefficients"] = coefficients.tolist()


EDITS: dict[str, tuple[str, Callable[[dict[str, Any]], object], str]] = {
    "the plan": ("same path", lambda r: moved(r["solution"]), ""),
    "the motion before": ("same path", lambda r: moved(r["retiming"]["motion"]), ""),
    "no motion before": ("same path", lambda r: r["retiming"].update(motion=None), "retiming"),
    "before": ("same path", lambda r: r["retiming"]["before"].update(duration=9.0), "retiming.before.duration"),
    "after": ("same path", lambda r: r["retiming"]["after"].update(objective=0.1), "retiming.after.objective"),
    "candidate": ("free space", lambda r: r["retiming"].update(candidate="same path"), "leaves its path"),
    "unknown candidate": ("same path", lambda r: r["retiming"].update(candidate="magic"), "retiming.candidate"),
    "not asked for": (
        "same path",
        lambda r: r["scenario"]["model"].update(retime=False),
        "retiming: the scenario asks",
    ),
    "removed": ("move", lambda r: r.pop("retiming"), "retiming: missing key"),
    "the path of a move": ("move", lambda r: moved(r["solution"]), ""),
    "the vector of a move": (
        "move",
        lambda r: r["solution"]["variables"][0].update(value=r["solution"]["variables"][0]["value"] + 1e-3),
        "",
    ),
    "the cost of a move": ("move", lambda r: r.update(cost=r["cost"] * 0.999), ""),
    "the velocity at an end": ("move", lambda r: r["scenario"]["task"].update(goal_velocity=[0.1, 0.0, 0.0]), ""),
    "a given path": (
        "path",
        lambda r: r["scenario"]["task"]["joints"][1].__setitem__(0, 0.4 + 1e-6),
        "constraints.path",
    ),
    "a search": ("path", lambda r: r.update(evaluations=10), "evaluations: 10 is stored, 0 is computed"),
    "a seed": ("path", lambda r: r.update(seed=1), "seed"),
    "a history": ("path", lambda r: r["history"].update(cost=[1.0], evaluations=[1]), "history"),
    "quantities": ("path", lambda r: r["solution"].update(quantities={"theta": [0.0]}), "solution.quantities"),
}


@pytest.mark.parametrize(("kind", "edit", "expected"), EDITS.values(), ids=EDITS)
def test_an_edit_is_refused_by_name(
    kind: str,
    edit: Callable[[dict[str, Any]], object],
    expected: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    folder = folder_of(kind, tmp_path)
    edited(folder, edit)
    assert main([str(folder)]) == 2
    error = capfd.readouterr().err
    assert error.count("\n") == 1
    assert expected in error
