"""Single values among the arguments, and objectives without a value, are refused in one line that names them."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.cli.commands import solve
from tpbso_casadi.facade.plan import Plan

ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0)
TASK: dict[str, Any] = {"start": [1.0, 0.0], "goal": [0.5, 1.5], "evaluations": 50, "polish": False}
ANY: Any = None  # what a type checker would refuse


@pytest.fixture(scope="module")
def plan() -> Plan:
    return tp.plan(ARM, **TASK)


OF_A_PLAN: list[tuple[Callable[[Plan], object], type[Exception], str]] = [
    (lambda plan: plan.to_numpy(ANY or 3), ValueError, r"times: numbers \(n,\) are needed, in s, not an array of sh"),
    (lambda plan: plan.to_numpy(np.zeros((2, 2))), ValueError, r"times: numbers \(n,\) .* shape \(2, 2\)"),
    (lambda plan: plan.to_numpy(ANY or ["a"]), ValueError, r"times: numbers \(n,\) are needed, in s, not \['a'\]"),
    (lambda plan: plan.to_numpy(np.array([0.0, 99.0])), ValueError, r"times: 99 s is not within the motion, 0 to"),
    (lambda plan: plan.to_numpy(np.array([np.nan])), ValueError, r"times: nan s is not within the motion"),
    (lambda plan: plan.to_dataframe(np.array([-1.0])), ValueError, r"times: -1 s is not within the motion"),
    (lambda plan: plan.trajectory(99.0), ValueError, r"times: 99 s is not within the motion, 0 to"),
    (lambda plan: plan.trajectory(0.1, 7), ValueError, r"derivative: 7 is none; there are those from 0 to 4"),
    (lambda plan: plan.trajectory(0.1, ANY or "a"), ValueError, r"derivative: a is none"),
    (lambda plan: plan.animate(ANY), TypeError, r"path: a path is needed, .*, not None"),
    (lambda plan: plan.save(ANY), TypeError, r"folder: a path is needed, .*, not None"),
    (lambda plan: plan.save("never", figures=ANY), ValueError, r"figures: kinds are needed, of png, .*; not None"),
    (lambda plan: plan.save("never", figures=ANY or [["png"]]), ValueError, r"figures: there is no kind \['png'\]"),
    (lambda plan: plan.save("never", rate=ANY or "a"), ValueError, r"rate: a number above 0 is needed, in Hz, not 'a'"),
    (lambda plan: plan.save("never", rate=0), ValueError, r"rate: a number above 0 is needed, in Hz, not 0"),
    (lambda plan: plan.save("never", rate=np.nan), ValueError, r"rate: .* not nan"),
    (lambda plan: plan.save("never", ["csv"], rate=1e9), tp.OutputError, r"rate 1e\+09: makes more than 200000 rows"),
    (lambda plan: plan.player(height=-5), ValueError, r"height: a number above 0 is needed, in pixels, not -5"),
    (lambda plan: plan.player(height=ANY or "a"), ValueError, r"height: .* not 'a'"),
]


@pytest.mark.parametrize(("call", "error", "message"), OF_A_PLAN, ids=[message[:40] for _, _, message in OF_A_PLAN])
def test_values_for_a_plan(
    plan: Plan, call: Callable[[Plan], object], error: type[Exception], message: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    with pytest.raises(error, match=f"^{message}") as caught:
        call(plan)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_times_that_are_outside_by_rounding_are_ends(plan: Plan) -> None:
    beyond = np.array([-1e-13, plan.duration * (1.0 + 1e-13)])
    ends = np.array([0.0, plan.duration])
    np.testing.assert_array_equal(plan.trajectory(beyond), plan.trajectory.at(ends))
    np.testing.assert_array_equal(plan.to_numpy(beyond)["t"], ends)
    np.testing.assert_array_equal(plan.trajectory(0.1, 1), plan.trajectory.at(np.array(0.1), 1))


def scenario(**keys: Any) -> Callable[[], object]:
    return lambda: tp.scenario_of(ARM, **TASK | keys)


def limited(expression: Callable[[Any], Any], **bounds: Any) -> Callable[[], object]:
    return scenario(constraints=tp.Constraint(expression, **bounds))


CALLS: list[tuple[Callable[[], object], type[Exception], str]] = [
    (scenario(polish="yes"), ValueError, r"polish: True, False or a whole number is needed, not 'yes'"),
    (lambda: tp.plan(ARM, **TASK, progress=ANY or 3), TypeError, r"progress: a tp\.Progress is needed, not 3"),
    (lambda: tp.compare("time-3", progress=ANY or 3), TypeError, r"progress: a function is needed, not 3"),
    (lambda: tp.read_run(ANY), TypeError, r"folder: a path is needed, .*, not None"),
    (lambda: tp.plan(ANY), ValueError, r"what: a scenario, its file \(\.toml\) or its name, a task .* not None"),
    (lambda: tp.plan(ANY or {"arm": 3}), ValueError, r"what: a scenario, .* is needed, not \{'arm': 3\}"),
    (lambda: tp.audit(ANY or 3), ValueError, r"what: a plan, the folder of a run, a scenario, .* is needed, not 3"),
    (lambda: tp.compare(ANY), ValueError, r"scenarios: a scenario, its file .* is needed, not None"),
    (lambda: tp.compare(ANY or {"a": None}), ValueError, r"scenarios: a scenario, its file .* is needed, not None"),
    (
        lambda: tp.robot([1.0, 1.0], max_speed=[1, 2, 3], max_acceleration=1.0).model,
        ValueError,
        r"max_speed: 3 values for 2 links",
    ),
    (limited(lambda m: math.sin(m.q[0]), lower=0.0), ValueError, r"constraint .* say ca\.sin in place of math\.sin"),
    (limited(lambda m: m.q[7], lower=0.0), ValueError, r"constraint 'constraint': an index is out .* 3 in all"),
    (limited(lambda m: m.q[-4], lower=0.0), ValueError, r"constraint 'constraint': an index is out .* 3 joints"),
    (limited(lambda m: m.q[0], lower=-np.inf), ValueError, r"constraints\[0\]: .* has no bounds: say lower, upper"),
    (limited(lambda m: m.q[0], lower=np.inf), ValueError, r"constraints\[0\] lower: a finite number is needed"),
    (scenario(path=[[1.0, 0.2], [np.nan, 0.6]], accuracy=0.1), ValueError, r"path\[1\]\[0\]: a finite number is need"),
]


@pytest.mark.parametrize(("call", "error", "message"), CALLS, ids=[message[:40] for _, _, message in CALLS])
def test_values_of_calls(call: Callable[[], object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=f"^{message}") as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("none", [-np.inf, None, [-np.inf, -np.inf], np.full(2, -np.inf)])
def test_a_bound_at_infinity_is_none(none: Any) -> None:
    def stated(lower: Any, upper: Any) -> Any:
        limit = tp.Constraint(lambda m: m.tool, lower, upper)
        return tp.scenario_of(ARM, **TASK, constraints=limit).model.constraints[0]

    assert stated(none, 2.0) == stated(None, 2.0)
    assert stated(2.0, None if none is None else -np.asarray(none)) == stated(2.0, None)


UNDEFINED = tp.Cost(lambda m: ca.sqrt(m.q[0] - 100.0))


def test_an_objective_without_a_value_is_no_plan() -> None:
    with pytest.raises(tp.ScenarioError, match=r"^objective: 'cost' is undefined \(nan\) along the motion"):
        tp.plan(ARM, **TASK, objective=UNDEFINED)


def test_a_motion_that_breaks_limits_says_that_its_cost_is_undefined() -> None:
    never = tp.Constraint(lambda m: m.q[0] - m.q[0] + m.time * 0.0 + 1.0, upper=-1.0, name="never")
    plan = tp.plan(ARM, **TASK, objective=UNDEFINED, constraints=never)
    assert not plan.certified
    assert repr(plan).startswith("<plan: cost is undefined, violated, T = ")


def test_a_command_says_so_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = tmp_path / "arm.toml", tmp_path / "run"
    file.write_text(
        "[arm]\nlink_lengths = [0.7, 0.7, 0.6]\nmax_speed = 4.0\nmax_acceleration = 20.0\n"
        '[task]\nkind = "point-to-point"\nstart = [1.0, 0.0]\ngoal = [0.5, 1.5]\nobjective = "cost"\n'
        '[[task.objectives]]\nname = "cost"\nexpression = """w0 = sub(q[0], 100.0)\nw1 = sqrt(w0)\n= w1"""\n'
        "[solver]\nevaluations = 50\npolish_starts = 0\n"
    )
    assert solve.main([str(file), "--out", str(out), "--no-plots"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert "task.objective: 'cost' is undefined (nan) along the motion that was found" in said[0]
    assert not out.exists()
