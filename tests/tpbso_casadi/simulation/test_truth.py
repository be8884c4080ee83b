"""True distances and contacts against an oracle that knows two links, a box and a dense grid of times."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from typing import Any

import numpy as np
import pytest
from helpers.simulations import simulated
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from problems import CertificateStatus, Trajectory
from problems.base import FloatArray
from tpbso_casadi.simulation import SimulationRecord
from tpbso_casadi.simulation.result import contacts, kept_limits, stretches

TIMES, ALONG = 1501, 101
HALF = np.array([0.1, 0.1])  # of the box


def box(center: list[float], **motion: Any) -> dict[str, Any]:
    return {"shape": "box", "center": center, "size": (2.0 * HALF).tolist(), **motion}


def oracle(record: SimulationRecord, centers: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """The distance from points on both links to a box that is at ``centers`` (n, 2); whether the arm moves."""
    times = np.linspace(0.0, record.duration, len(centers))
    psi = np.cumsum(record.executed.at(times), axis=1)
    directions = np.stack([np.cos(psi), np.sin(psi)], axis=-1)  # (n, 2 links, 2)
    share = np.linspace(0.0, 1.0, ALONG)[:, None]
    points = np.concatenate(
        [share * directions[:, None, 0], directions[:, None, 0] + share * directions[:, None, 1]], axis=1
    )
    outside = np.abs(points - centers[:, None]) - HALF
    apart = np.hypot(*np.maximum(outside, 0.0).transpose(2, 0, 1)) + np.minimum(outside.max(axis=-1), 0.0)
    return apart.min(axis=1), (np.abs(record.executed.at(times, 1)) > 1e-9).any(axis=1)


def runs(touched: NDArray[np.bool_]) -> int:
    return sum(is_contact for is_contact, _ in groupby(touched.tolist()))


def test_a_box_in_the_way_is_hit_in_every_move() -> None:
    record = simulated(obstacles=[box([1.2, 1.2])])
    judged = stretches(record)
    distances, moving = oracle(record, np.tile([1.2, 1.2], (TIMES, 1)))
    assert contacts(judged, moving=True) == runs((distances <= 0.0) & moving) == 6
    assert contacts(judged, moving=False) == 0
    assert min(stretch.distance for stretch in judged) < 0.0


def test_a_box_that_passes_behind_the_arm_is_never_touched() -> None:
    velocity = np.array([-0.8, -0.1])
    record = simulated(obstacles=[box([1.2, -0.5], velocity=velocity.tolist())])
    judged = stretches(record)
    centers = np.array([1.2, -0.5]) + np.linspace(0.0, 3.0, TIMES)[:, None] * velocity
    distances, _ = oracle(record, centers)
    assert {stretch.status for stretch in judged} == {CertificateStatus.CERTIFIED}
    nearest = min(judged, key=lambda stretch: stretch.distance)
    assert nearest.distance == pytest.approx(distances.min(), rel=0.01)
    assert nearest.time == pytest.approx(3.0 * np.argmin(distances) / (TIMES - 1), abs=0.02)
    for stretch in judged:
        inside = (np.linspace(0.0, 3.0, TIMES) >= stretch.first) & (np.linspace(0.0, 3.0, TIMES) <= stretch.last)
        assert distances[inside].min() <= stretch.distance + 1e-3
        assert distances[inside].min() >= 0.85 * stretch.distance


def test_what_comes_to_a_standing_arm_is_no_collision_of_it() -> None:
    stand = {"goals": [{"joints": [0.0, 0.0]}]}
    record = simulated(obstacles=[box([1.0, -1.0], velocity=[0.0, 0.5])], simulation=stand)
    judged = stretches(record)
    assert contacts(judged, moving=True) == 0
    assert contacts(judged, moving=False) == 1
    touched = [stretch for stretch in judged if stretch.status is CertificateStatus.VIOLATED]
    assert touched[0].first <= 1.8 <= touched[0].last  # the side of the box is there after 0.9 m
    assert touched[-1].first <= 2.2 <= touched[-1].last
    assert not any(stretch.moves for stretch in judged)


def test_an_obstacle_that_changes_course_is_met_where_it_really_is() -> None:
    rows = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 1.0], [3.0, 0.0, 1.0]]
    stand = {"goals": [{"joints": [0.0, 0.0]}]}
    record = simulated(obstacles=[box([1.0, -1.0], motion_rows=rows)], simulation=stand)
    judged = stretches(record)
    heights = CubicSpline(*np.array(rows).T[[0, 2]])(np.linspace(0.0, 3.0, TIMES)) - 1.0
    distances, _ = oracle(record, np.column_stack([np.ones(TIMES), heights]))
    assert contacts(judged, moving=False) == runs(distances <= 0.0) == 2  # the spline swings beyond the last rows
    assert judged[-1].distance < 0.0


def test_stretches_follow_each_other_and_say_when_the_arm_moves() -> None:
    record = simulated(obstacles=[box([1.2, 1.2])])
    judged = stretches(record)
    assert judged[0].first == 0.0
    assert judged[-1].last == record.duration
    assert [one.last for one in judged[:-1]] == [other.first for other in judged[1:]]
    for stretch in judged:
        middle = np.array([(stretch.first + stretch.last) / 2.0])
        assert stretch.moves == bool((np.abs(record.executed.at(middle, 1)) > 1e-9).any())


def test_where_nothing_is_all_is_certified() -> None:
    judged = stretches(simulated())
    assert {stretch.status for stretch in judged} == {CertificateStatus.CERTIFIED}
    assert {stretch.distance for stretch in judged} == {np.inf}


def test_limits_are_judged_until_the_arm_stands() -> None:
    record = simulated(arm={"max_jerk": 1e5}, simulation={"seconds": 1.0})
    assert np.abs(record.executed.value_at_end(1)).max() > 1.0  # it ends in the middle of a motion
    verdicts = kept_limits(record)
    assert {verdict.name for verdict in verdicts} == {"speed", "acceleration", "jerk"}
    assert all(verdict.satisfied for verdict in verdicts)
    peak = 1.5 * 15.0 / 8.0 / 0.5  # of the speed of a quintic from rest to rest
    [speed] = [verdict for verdict in verdicts if verdict.name == "speed"]
    assert abs(speed.worst) == pytest.approx(peak)


def test_a_limit_that_was_broken_is_named() -> None:
    record = simulated(arm={"max_speed": 1.0})
    assert [verdict.name for verdict in kept_limits(record) if not verdict.satisfied] == ["speed"]


def test_a_motion_of_the_planner_that_jumps_breaks_the_limit_of_jerk() -> None:
    record = simulated(arm={"max_jerk": 1e5})
    coefficients = record.executed.coefficients.copy()
    coefficients[-3, coefficients.shape[1] // 2] += 1.0
    jumping = replace(record, executed=Trajectory(record.executed.breakpoints, coefficients))
    assert "jerk" in [verdict.name for verdict in kept_limits(jumping) if not verdict.satisfied]
