"""Motions at the bound: joints that have time use it otherwise."""

from __future__ import annotations

import numpy as np
from helpers.core_robots import robot_of

from problems.polish import at_the_bound
from problems.polish.rephasing import Rephased, random_phases
from problems.robots import JointLimits
from problems.scene import Ball
from problems.tasks import Surroundings

LIMITS = JointLimits(speed=(2.0, 1.0, 3.0), acceleration=(10.0, 5.0, 8.0), jerk=(100.0, 80.0, 300.0))
START, GOAL = np.array([0.0, 0.5, 1.0]), np.array([2.0, 0.6, -0.2])


def test_postures_are_those_of_the_motions_that_are_made() -> None:
    motion = Rephased(START, GOAL, LIMITS)
    stretches, waits = random_phases(20, 3, np.random.default_rng(1))
    for share in (0.0, 0.13, 0.5, 0.98, 1.0):
        theta = motion.postures(stretches, waits, share)
        for row, stretch, wait in zip(theta, stretches, waits, strict=True):
            made = motion.made(stretch, wait)
            assert made.duration == motion.direct.duration
            np.testing.assert_allclose(row, made.at(np.array([share * made.duration]))[0], atol=1e-9)


def test_what_is_found_is_clear_and_as_fast_as_the_slowest_joint() -> None:
    arm = robot_of("upright")
    start, goal = np.zeros(7), np.array([1.5, 0.4, 0.3, 0.8, 0.0, 0.5, 0.2])
    direct = Rephased(start, goal, arm.limits).direct
    half = direct.at(np.array([0.5 * direct.duration]))
    tool = np.asarray(arm.skeleton(half))[0, -1]
    x, y, z = tool.tolist()
    around = Surroundings(arm, (Ball(center=(x, y, z + 0.05), radius=0.03),))
    found = list(at_the_bound(around, start[None], goal[None], np.random.default_rng(0)))
    assert found
    for trajectory in found[:5]:
        assert trajectory.duration == direct.duration
        times = np.linspace(0.0, trajectory.duration, 500)
        assert (around.clearance_margin(trajectory.at(times), times) >= 0.0).all()
