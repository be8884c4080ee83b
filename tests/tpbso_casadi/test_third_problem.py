"""A problem that only has what every problem must have is planned, drawn, animated, audited and compared."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from helpers.scenes import TWO_LINKS, toml
from helpers.third_problem import JointMove, JointMoveTask

from tpbso_casadi.cli.commands.audit import main as audit
from tpbso_casadi.cli.commands.solve import main as solve
from tpbso_casadi.scenario.tasks import TASKS
from tpbso_casadi.storage import read_run

TASK = {"kind": "joint-move", "start": [0.0, 0.5, 0.5], "goal": [1.5, -0.5, 0.2]}
BOX = {"shape": "box", "center": [-1.5, -1.0], "size": [0.4, 0.6], "angle": 0.3}


@pytest.fixture(autouse=True)
def registered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(TASKS, "joint-move", JointMoveTask)
    arm = TWO_LINKS | {"link_lengths": [1.0, 0.8, 0.7]}
    Path("move.toml").write_text(toml(arm=arm, task=TASK, obstacles=[BOX], solver={"evaluations": 200}))


def test_it_is_planned_polished_drawn_animated_and_audited(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve(["move.toml", "--polish", "--out", "run", "--animate", "run/move.html"]) == 0
    pictures = {path.name for path in Path("run").glob("*.png")}
    assert pictures == {"convergence.png", "path.png", "joints.png", "limits.png"}
    page = Path("run/move.html").read_text()
    data = re.search(r'<script type="application/json">(.*?)</script>', page)
    assert data is not None and json.loads(data[1])["points"] == []
    run = read_run(Path("run"))
    assert isinstance(run.motion.criteria.task, JointMove) and run.result.polish is not None
    assert audit(["run"]) == 0
    assert "certified" in capsys.readouterr().out
    assert audit(["move.toml"]) == 0
