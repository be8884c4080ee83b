"""Sequences that begin with an earlier plan: what is kept, what is planned, and that all of it is proven again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal
from helpers.slow import slow_except

import tpbso_casadi as tp
from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.display.plan_tables import effort_of
from tpbso_casadi.planning import EarlierMotion, plan

HOME = [0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.785]
DOWN = (1.0, 0.0, 0.0, 0.0)
PANDA = tp.robot("panda", tip_link="panda_hand_tcp")
TABLE = {"shape": "box", "name": "table", "center": [0.6, 0.0, -0.06], "size": [0.8, 1.4, 0.1]}
PART = {"shape": "box", "name": "part", "center": [0.5, -0.3, 0.05], "size": [0.04, 0.04, 0.1]}


def stages_of(height: float = 0.2, lift: float = 0.13) -> list[Any]:
    """To a part, down, up with it, elsewhere, and home: five motions."""
    return [
        tp.MoveTo(tp.Pose((0.5, -0.3, height), DOWN)),
        tp.Line(by=[0.0, 0.0, 0.07 - height], may_touch=[("panda_hand", "part")]),
        tp.Attach("part", mass=0.4),
        tp.Line(by=[0.0, 0.0, lift]),
        tp.MoveTo(tp.Pose((0.45, 0.35, 0.22), DOWN)),
        tp.Detach("part"),
        tp.MoveTo(HOME, may_touch=[("panda_hand", "part")]),
    ]


def cell(stages: Iterable[Any] | None = None, warm_start: Any = None, **keys: Any) -> tp.Plan:
    stated = {"start": HOME, "obstacles": [TABLE, PART], "stages": stages or stages_of()} | keys
    return tp.sequence(PANDA, **stated, warm_start=warm_start)


@pytest.fixture(scope="module")
def before() -> tp.Plan:
    return cell()


def kept_of(found: tp.Plan) -> int | None:
    assert found.certified
    return found.planned.kept


def test_a_plan_without_an_earlier_one_says_nothing(before: tp.Plan) -> None:
    assert kept_of(before) is None


def test_all_is_kept_where_nothing_was_changed(before: tp.Plan, tmp_path: Path) -> None:
    for earlier in (before, before.save(tmp_path / "run", figures=())):
        again = cell(warm_start=earlier)
        assert kept_of(again) == 5
        assert "5 of 5 motions kept" in effort_of(again.planned)
        times = np.linspace(0.0, before.duration, 50)
        assert np.allclose(again.trajectory(times), before.trajectory(times), atol=1e-9)
        assert again.duration == pytest.approx(before.duration, abs=1e-12)


@pytest.mark.parametrize("change", slow_except([{"lift": 0.15}, {"height": 0.22}], 1), ids=str)
def test_only_what_was_changed_is_planned(before: tp.Plan, change: dict[str, float]) -> None:
    """The posture above the place where the part is put is the earlier one, and so the way home stays."""
    changed = stages_of(**change)
    cold, warm = cell(changed), cell(changed, before)
    assert 1 <= (kept_of(warm) or 0) < 5
    assert warm.duration == pytest.approx(cold.duration, rel=0.02)


@pytest.mark.slow
def test_stages_that_were_added_or_left_out_leave_the_others(before: tp.Plan) -> None:
    stages = stages_of()
    assert kept_of(cell([*stages[:2], tp.Wait(0.1), *stages[2:]], before)) == 5
    assert kept_of(cell([*stages, tp.MoveTo([0.5, *HOME[1:]])], before)) == 5
    assert kept_of(cell(stages[:4], before)) == 3


@pytest.mark.slow
def test_in_another_scene_motions_are_kept_that_hold_there(before: tp.Plan) -> None:
    far = {"shape": "sphere", "center": [-0.6, 0.0, 0.9], "radius": 0.05}
    assert kept_of(cell(warm_start=before, obstacles=[TABLE, PART, far])) == 5
    (home,) = before.stages[-1:]
    point = before.motion.joint_positions(np.array([(home.start + home.end) / 2.0]))[0, -1]
    in_the_way = {"shape": "sphere", "center": point.tolist(), "radius": 0.03}
    around = cell(warm_start=before, obstacles=[TABLE, PART, in_the_way])
    assert 1 <= (kept_of(around) or 0) < 5


@pytest.mark.slow
def test_with_another_robot_nothing_is_kept(before: tp.Plan) -> None:
    slow = tp.robot("panda", tip_link="panda_hand_tcp", max_speed=[1.0] * 7)
    again = tp.sequence(slow, start=HOME, stages=stages_of(), obstacles=[TABLE, PART], warm_start=before)
    assert kept_of(again) == 0
    assert np.abs(again.trajectory.at(again.times, 1)).max() <= 1.0 + 1e-9


def test_a_motion_that_does_not_hold_is_not_kept(before: tp.Plan, tmp_path: Path) -> None:
    """A folder that was changed is refused; whoever seals it anew gains nothing, as all is proven again."""
    earlier = EarlierMotion.of(before.planned)
    ends = 0.9 * earlier.quantities["stage_ends"]
    faster = replace(earlier, trajectory=before.trajectory.time_scaled(0.9), quantities={"stage_ends": ends})
    again = plan(before.scenario, warm_start=faster)
    assert (again.feasible, again.kept) == (True, 0)
    folder = before.save(tmp_path / "run", figures=())
    np.savez(folder / "motion.npz", breakpoints=[0.0, 1.0], coefficients=np.zeros((1, 1, 7)))
    with pytest.raises(tp.InvalidRun, match=r"motion\.npz: is not of this run"):
        cell(warm_start=folder)


def test_a_sequence_needs_the_plan_of_one(before: tp.Plan) -> None:
    single = tp.plan(PANDA, start=np.array(HOME), goal=np.array([0.5, *HOME[1:]]))
    with pytest.raises(tp.ScenarioError, match="warm_start: a plan of a sequence is needed, not of 'point-to-point'"):
        cell(warm_start=single)


@pytest.mark.usefixtures("in_an_empty_folder")
def test_the_command_refuses_what_is_no_run(capsys: pytest.CaptureFixture[str]) -> None:
    line = refusal(capsys, main, "time-3", "--warm-start", "nothing", "--no-plots")
    assert line.startswith("nothing/result.json: cannot be read")


def test_a_kept_line_says_where_it_keeps_its_speed() -> None:
    stages = [tp.Line(by=[0.0, 0.0, 0.1], tool_speed=0.2)]
    first = tp.sequence(PANDA, start=HOME, stages=stages)
    again = tp.sequence(PANDA, start=HOME, stages=stages, warm_start=first)
    assert kept_of(again) == 1
    near, expected = (plan.scenario.table()["task"]["stages"][0]["tool_speed"]["at_ends"] for plan in (again, first))
    assert near == pytest.approx(expected, rel=1e-9)
