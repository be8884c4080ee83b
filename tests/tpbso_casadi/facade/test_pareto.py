"""``tp.pareto``: a front of certified plans as an object."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp

ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0)
TASK: dict[str, Any] = {"start": [1.0, 0.0], "goal": [0.5, 1.5], "solver": "pso", "pieces": 3, "samples": 15}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pareto") / "front"


@pytest.fixture(scope="module")
def front(folder: Path) -> tp.Front:
    return tp.pareto(ARM, ("time", "rotation"), points=2, **TASK, evaluations=100, folder=folder)


def test_every_point_is_a_certified_plan_that_no_other_dominates(front: tp.Front) -> None:
    values = front.values
    assert len(front) == len(values) >= 2
    assert (np.diff(values[:, 0]) > 0.0).all()
    assert (np.diff(values[:, 1]) < 0.0).all()
    for plan, (time, rotation), point in zip(front.plans, values, front.points, strict=True):
        assert plan.certified
        assert plan.duration == pytest.approx(time, rel=1e-9)
        assert point.duration == plan.duration
        turned = np.abs(np.diff(plan.trajectory.at(np.linspace(0.0, plan.duration, 20_001)), axis=0)).sum()
        assert turned == pytest.approx(rotation, rel=1e-6)


def test_it_shows_itself(front: tp.Front) -> None:
    assert repr(front).startswith(f"<front: {len(front)} certified plans, time [s] ")
    page = front._repr_html_()
    assert page.count("<tr>") == 1 + len(front)
    assert "data:image/png" in page
    assert front.plot()._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]


def test_as_a_data_frame(front: tp.Front) -> None:
    pytest.importorskip("pandas")
    assert list(front.to_dataframe().columns) == ["point", "time [s]", "rotation [rad]", "duration [s]"]


def test_the_folder_keeps_it_and_resumes(front: tp.Front, folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} >= {"front.csv", "front.png", "points", "front.json"}
    made: list[Any] = []
    keys: dict[str, Any] = {"points": 2, **TASK, "evaluations": 100, "folder": folder, "told": made.append}
    again = tp.pareto(ARM, ("time", "rotation"), figures=["pdf", "svg"], **keys)
    assert {path.name for path in folder.glob("front.*")} >= {"front.pdf", "front.svg"}
    assert front.save(folder / "svg", figures=["svg"]).joinpath("front.svg").exists()
    assert not list((folder / "svg").glob("*.png"))
    assert made == []
    np.testing.assert_array_equal(again.values, front.values)
    with pytest.raises(tp.OutputError, match="was made with"):
        tp.pareto(ARM, ("time", "length"), **keys)


def test_a_front_in_which_nothing_is_certified_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = [tp.Rectangle((0.9, 0.9), (0.2, 0.2))]
    with pytest.raises(tp.ScenarioError, match="no plan is certified, not even at an end of the front"):
        tp.pareto("time-3", ("time", "rotation"), 2, obstacles=blocked, solver="pso", evaluations=8, population=4)


@pytest.mark.slow
def test_a_front_of_the_papers_motions_starts_from_plans_that_are_timed_anew() -> None:
    assert len(tp.pareto("time-3", ("time", "rotation"), 2, solver="pso", evaluations=100)) >= 2


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


def test_a_format_that_there_is_not_is_named(front: tp.Front, tmp_path: Path) -> None:
    for call in (lambda: tp.pareto(ARM, figures=["jpg"], **TASK), lambda: front.save(tmp_path, figures="jpg")):
        with pytest.raises(ValueError, match="figures: there is no kind 'jpg'; there are png, pdf, svg"):
            call()
    assert not list(tmp_path.iterdir())
