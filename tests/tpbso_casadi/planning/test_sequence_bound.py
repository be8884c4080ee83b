"""Bounds of sequences: in all turns of the joints, along ways that are timed at a few points before they are chosen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from problems import InvalidProblem
from problems.base import FloatArray
from problems.robots import built_in
from tpbso_casadi.planning.sequence_graph import SURELY_LESS, SequenceGraph
from tpbso_casadi.planning.ways import ToolWay, least_times, ways_from
from tpbso_casadi.scenario import LedStage, load

DOWN = (1.0, 0.0, 0.0, 0.0)
PANDA = tp.robot("panda", tip_link="panda_hand_tcp")
CELLS = [Path("examples") / f"{name}.toml" for name in ("pick-and-place", "pick-and-place-ur5e")]


@pytest.mark.parametrize("turn", [0.0, 0.75 * np.pi, np.pi])
def test_turning_the_base_changes_nothing(turn: float) -> None:
    """Joints that turn more than once are taken in the turns that are reached soonest, wherever their zero is."""
    places = [(0.47, 0.25, 0.29), (0.55, -0.3, 0.17), (0.6, 0.1, 0.2), (0.45, -0.1, 0.25)]
    visits = [tp.MoveTo(tp.Pose(place, DOWN)) for place in (*places[1:], places[0])]
    down, up = tp.Line(by=(0.0, 0.0, -0.1)), tp.Line(by=(0.0, 0.0, 0.1))
    stages = [stage for visit in visits[:-1] for stage in (visit, down, up)]
    base = {"quaternion": [0.0, 0.0, np.sin(turn / 2.0), np.cos(turn / 2.0)]}
    found = tp.bound(
        tp.robot("ur5e", base=base), start=tp.Pose(places[0], DOWN), stages=[*stages, visits[-1]], cyclic=True
    )
    assert found.seconds == pytest.approx(6.68218461, rel=1e-6)


def test_where_there_is_no_way_the_bound_says_why() -> None:
    arm, start = tp.robot("ur5e"), tp.Pose((0.4, 0.2, 0.3), DOWN)
    stages = [tp.MoveTo(tp.Pose((0.4, -0.2, 0.3), DOWN)), tp.Line(by=(0.0, 0.0, 1.3))]
    found = tp.bound(arm, start=start, stages=stages)
    assert found.seconds == np.inf and not found.stages and found.postures.size == 0
    assert found.why.startswith("stages[1] goal: the tool cannot be led to")
    assert np.isfinite(tp.bound(arm, start=start, stages=stages[:1]).seconds)


@pytest.mark.parametrize(("what", "line"), [("obstacle-4", 'a bound is of a "sequence"'), (PANDA, "stages: missing")])
def test_what_is_no_sequence_has_no_bound(what: Any, line: str) -> None:
    with pytest.raises(tp.ScenarioError, match=line):
        tp.bound(what)


@pytest.mark.parametrize("cell", CELLS, ids=lambda path: path.stem)
def test_ways_take_about_as_long_as_through_a_few_points(cell: Path) -> None:
    """So the shortest chain of exact times is the shortest of all."""
    graph = SequenceGraph(load(cell))
    for layer, (edges, stop) in enumerate(zip(graph.edges, graph.stops[1:], strict=True)):
        stage = graph.stage(layer)
        for number, way in list(enumerate(stop.ways))[::4]:
            if way is not None:
                assert isinstance(stage, LedStage)
                exactly = way.least_time(graph.robot(layer), stage.fastest_tool)
                assert SURELY_LESS * edges.durations[stop.parents[number], number] <= exactly
                assert way.path.at(way.path.breakpoints[-1:])[0] == pytest.approx(way.end, abs=1e-12)


def test_the_least_chain_is_that_of_exact_times() -> None:
    scenario = load(CELLS[1])
    found, exact = tp.bound(CELLS[1]), SequenceGraph(scenario)
    for layer in range(len(exact.moving)):
        for pair in np.argwhere(np.isfinite(exact.edges[layer].durations)).tolist():
            exact._time_exactly(layer, tuple(pair))
    chain = exact.least_chain()
    assert chain is not None
    assert np.array(exact.postures(chain)) == pytest.approx(found.postures)


def a_line(by: tuple[float, float, float]) -> LedStage:
    task = {"kind": "sequence", "start": {"joints": [0.0] * 6}, "stages": [{"kind": "line", "by": list(by)}]}
    (stage,) = tp.parse_scenario({"robot": {"model": "ur5e"}, "task": task}).task.stages  # type: ignore[attr-defined]
    assert isinstance(stage, LedStage)
    return stage


def ways_of(found: object) -> list[ToolWay]:
    assert isinstance(found, list)
    return found


def test_postures_in_other_turns_share_a_way_within_their_ranges() -> None:
    robot = built_in("ur5e", None).arm()
    one: FloatArray = np.array([0.2, -1.6, 1.4, -1.4, -1.57, 0.0])
    turned, other = one + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * np.pi]), one + 0.1
    stage = a_line((0.0, 0.0, -0.1))
    (first,), (again,), (third,) = map(ways_of, ways_from(stage, robot, np.array([one, turned, other]), lambda: None))  # type: ignore[arg-type,return-value]
    assert again.source is first and third.source is third
    assert again.points == pytest.approx(first.points + (turned - one))
    times = least_times([first, again, third], robot, None)
    assert times[0] == times[1] != times[2]
    assert again.path.at(again.path.breakpoints) == pytest.approx(first.path.at(first.path.breakpoints) + turned - one)
    assert least_times([again], robot, None)[0] == pytest.approx(times[0], rel=1e-2)  # exactly now
    missed, reached = ways_from(a_line((0.0, 0.0, 0.6)), robot, np.array([one, one - 1e-12]), lambda: None)  # type: ignore[arg-type,return-value]
    assert isinstance(missed, InvalidProblem) and missed is reached
