"""A plan as Python code and a notebook meet it; the public names."""

from __future__ import annotations

import csv
import inspect
import json
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi import api
from tpbso_casadi.cli.commands import audit as audit_command
from tpbso_casadi.facade import showing as data_frames
from tpbso_casadi.facade.plan import Player
from tpbso_casadi.figures.run import drawings_of

ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0)
TASK: dict[str, Any] = {"start": [1.0, 0.0], "goal": [0.5, 1.5]}
LONGEST = 200  # characters of a short form


@cache
def planned() -> tp.Plan:
    return tp.plan(ARM, **TASK, evaluations=300)


@cache
def paper() -> tp.Plan:
    return tp.plan("time-3", solver="pso", evaluations=300, polish=False)


def test_it_prints_itself_in_a_line() -> None:
    plan = planned()
    assert repr(plan) == f"<plan: time {plan.duration:.6g} s, certified, T = {plan.duration:.4g} s>"
    weighted = tp.plan(ARM, **TASK, objective={"time": 1.0, "rotation": 0.1}, evaluations=200, polish=False)
    assert f"time {weighted.duration:.6g} s, rotation " in repr(weighted)


def test_everything_that_a_user_meets_is_short() -> None:
    plan = planned()
    things = [
        ARM, plan, plan.scenario, plan.planned, plan.motion, plan.trajectory, plan.search, plan.result, plan.audit(),
        plan.player(), tp.robot("panda"), tp.robot("panda").model, plan.verdicts[0], tp.builtin("pentagram-time"),
    ]  # fmt: skip
    for thing in things:
        assert len(repr(thing)) <= LONGEST, type(thing)
        assert "\n" not in repr(thing)
    for thing in (plan.scenario, plan.result):
        assert str(thing) == repr(thing)


def test_a_notebook_shows_picture_and_verdicts() -> None:
    page = planned()._repr_html_()
    assert page.count("<img ") == 1
    assert "data:image/png;base64,iVBOR" in page
    assert page.count("certified") == 1 + len(planned().verdicts)
    for verdict in planned().verdicts:
        assert verdict.name in page


def test_kinds_of_figures_are_drawn_and_saved(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    kinds = drawings_of(planned().planned)
    assert {"path", "joints", "limits", "convergence"} == set(kinds)
    monkeypatch.setattr("tpbso_casadi.figures.run.drawings_of", lambda plan: {"limits": kinds["limits"]})
    assert {path.name for path in planned().save(tmp_path / "run", figures="svg").glob("*.svg")} == {"limits.svg"}
    assert planned().plot("limits")._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]


def test_numbers_come_out_as_arrays_and_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = planned()
    columns = plan.to_numpy(np.array([0.0, plan.duration]))
    np.testing.assert_array_equal(columns["t"], [0.0, plan.duration])
    np.testing.assert_allclose([columns["x"], columns["y"]], [[1.0, 0.5], [0.0, 1.5]], atol=1e-8)
    np.testing.assert_array_equal(plan.trajectory(plan.times)[:, 1], plan.to_numpy()["q2"])
    frame = plan.to_dataframe()
    assert (list(frame.columns), len(frame)) == (list(plan.to_numpy()), len(plan.times))
    monkeypatch.setattr(data_frames, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=r"pip install 'tpbso-casadi\[pandas\]'"):
        plan.to_dataframe()


def test_a_player_is_a_page_in_a_frame_or_a_file(tmp_path: Path) -> None:
    player = planned().player(height=300)
    assert isinstance(player, Player)
    shown = player._repr_html_()
    assert shown.startswith("<iframe ")
    assert "height: 300px" in shown
    assert "<" not in shown.split('srcdoc="')[1].split('"')[0]
    assert player.page.startswith("<!DOCTYPE html>")
    assert "<canvas" in planned().animate(tmp_path / "motion.html").read_text()


def test_a_run_is_saved_read_and_saved_again(tmp_path: Path) -> None:
    plan = planned()
    first = plan.save(tmp_path / "first", export=["csv", "ros-json"], figures=(), rate=50.0)
    assert {path.name for path in first.iterdir()} == {
        "result.json", "trajectory.csv", "joint_trajectory.csv", "joint_trajectory.json"
    }  # fmt: skip
    with (first / "joint_trajectory.csv").open() as file:
        assert float(list(csv.DictReader(file))[1]["t"]) == pytest.approx(0.02)
    again = tp.read_run(first)
    assert repr(again) == repr(plan)
    assert again.result.history == plan.result.history
    assert again.search is None
    second = again.save(tmp_path / "second", figures=())
    assert (second / "trajectory.csv").read_bytes() == (first / "trajectory.csv").read_bytes()
    assert tp.read_run(second).audit().constraints == plan.audit().constraints


@pytest.mark.optimum
@pytest.mark.parametrize("make", [pytest.param(planned, marks=pytest.mark.slow), paper])
def test_the_audit_of_a_plan_is_that_of_its_folder(
    make: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    plan = make()
    own = plan.audit()
    assert audit_command.main([str(plan.save(tmp_path / "run", figures=())), "--json"]) == 0
    command = json.loads(capfd.readouterr().out)
    ranking = (command["optimum"] or {"ranking": []})["ranking"]
    assert own.constraints == command["constraints"]
    assert [price["constraint"] for price in own.shadow_prices] == [price["constraint"] for price in ranking]
    assert (own.certified, own.status) == (plan.certified, plan.status)
    assert str(own).splitlines()[0].startswith("certified in ")
    assert all(each["name"] in own._repr_html_() for each in own.constraints)
    assert (own.optimum is None) == ("the nearest optimum, as a motion of its own" not in own._repr_html_())


def test_the_audit_of_a_scenario() -> None:
    audit = tp.audit("time-3")
    assert isinstance(audit, tp.ScenarioAudit)
    assert audit.impossible == []
    assert "search model: " in str(audit)
    assert audit.constraints[0]["name"] in audit._repr_html_()
    assert repr(audit).startswith("<audit of a scenario: ")


def documented_parts(kind: type) -> Iterator[tuple[str, Any]]:
    """What a class of ours, or one that it is derived from, offers."""
    for base in kind.__mro__:
        if base.__module__.split(".")[0] in ("problems", "solvers", "tpbso_casadi"):
            for name, value in vars(base).items():
                is_part = isinstance(value, (property, classmethod, staticmethod)) or inspect.isfunction(value)
                if is_part and not name.startswith("_"):
                    yield name, getattr(kind, name) if not isinstance(value, property) else value


def test_public_names_say_what_they_are_and_what_their_arguments_are() -> None:
    for name in api.__all__:
        thing = getattr(tp, name)
        if not (inspect.isclass(thing) or inspect.isfunction(thing)):
            continue  # a table of names, or a type
        text = inspect.getdoc(thing)
        assert text, name
        if isinstance(thing, type):
            assert [part for part, value in documented_parts(thing) if not inspect.getdoc(value)] == [], name
        else:
            arguments = [key for key in inspect.signature(thing).parameters if key not in ("content", "folder", "plan")]
            assert len(arguments) < 2 or all(f"{key}:" in text for key in arguments), (name, arguments)


@pytest.mark.process
def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, tpbso_casadi; print([n for n in ('casadi', 'matplotlib', 'pandas') if n in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
