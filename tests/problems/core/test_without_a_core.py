"""A machine without a core: what needs it is refused in one line that says how to get it, the plane is planned."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from helpers.space_scenarios import space_scenario

import tpbso_casadi as tp
from problems import CertificateStatus, Trajectory, library
from problems.certify import limit_verdicts, verification
from problems.core import core, found_core
from problems.core.world import _core_world, _known_world
from problems.library import SWITCH, NoCore, core_account, loaded_core
from problems.limits import TorqueLimit
from tpbso_casadi.cli.command import Exit, exit_code_of
from tpbso_casadi.display.plan_tables import remarks
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario

pytestmark = pytest.mark.usefixtures("cache_folder")
ROOT = Path(__file__).parents[3]
VERSION = '[ "$1" = --version ] && echo 1.0 && exit 0\n'
NONE = r"no C\+\+ compiler \(/nonexistent\) on PATH answers"
REFUSED = r"robot: arms in space need the compiled core: "


def forget() -> None:
    for known in (loaded_core, found_core, _known_world, _core_world):
        known.cache_clear()


@pytest.fixture(autouse=True)
def asked_anew() -> Iterator[None]:
    forget()
    yield
    forget()


@pytest.fixture
def without_a_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """No library came with the package either."""
    monkeypatch.delenv(SWITCH, raising=False)
    monkeypatch.setattr(library, "_packaged", list)
    monkeypatch.setenv("CXX", "/nonexistent")


@pytest.mark.usefixtures("without_a_compiler")
def test_an_arm_in_space_is_refused_in_one_line() -> None:
    assert found_core() is None
    assert re.fullmatch(f"none, as {NONE}", core_account())
    pattern = f"{REFUSED}{NONE}; install a C.. compiler .*pip install ziglang.* CXX"
    with pytest.raises(NoCore, match=f"^{pattern}$"):
        core()
    with pytest.raises(tp.ScenarioError, match=pattern):
        plan(parse_scenario(space_scenario(solver={"name": "direct", "evaluations": 300})))


@pytest.mark.usefixtures("without_a_compiler")
@pytest.mark.parametrize("limits", [{}, {"max_jerk": (400.0, 400.0)}], ids=["accelerations", "jerks"])
def test_a_path_in_the_plane_is_run_as_fast_as_with_a_core(
    limits: dict[str, tuple[float, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = np.array([[0.0, 0.0], [0.4, 0.9], [1.0, 0.6]])
    arm = tp.PlanarArm((1.0, 0.8), (3.0, 3.0), (20.0, 20.0), **limits)
    without = tp.retime(rows, arm)
    monkeypatch.undo()
    forget()
    assert without.duration == pytest.approx(tp.retime(rows, arm).duration, rel=1e-3)


@pytest.mark.usefixtures("without_a_compiler")
def test_a_proof_that_intervals_leave_open_says_how_to_get_a_core(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = tp.PlanarArm((1.0, 0.8), (3.0, 3.0), (20.0, 20.0), link_masses=(1.0, 1.0), max_torque=(50.0, 50.0))
    motion = Trajectory.standing(np.zeros(2), 1.0)
    [kept] = limit_verdicts([TorqueLimit(arm)], motion)
    assert (kept.status, kept.where) == (CertificateStatus.CERTIFIED, "joint 1, t = 0 s")
    monkeypatch.setattr(verification, "prove_by_cells", lambda *_: [kept.undecided_in(None)])
    [open_] = limit_verdicts([TorqueLimit(arm)], motion)
    assert open_.status is CertificateStatus.UNDECIDED
    assert re.search(f"; a sharper proof needs the compiled core: {NONE}; install a C.. compiler", open_.where)


@pytest.mark.usefixtures("without_a_compiler")
def test_a_motion_that_motors_slow_down_is_polished_in_the_plane(monkeypatch: pytest.MonkeyPatch) -> None:
    arm = tp.PlanarArm((0.5, 0.4), (6.0,) * 2, (60.0,) * 2, link_masses=(3.0, 1.5), max_torque=(30.0, 9.0))
    scenario = {"start": tp.Joints((0.2, -0.5)), "goal": tp.Joints((1.0, 0.6)), "solver": "pso", "evaluations": 600}
    without = tp.plan(arm, **scenario)
    assert any(re.search(f"need the compiled core: {NONE}; install", remark) for remark in remarks(without.planned))
    monkeypatch.undo()
    forget()
    assert without.certified
    assert without.duration == pytest.approx(tp.plan(arm, **scenario).duration, rel=3e-3)


@pytest.mark.usefixtures("without_a_compiler")
def test_a_command_that_needs_the_core_says_so_and_ends_with_its_status(capsys: pytest.CaptureFixture[str]) -> None:
    assert exit_code_of(lambda: bool(core()), (), "interrupted") == Exit.BAD_INPUT
    assert re.fullmatch(f"error: {REFUSED}{NONE}; install a C.. compiler .*\n", capsys.readouterr().err)


@pytest.mark.usefixtures("without_a_compiler")
@pytest.mark.parametrize("value", ["off", "OFF"])
def test_a_core_that_the_user_has_switched_off_is_not_to_be_installed(
    value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SWITCH, value)
    assert core_account() == f"none, as {SWITCH} is off"
    with pytest.raises(NoCore, match=f"{REFUSED}{SWITCH} is off$"):
        core()


@pytest.mark.usefixtures("without_a_compiler")
@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("echo no such flag >&2; exit 4", "compiler failed: no such flag"),
        ('for last; do :; done; echo "no library" > "$last"', "what was compiled cannot be loaded"),
    ],
    ids=["fails", "lies"],
)
def test_a_compiler_that_makes_no_core_is_named(
    script: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = tmp_path / "compiler"
    compiler.write_text(f"#!/bin/sh\n{VERSION}{script}\n")
    compiler.chmod(0o700)
    monkeypatch.setenv("CXX", str(compiler))
    assert core_account().endswith(reason)
    with pytest.raises(NoCore) as refused:
        core()
    assert reason in str(refused.value) and str(refused.value).isprintable()


@pytest.mark.process
def test_commands_without_a_core_end_with_one_line(tmp_path: Path) -> None:
    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "tpbso_casadi.solve", *arguments, "--no-plots", "--out", str(tmp_path / "out")],
            check=False, capture_output=True, text=True, timeout=300, cwd=ROOT,
            env=os.environ | {SWITCH: "off", "PYTHONPATH": str(ROOT)},
        )  # fmt: skip

    refused = run("examples/panda-cage.toml")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert re.fullmatch(rf".*{REFUSED}{SWITCH} is off\n", refused.stderr)
    assert not (tmp_path / "out").exists()
    assert run("time-3", "--evaluations", "200").returncode in {0, 1}
