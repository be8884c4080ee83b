"""Layouts: what is free and what it gives, what can be, and how it is searched and planned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from problems.base import FloatArray
from tpbso_casadi.layouts import (
    EvaluatedLayouts,
    Evaluation,
    LayoutEvaluator,
    LayoutSearch,
    LayoutTemplate,
    Record,
    header_of,
    planned_finalists,
    read_records,
    searched,
)
from tpbso_casadi.planning import SequenceGraph
from tpbso_casadi.scenario import LayoutSection, Scenario, ScenarioError, parse_stated

EXAMPLE = Path("examples/place-the-robot.toml")
FREE = [{"place": "pedestal", "x": [-0.3, 0.2]}, {"place": "bin", "y": [0.1, 0.5], "turn": [-np.pi, np.pi]}]


@pytest.fixture(scope="module")
def stated() -> Scenario:
    return tp.stated_scenario(EXAMPLE)


def template_of(stated: Scenario, **keys: Any) -> LayoutTemplate:
    table = {"free": FREE} | keys
    return LayoutTemplate(stated.replaced(layout=LayoutSection.from_table(table)))


def test_a_layout_moves_and_turns_what_is_free(stated: Scenario) -> None:
    template = template_of(stated)
    assert [each.name for each in template.variables] == ["pedestal x", "bin y", "bin turn"]
    placed = template.placed(np.array([0.1, 0.3, np.pi / 2.0]))
    pedestal, conveyor, bin_frame = placed.frames
    assert pedestal.position == (0.1, 0.0, 0.0)
    assert conveyor == stated.frames[1]
    assert bin_frame.position == (0.45, 0.3, 0.0)
    assert bin_frame.quaternion == pytest.approx((0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)))
    assert (
        template.described(template.values(np.array([0.1, 0.3, np.pi / 2.0])))
        == "pedestal: x 0.1000; bin: y 0.3000, turn 90.0"
    )
    world = template.scenario(np.array([0.1, 0.3, np.pi / 2.0]))
    left = next(each for each in world.obstacles if each.name == "bin left")
    assert left.pose[0] == pytest.approx((0.45 - 0.13, 0.3, 0.04))


def test_a_whole_turn_goes_round(stated: Scenario) -> None:
    *_, turn = template_of(stated).variables
    assert turn.goes_round and turn.bounds == pytest.approx((-1.5 * np.pi, 1.5 * np.pi))
    assert turn.value(np.pi + 0.2) == pytest.approx(-np.pi + 0.2, abs=1e-8)
    half = replace(turn, high=0.0)
    assert not half.goes_round and half.bounds == (-np.pi, 0.0)


def test_mountings_are_searched_one_by_one(stated: Scenario) -> None:
    upside_down = (1.0, 0.0, 0.0, 0.0)
    free = [{"place": "pedestal", "x": [-0.3, 0.2], "mountings": [[0.0, 0.0, 0.0, 1.0], upside_down]}]
    template = template_of(stated, free=free)
    assert len(template.mountings) == 2
    assert template.placed(np.zeros(1), 0).frames[0].quaternion == (0.0, 0.0, 0.0, 1.0)
    assert template.placed(np.zeros(1), 1).frames[0].quaternion == upside_down


@pytest.mark.parametrize("mounted", [None, [0.1, -0.2, 0.3, 0.9273618495495704]])
def test_the_base_sees_the_same_cell(stated: Scenario, mounted: list[float] | None) -> None:
    """Whatever the layout, with a base that leans too: the least cycle does not depend on who looks at it."""
    free: list[dict[str, Any]] = [
        {"place": "pedestal", "x": [-0.3, 0.2], "turn": [-3.0, 3.0], "mountings": [mounted] if mounted else []}
    ]
    template = template_of(stated, free=free)
    placed = template.placed(np.array([-0.05, 0.7]))
    world = placed.with_postures()
    seen = template.seen_from_base(placed, world)
    assert seen.robot is not None and seen.robot.base.position == (0.0, 0.0, 0.0)  # type: ignore[union-attr]
    graphs = []
    for scenario, digits in ((world, None), (seen, 9)):
        try:
            graphs.append(SequenceGraph(scenario, digits=digits).bound)
        except ScenarioError as error:
            graphs.append(str(error).partition(":")[0])  # type: ignore[arg-type]
    assert graphs[0] == pytest.approx(graphs[1], rel=1e-7) if isinstance(graphs[0], float) else graphs[0] == graphs[1]
    assert isinstance(graphs[0], float) or mounted is not None


def apart(one: str, other: str, distance: float) -> dict[str, Any]:
    return {"apart": [{"between": [one, other], "distance": distance}]}


@pytest.mark.parametrize(
    ("keys", "x", "why", "lack"),
    [
        ({}, [0.0, 0.35, 0.0], "", 0.0),
        (apart("conveyor", "bin", 0.8), [0.0, 0.35, 0.0], "conveyor and bin are 0.415 m", 1.385),
        (apart("robot", "post", 0.6), [0.0, 0.35, 0.0], "robot and post are", None),
        ({"free": [{"place": "pedestal", "x": [-3.0, 0.2]}]}, [-2.0], "task.start: ", 1.0),
        ({"free": [{"place": "bin", "x": [-0.3, 3.0]}]}, [2.0], "task.stages.3.goal: ", 2.0 / 3.0),
        ({"free": [{"place": "bin", "x": [-0.3, 3.0], "y": [-0.1, 0.4]}]}, [0.13, 0.0], "the robot's base is ", None),
    ],
)
def test_what_can_be_and_why_not(stated: Scenario, keys: Any, x: list[float], why: str, lack: float | None) -> None:
    found = LayoutEvaluator(template_of(stated, **keys))(np.array(x))
    assert found.why.startswith(why)
    assert np.isfinite(found.seconds) == (not why)
    assert found.cost == (found.seconds if not why else 1e6 * (1.0 + found.lack))
    if lack is not None:
        assert found.lack == pytest.approx(lack, abs=0.005)


def test_the_search_keeps_a_spare_distance(stated: Scenario) -> None:
    """A wall between which and the gripper, down in the bin, there is little more than nothing."""
    x = np.array([0.0, 0.35, 0.0])
    free = LayoutEvaluator(template_of(stated, spare=0.0))(x)
    assert LayoutEvaluator(template_of(stated, spare=0.2))(x).why
    assert free.seconds == pytest.approx(LayoutEvaluator(template_of(stated, spare=0.005))(x).seconds)


def test_the_evaluation_is_the_bound_of_the_same_cell(stated: Scenario) -> None:
    template, x = template_of(stated), np.array([0.0, 0.35, 0.0])
    assert LayoutEvaluator(template)(x).seconds == pytest.approx(tp.bound(template.scenario(x)).seconds, rel=2e-3)


class Sphere(LayoutEvaluator):
    """A cell whose least cycle is known."""

    def __call__(self, x: FloatArray, mounting: int = 0) -> Evaluation:
        if x[0] > 0.1:
            return Evaluation(np.inf, float(x[0]), "too far")
        return Evaluation(5.0 + mounting + float(((x - [0.05, 0.3, 0.5]) ** 2).sum()))


def test_a_search_finds_the_least_and_writes_all_down(stated: Scenario, tmp_path: Path) -> None:
    template = template_of(stated, evaluations=300, restarts=2, seed=3)
    with (tmp_path / "all.jsonl").open("w") as log, EvaluatedLayouts(Sphere(template), log=log) as layouts:
        log.write(header_of(template) + "\n")
        found = searched(layouts)
    assert len(found.results) == 2
    best = found.archive[0]
    assert (best.evaluation.seconds, best.mounting) == (pytest.approx(5.0, abs=1e-3), 0)
    known = read_records(tmp_path / "all.jsonl", template)
    assert [record.line() for record in known] == [record.line() for record in layouts.records]
    with EvaluatedLayouts(Sphere(template)) as again:
        again.remember(known)
        repeated = searched(again)
    assert len(again.records) == len(known)  # nothing is evaluated twice
    assert [each.line() for each in repeated.archive] == [each.line() for each in found.archive]
    few = template_of(stated, evaluations=5)
    with EvaluatedLayouts(Sphere(few)) as fewer:
        fewer.remember(known)
        assert searched(fewer).archive[0].line() == best.line()  # what was known before counts


@pytest.mark.process
def test_workers_change_nothing(stated: Scenario) -> None:
    template = template_of(stated, evaluations=24)
    found = []
    for workers in (1, 2):
        with EvaluatedLayouts(LayoutEvaluator(template), workers) as layouts:
            searched(layouts)
        found.append([record.line() for record in layouts.records])
    assert found[0] == found[1]


def test_records_of_another_cell_are_refused(stated: Scenario, tmp_path: Path) -> None:
    template, other = template_of(stated), template_of(stated, spare=0.02)
    path = tmp_path / "all.jsonl"
    assert read_records(path, template) == []
    line = Record(0, (0.1, 0.2, 0.3), Evaluation(np.inf, 0.5, "why")).line()
    path.write_text(f"{header_of(template)}\n{line}\n{line[:20]}")
    assert [record.line() for record in read_records(path, template)] == [line]  # the last was cut off
    assert header_of(template) == header_of(template_of(stated, evaluations=7, seed=9, solver="bso"))
    with pytest.raises(ScenarioError, match="of another cell"):
        read_records(path, other)
    path.write_text(f"{header_of(template)}\n{{}}\n{line}\n")
    with pytest.raises(ScenarioError, match="line 2: no evaluation"):
        read_records(path, template)


def planner(durations: dict[float, float | None]) -> Callable[[Scenario], Any]:
    """Plans by the x of the pedestal: their duration, or None where there is none."""

    def plan(scenario: Scenario) -> Any:
        assert scenario.robot is not None
        duration = durations[round(scenario.robot.base.position[0], 3)]  # type: ignore[union-attr]
        if duration is None:
            raise ScenarioError("task.stages.0: no motion")
        return SimpleNamespace(trajectory=SimpleNamespace(duration=duration), feasible=duration > 0.0)

    return plan


def test_what_was_planned_counts_and_the_next_is_taken_where_a_plan_is_much_longer(stated: Scenario) -> None:
    template = template_of(stated, free=[{"place": "pedestal", "x": [-0.3, 0.2]}], finalists=2)
    least = {-0.3: 5.0, -0.2: 5.1, -0.1: 5.2, 0.0: 5.3, 0.1: 5.4}
    archive = [Record(0, (x,), Evaluation(seconds)) for x, seconds in least.items()]
    durations = {-0.3: 6.0, -0.2: None, -0.1: 5.21, 0.0: 5.3, 0.1: 5.4}
    told: list[tuple[int, int]] = []
    found = planned_finalists(
        LayoutSearch(template, [], archive, 1.0), planner(durations), lambda *counts: told.append(counts)
    )
    assert [each.seconds for each in found] == [5.21, 5.3, 6.0, np.inf]
    assert [each.note for each in found] == [
        "",
        "",
        "20.0% above what the search counted with",
        "task.stages.0: no motion",
    ]
    assert told == [(0, 2), (0, 2), (1, 2), (2, 2)]


PLANAR = {
    "arm": {"link_lengths": [0.5, 0.5], "max_speed": 2.0, "max_acceleration": 9.0},
    "task": {"kind": "point-to-point", "start": [0.5, 0.5], "goal": [0.5, -0.5]},
}


def test_what_has_no_layout_is_refused(stated: Scenario) -> None:
    shelf = LayoutSection.from_table({"free": [{"place": "shelf", "x": [0, 1]}]})
    with pytest.raises(ScenarioError, match="layout: missing key"):
        LayoutTemplate(stated.replaced(layout=None))
    with pytest.raises(
        ScenarioError, match=r"layout.free.0.place: no frame is called 'shelf'; there are robot, pedestal"
    ):
        LayoutTemplate(stated.replaced(layout=shelf))
    with pytest.raises(ScenarioError, match=r'task\.kind: a layout is of a "sequence"'):
        LayoutTemplate(tp.parse_scenario(PLANAR).replaced(layout=shelf))


@pytest.mark.parametrize(
    ("table", "line"),
    [
        ({"free": []}, "free: "),
        ({"free": [{"place": "bin"}]}, "free.0.x: missing key; one of x, y, z and turn is free"),
        ({"free": [{"place": "bin", "x": [0.3, 0.1]}]}, "free.0.x: the first number has to be less"),
        ({"free": FREE, "apart": [{"between": ["bin"]}]}, "apart.0.between: "),
        ({"free": FREE, "evaluations": 0}, "evaluations: "),
        ({"free": FREE, "budget": 1}, "budget: unknown key"),
    ],
)
def test_tables_that_are_wrong(stated: Scenario, table: dict[str, Any], line: str) -> None:
    with pytest.raises(ScenarioError, match=rf"^layout\.{line}"):
        parse_stated(stated.table() | {"layout": table})


def test_an_unknown_solver_is_named(stated: Scenario) -> None:
    with (
        EvaluatedLayouts(Sphere(template_of(stated, solver="lishade"))) as layouts,
        pytest.raises(ScenarioError, match=r"layout\.solver: no solver 'lishade'; did you mean 'lshade'"),
    ):
        searched(layouts)


def test_a_record_is_a_line_of_json() -> None:
    line = Record(0, (1.0,), Evaluation(2.5)).line()
    assert line == '{"mounting": 0, "values": [1.0], "seconds": 2.5, "lack": 0.0}'
    assert Record.of(line, 1).line() == line
