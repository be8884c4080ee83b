"""A new shape is one class and one entry of a registry: a capsule in the plane, from a file and from Python."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, field
from math import pi
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import tpbso_casadi as tp
from problems.base import Angle, Coordinate, FloatArray, Length, Matrix
from problems.scene import OBSTACLES, crossing_clearance


@dataclass(frozen=True)
class PlaneCapsule(tp.Obstacle):
    """All points near a straight line in the plane."""

    center: tuple[Coordinate, Coordinate]
    length: Length
    radius: Length
    angle: Angle = 0.0

    @property
    def place(self) -> tuple[float, ...]:
        return self.center

    @property
    def width(self) -> float:
        return 2.0 * self.radius

    def contains(self, point: tuple[float, ...]) -> bool:
        return self.distance_of(point, point) <= 0.0

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        half = 0.5 * self.length * ca.horzcat(ca.cos(self.angle), ca.sin(self.angle))
        line = [ca.repmat(ca.horzcat(*self.center) + side * half, start.shape[0], 1) for side in (-1.0, 1.0)]
        return crossing_clearance((line[0], line[1]), (start, end)) - self.radius

    def distance_to(self, point: tuple[float, ...]) -> float:
        return max(0.0, self.distance_of(point, point))

    def outline(self, count: int = 96) -> FloatArray:
        phase = 2.0 * pi * np.arange(count) / count
        way = np.array([np.cos(self.angle), np.sin(self.angle)])
        around = np.column_stack([np.cos(phase), np.sin(phase)])
        return np.array(self.center) + self.radius * around + np.sign(around @ way)[:, None] * way * self.length / 2.0

    def bounding_box(self) -> FloatArray:
        half = np.abs([np.cos(self.angle), np.sin(self.angle)]) * self.length / 2.0 + self.radius
        return np.array(self.center) + np.array([-half, half])


ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0)
STILL = PlaneCapsule((1.5, 0.75), 0.3, 0.1)
MOVING = tp.MovingObstacle(PlaneCapsule((2.2, 1.2), 0.3, 0.1), tp.ConstantVelocity((0.1, 0.0)))
TASK: dict[str, Any] = {"start": [1.6, -0.6], "goal": [0.6, 1.6], "obstacles": [STILL, MOVING]}


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OBSTACLES, "capsule", PlaneCapsule)


@pytest.mark.usefixtures("registered")
def test_its_namesake_in_space_is_what_it_was() -> None:
    content: dict[str, Any] = tp.builtin("time-3").table()
    in_space = {"shape": "capsule", "center": [0.5, 0.5, 0.5], "length": 0.3, "radius": 0.1}
    in_plane = {"shape": "capsule", "center": [0.5, 0.5], "length": 0.3, "radius": 0.1}
    scenario = tp.parse_scenario(content | {"obstacles": [in_space, in_plane]})
    assert [type(table.build()) for table in scenario.obstacles] == [tp.Capsule, PlaneCapsule]
    assert pickle.loads(pickle.dumps(scenario)) == scenario
    for wrong, reason in (
        ({"radius": 0.0}, "radius: input should be greater than 0"),
        ({"lenght": 1.0}, "did you mean"),
    ):
        with pytest.raises(tp.ScenarioError, match=rf"^obstacles\.0\..*{reason}"):
            tp.parse_scenario(content | {"obstacles": [in_plane | wrong]})


@dataclass(frozen=True)
class Disc(tp.Ellipse):
    """A field with a default that is made."""

    semi_axes: tuple[Length, Length] = field(default_factory=lambda: (0.1, 0.1))


@dataclass(frozen=True)
class Taken(tp.Ellipse):
    """A field with the name of a key that every table has."""

    velocity: float = 1.0


@dataclass(frozen=True)
class Hidden(tp.Ellipse):
    """A field that no key can have."""

    _secret: float = 1.0


class NoDataclass(tp.Obstacle):
    """Nothing says what its keys are."""


def test_a_default_may_be_made() -> None:
    content: dict[str, Any] = tp.builtin("time-3").table()
    scenario = tp.parse_scenario(content | {"obstacles": [{"shape": f"{__name__}:Disc", "center": [1.5, 1.5]}]})
    assert scenario.criteria().obstacles == (Disc((1.5, 1.5)),)
    assert tp.parse_scenario(scenario.table()) == scenario


@pytest.mark.parametrize(
    "path", [f"{__name__}:{name}" for name in ("Taken", "Hidden", "NoDataclass")] + ["problems:MovingObstacle"]
)
def test_a_class_that_cannot_be_a_table_is_refused(path: str) -> None:
    content: dict[str, Any] = tp.builtin("time-3").table()
    with pytest.raises(tp.ScenarioError, match=r"is not a complete frozen dataclass derived from problems\.Obstacle"):
        tp.parse_scenario(content | {"obstacles": [{"shape": path, "center": [0.5, 1.5], "semi_axes": [0.1, 0.1]}]})


def test_python_plans_stores_and_audits_what_is_named_by_its_path(tmp_path: Path) -> None:
    plan = tp.plan(ARM, **TASK, solver="bso", evaluations=100, retime=False)
    assert plan.certified
    assert [table.shape for table in plan.scenario.obstacles] == [f"{__name__}:PlaneCapsule"] * 2
    assert plan.scenario.problem().criteria.obstacles == (STILL, MOVING)
    plan.save(tmp_path / "run", figures=())
    again = tp.read_run(tmp_path / "run")
    assert again.scenario == plan.scenario
    assert tp.audit(tmp_path / "run").certified


@pytest.mark.usefixtures("registered")
def test_python_states_it_by_its_name_where_it_has_one() -> None:
    scenario = tp.scenario_of(ARM, **TASK)
    assert [table.shape for table in scenario.obstacles] == ["capsule", "capsule"]
    assert scenario.problem().criteria.obstacles == (STILL, MOVING)
    assert pickle.loads(pickle.dumps(scenario)) == scenario
