"""When limits are broken: first times and spans against closed forms and dense samples; what jumps makes infinite."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import CertificateStatus, Ellipse, PlanarArm, Trajectory
from problems.assembly import recorded_motion
from problems.certify import Verdict, broken_spans, first_broken, limit_verdicts
from problems.limits import StatedExpression
from problems.motions import MotionRows, traced
from problems.tasks import RecordedMotion

CERTIFIED, VIOLATED = CertificateStatus.CERTIFIED, CertificateStatus.VIOLATED
ARM = PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0))
JERKY = PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0), max_jerk=(500.0, 500.0))


def quintic(duration: float, way: float = 1.0) -> Trajectory:
    """From rest to rest; its largest speed is 15/8 way / T in the middle."""
    ends = np.array([[0.0, 0.3], [way, 0.3]])
    return MotionRows(np.array([0.0, duration]), ends, 0.0 * ends, 0.0 * ends).trajectory


def judged(motion: Trajectory, robot: PlanarArm = ARM, **keys: Any) -> dict[str, Verdict]:
    criteria = recorded_motion(RecordedMotion(robot, motion, **keys))
    return {verdict.name: verdict for verdict in criteria.verify(motion)}


def test_a_speed_is_first_broken_where_it_crosses_its_bound() -> None:
    motion = quintic(0.8)
    found = judged(motion)["speed"]
    u = np.linspace(0.0, 0.5, 2_000_001)
    crossing = 0.8 * u[np.argmax(30.0 * u**2 * (1.0 - u) ** 2 / 0.8 > 2.0)]
    assert found.status is VIOLATED
    assert found.where == f"joint 1, t = 0.4 s; first at {crossing:.4g} s"
    (limit,) = [limit for limit in recorded_motion(RecordedMotion(ARM, motion)).limits if limit.name == "speed"]
    assert first_broken(limit, found, motion) == pytest.approx(crossing, abs=1e-6)
    ((start, end),) = broken_spans([limit], [found], motion)["speed"]
    assert (start, end) == pytest.approx((crossing, 0.8 - crossing), abs=1e-6)


def test_what_holds_has_no_first_time() -> None:
    found = judged(quintic(2.0))
    assert all(verdict.status is CERTIFIED for verdict in found.values())
    assert not any("first" in verdict.where for verdict in found.values())


def test_speeds_that_jump_break_accelerations_jerks_and_torques_and_not_speeds() -> None:
    rows = MotionRows(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0.3], [0.5, 0.3], [0.5, 0.3]]))
    arm = PlanarArm(
        (0.5, 0.5), (2.0, 2.0), (10.0, 10.0), max_jerk=(500.0, 500.0), link_masses=(1.0, 1.0), max_torque=(99.0, 99.0),
        gravity=(0.0, 0.0),
    )  # fmt: skip
    found = judged(rows.trajectory, arm)
    assert found["speed"].status is CERTIFIED
    for name in ("acceleration", "jerk", "torque"):
        assert found[name].status is VIOLATED
        assert found[name].worst == np.inf
        assert found[name].where == "speeds jump, t = 1 s; first at 1 s"


def test_a_jerk_is_infinite_too_where_speeds_jump_and_accelerations_do_not() -> None:
    """Both accelerations are zero: only the speeds tell."""
    corner = MotionRows(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0.0], [0.3, 0.0], [0.9, 0.0]])).trajectory
    assert corner.jump_time(2) is None
    assert corner.jumps_below(3) is not None
    assert judged(corner, JERKY)["jerk"].worst == np.inf


def test_positions_that_jump_break_the_speed() -> None:
    jumping = Trajectory(np.array([0.0, 1.0, 2.0]), np.array([[[0.0, 0.0], [0.1, 0.0]]]))
    found = judged(jumping)
    assert found["speed"].worst == np.inf
    assert found["speed"].where == "positions jump, t = 1 s; first at 1 s"
    assert found["acceleration"].worst == np.inf


@pytest.mark.parametrize(("quantity", "below"), [("speed", 0), ("acceleration", 1), ("jerk", 2)])
def test_an_expression_is_infinite_where_what_is_below_its_derivative_jumps(quantity: str, below: int) -> None:
    jumps = np.zeros((below + 1, 2, 2))
    jumps[0, 1] = 0.1
    motion = Trajectory(np.array([0.0, 1.0, 2.0]), jumps)
    kind = StatedExpression("own", "1", traced(lambda m: getattr(m, quantity)[0], ARM, "own"), None, (1e6,))
    (found,) = limit_verdicts([kind.for_robot(ARM, ())], motion)
    assert found.status is VIOLATED
    assert found.worst == np.inf


def test_an_obstacle_is_first_touched_when_dense_samples_say_so() -> None:
    motion = quintic(2.0, way=1.4)
    obstacle = Ellipse((0.6, 0.6), (0.1, 0.1))
    found = judged(motion, obstacles=(obstacle,))["clearance"]
    times = np.linspace(0.0, 2.0, 40_001)
    tips, elbows = places(motion, times)
    along = elbows[:, None] + np.linspace(0.0, 1.0, 41)[:, None] * (tips - elbows)[:, None]
    inside = (np.linalg.norm(along - [0.6, 0.6], axis=2) < 0.1).any(axis=1)
    first = times[np.argmax(inside)]
    assert found.status is VIOLATED
    assert found.where.startswith("link 2, obstacle 1, t = ")
    assert float(found.where.rpartition("first at ")[2].removesuffix(" s")) == pytest.approx(first, abs=2e-3)


def test_a_tool_that_swings_back_touches_the_link_before_the_last() -> None:
    """Seen from the last joint the tool is at 135 degrees from the last link, 0.2 sqrt(2) m away; 0.04 m are kept."""
    arm = replace(ARM, link_lengths=(0.5, 0.3), link_radius=(0.02, 0.02), tool_offset=(-0.5, 0.2), self_collision=True)
    at_first = np.pi / 4.0 - np.arcsin(0.04 / np.hypot(0.2, 0.2))
    for way, status in ((at_first - 1e-3, CERTIFIED), (at_first + 1e-3, VIOLATED)):
        ends = np.array([[0.0, 0.0], [0.0, way]])
        motion = MotionRows(np.array([0.0, 2.0]), ends, 0.0 * ends, 0.0 * ends).trajectory
        found = judged(motion, arm)["self clearance"]
        assert found.status is status
        assert found.where.startswith("link 1, tool")


def places(motion: Trajectory, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of the tip and of the elbow at m times, (m, 2) each."""
    first, second = motion.at(times).T
    elbow = 0.5 * np.column_stack([np.cos(first), np.sin(first)])
    return elbow + 0.5 * np.column_stack([np.cos(first + second), np.sin(first + second)]), elbow


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["linear", "cubic", "quintic"]))
def test_no_proof_is_false_and_no_first_time_comes_after_a_breach(seed: int, kind: Any) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.05, 0.6, 6))
    q, v, a = rng.normal(size=(3, 6, 2)) * np.array([0.5, 1.0, 4.0])[:, None, None]
    motion = MotionRows(times, q, v, a, kind).trajectory
    found, dense = judged(motion), np.linspace(0.0, motion.duration, 20_001)
    for name, order, bound in (("speed", 1, 2.0), ("acceleration", 2, 10.0)):
        values = np.abs(motion.at(dense, order)).max(axis=1)
        if found[name].status is CERTIFIED:
            assert values.max() <= bound * (1.0 + 1e-9)
        elif np.isfinite(found[name].worst):
            first = float(found[name].where.rpartition("first at ")[2].removesuffix(" s"))
            seen = dense[values > bound * (1.0 + 1e-6)]
            assert not seen.size or first <= seen[0] * (1.0 + 1e-3) + 1e-9
