"""Motions of other planners: kept as they are, judged by what their planners were told, and counted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.foreign_motions.files import Shelf
from benchmarks.foreign_motions.judging import Outcome, at_rows, outcomes_of, stored_outcomes
from benchmarks.foreign_motions.planners import FOREIGN, Made, Rows, by_ruckig, problems_for, waypoints_of
from benchmarks.foreign_motions.table import HEADER, table
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.problem_file import Obstacle as Solid
from benchmarks.motion_bench_maker.setting import Setting

BOX = Solid("box", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.1, 0.1, 0.1))


def test_ruckig_stops_at_every_waypoint_within_its_limits(setting: Setting) -> None:
    limits, path = setting.limits, waypoints_of(setting, "random-0007")
    motion = by_ruckig(path, limits)
    looks = motion.at(np.linspace(0.0, motion.duration, 20_001), 1)
    assert (np.abs(looks) <= np.array(limits.speed) * (1.0 + 1e-9)).all()
    still = motion.breakpoints[(np.abs(motion.at(motion.breakpoints, 1)) < 1e-9).all(axis=1)]
    reached = motion.at(still)
    for waypoint in path:
        assert np.abs(reached - waypoint).max(axis=1).min() < 1e-9
    again = waypoints_of(setting, "random-0007")
    np.testing.assert_array_equal(path, again)


def test_rows_are_those_of_the_motion_and_its_end(setting: Setting) -> None:
    motion = by_ruckig(waypoints_of(setting, "random-0001"), setting.limits)
    rows = Rows.of(motion)
    assert rows.times[-1] == motion.duration
    np.testing.assert_allclose(np.diff(rows.times)[:-1], 0.01, atol=1e-12)
    np.testing.assert_array_equal(rows.speeds, motion.at(rows.times, 1))
    assert at_rows(setting, problems_for(FOREIGN["ruckig"], setting, [], 2)[1], rows) == set()


def test_motions_are_kept_judged_once_and_counted(setting: Setting, tmp_path: Path) -> None:
    shelf, known = Shelf(tmp_path), tmp_path / "outcomes.jsonl"
    (problem,) = problems_for(FOREIGN["ruckig"], setting, [], 1)
    motion = by_ruckig(waypoints_of(setting, problem.name), setting.limits)
    quick = replace(motion, breakpoints=motion.breakpoints / 2.0, coefficients=motion.time_scaled(0.5).coefficients)
    for name, each in (("ruckig", motion), ("toppra", quick)):
        shelf.put(name, problem.name, Made(each, Rows.of(each)), 0.1, "")
        kept = shelf.get(name, problem.name)
        assert kept is not None and kept.motion is not None
        np.testing.assert_array_equal(kept.motion.coefficients, each.coefficients)
    shelf.put("roboplan", problem.name, None, 0.1, "found none")
    assert shelf.get("roboplan", problem.name) is None
    found = list(outcomes_of(shelf, known, setting, [], ["ruckig", "toppra"], 1))
    told = {(each.planner, each.form): each for each in found}
    assert told["ruckig", "itself"].status == told["ruckig", "knots"].status == "certified"
    broken = told["toppra", "itself"]
    assert broken.status == "violated" and set(broken.over) == {"speed", "acceleration"}
    assert broken.over["speed"] == pytest.approx(1.0, abs=1e-6)  # run twice as fast
    assert broken.over["acceleration"] == pytest.approx(3.0, abs=1e-6)
    assert broken.at_rows == ["acceleration", "speed"]
    assert stored_outcomes(known) == found
    assert list(outcomes_of(shelf, known, setting, [], ["ruckig", "toppra"], 1)) == found
    assert len(known.read_text().splitlines()) == len(found) == 8


def test_a_posture_in_a_box_is_seen_at_rows(setting: Setting) -> None:
    posture = np.zeros((2, len(setting.limits.speed)))
    rows = Rows(np.array([0.0, 1.0]), posture, 0.0 * posture, 0.0 * posture)
    ends = tuple(posture[0].tolist())
    far = MotionProblem("far", ends, ends, (replace(BOX, position=(9.0, 0.0, 0.0)),))
    centre = setting.checker(far).centers(posture)[0, -1]
    near = replace(far, obstacles=(replace(BOX, position=tuple(centre.tolist())),))
    assert at_rows(setting, far, rows) == set()
    assert at_rows(setting, near, rows) == {"clearance"}


def outcome(**more: object) -> Outcome:
    stated: dict[str, object] = {
        "planner": "ompl", "problem": "a", "form": "itself", "status": "certified", "over": {}, "undecided": [],
        "at_rows": [], "pieces": 3, "milliseconds": 10.0,
    }  # fmt: skip
    return Outcome(**stated | more)  # type: ignore[arg-type]


def test_the_table_counts_what_is_broken_by_how_much_and_what_rows_show() -> None:
    outcomes = [
        outcome(),
        outcome(status="violated", over={"speed": 0.02, "clearance": 5e-4}, at_rows=["speed"], milliseconds=30.0),
        outcome(status="violated", over={"speed": 1e-4, "self clearance": 2e-3}, milliseconds=20.0),
        outcome(status="undecided", undecided=["acceleration"], milliseconds=20.0),
        outcome(form="cubic", status="violated", over={"jerk": np.inf}),
    ]
    lines = list(table(outcomes))
    assert lines[0] == "as the library evaluates it: 4 motions, 2 broken, 1 of these in nothing that their rows show"
    rows = [line for line in lines if line.startswith("| OMPL")]
    cells = dict(zip(HEADER, rows[0].strip("| ").split(" | "), strict=True))
    assert cells["motions"] == "4" and cells["proven"] == "1" and cells["undecided"] == "1"
    assert cells["speed"] == "2 / 1 / 1; 2 %"
    assert cells["touch"] == "2 / 1 / 2; 2 mm"
    assert cells["acceleration"] == cells["jerk"] == "0"
    assert cells["ms"] == "20 / 28"
    assert dict(zip(HEADER, rows[1].strip("| ").split(" | "), strict=True))["jerk"] == "1 / 1 / 1; jumps"
