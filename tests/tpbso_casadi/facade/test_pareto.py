"""``tp.pareto``: a front of certified plans as an object."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp

ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0)
TASK: dict[str, Any] = {"start": [1.0, 0.0], "goal": [0.5, 1.5]}


@cache
def front() -> tp.Front:
    return tp.pareto(ARM, ("time", "rotation"), points=3, **TASK, evaluations=100)


def test_every_point_is_a_certified_plan_that_no_other_dominates() -> None:
    values = front().values
    assert len(front()) == len(values) >= 2
    assert (np.diff(values[:, 0]) > 0.0).all()
    assert (np.diff(values[:, 1]) < 0.0).all()
    for plan, (time, rotation), point in zip(front().plans, values, front().points, strict=True):
        assert plan.certified
        assert plan.duration == pytest.approx(time, rel=1e-9)
        assert point.duration == plan.duration
        turned = np.abs(np.diff(plan.trajectory.at(np.linspace(0.0, plan.duration, 20_001)), axis=0)).sum()
        assert turned == pytest.approx(rotation, rel=1e-6)


def test_it_shows_itself() -> None:
    assert repr(front()).startswith(f"<front: {len(front())} certified plans, time [s] ")
    page = front()._repr_html_()
    assert page.count("<tr>") == 1 + len(front())
    assert "data:image/png" in page
    assert front().plot()._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]


def test_as_a_data_frame() -> None:
    pytest.importorskip("pandas")
    assert list(front().to_dataframe().columns) == ["point", "time [s]", "rotation [rad]", "duration [s]"]


def test_a_folder_keeps_it_and_resumes(tmp_path: Path) -> None:
    keys: dict[str, Any] = {"points": 2, **TASK, "evaluations": 100, "folder": tmp_path / "front"}
    made: list[Any] = []
    first = tp.pareto(ARM, ("time", "rotation"), **keys, told=made.append)
    assert {path.name for path in (tmp_path / "front").iterdir()} >= {"front.csv", "front.png", "points", "front.json"}
    number = len(made)
    again = tp.pareto(ARM, ("time", "rotation"), **keys, told=made.append)
    assert len(made) == number >= 2
    np.testing.assert_array_equal(again.values, first.values)
    with pytest.raises(tp.OutputError, match="was made with"):
        tp.pareto(ARM, ("time", "length"), **keys)


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda: tp.pareto("time-3", ("time", "tim")), "objectives: no objective 'tim'; did you mean time"),
        (lambda: tp.pareto("time-3", ("time",)), "objectives time: two different ones are needed"),
        (lambda: tp.pareto("time-3", ("time", "rotation"), method="x"), "method: .* is needed, not 'x'"),
        (lambda: tp.pareto("time-3", ("time", "rotation"), points=1), "points: 1 is not within 2 and 1000"),
        (lambda: tp.pareto("time-3", ("time", "energy")), "objective: 'energy' needs masses"),
    ],
)
def test_mistakes_take_one_line(call: Any, expected: str) -> None:
    with pytest.raises(tp.ScenarioError, match=f"^{expected}"):
        call()
