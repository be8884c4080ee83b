"""The figure of limits over time: where a limit binds, by hand."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.massive import lifted_motion
from helpers.space_plans import space_plan

from problems import PlanarArm, Trajectory
from tpbso_casadi.figures.curves import joints_figure
from tpbso_casadi.figures.limits import STYLES, spans
from tpbso_casadi.planning import PlannedMotion, alternatives, shares_of_limits
from tpbso_casadi.planning.motion import QUANTITIES


def test_spans_of_a_mask() -> None:
    assert spans(np.array([True, True, False, True, False, False, True])) == [(0, 1), (3, 3), (6, 6)]
    assert spans(np.array([False, False])) == []


def bang_bang() -> Trajectory:
    """q = t^2 for 1 s, then braking likewise, of both joints: speed 2 at the middle, acceleration 2 throughout."""
    coefficients = np.array([[[1.0], [-1.0]], [[0.0], [2.0]], [[0.0], [1.0]]])
    return Trajectory(np.array([0.0, 1.0, 2.0]), np.repeat(coefficients, 2, axis=2))


def test_shares_of_a_bang_bang_move() -> None:
    robot = PlanarArm(link_lengths=(1.0, 1.0), max_speed=(4.0, 8.0), max_acceleration=(2.0, 4.0))
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    shares = dict(shares_of_limits(robot, bang_bang(), times))
    assert list(shares) == ["speed", "acceleration"]
    sizes = np.outer([1.0, 1.0, -1.0, -1.0, -1.0], [1.0, 0.5])
    np.testing.assert_allclose(shares["acceleration"], sizes)
    np.testing.assert_allclose(shares["speed"], np.outer([0.0, 0.25, 0.5, 0.25, 0.0], [1.0, 0.5]))


def test_shares_of_torques_held_upright() -> None:
    # no gravity; point masses of 1 kg at the ends of both links: at zero, tau_1 = 5 a_1 + 2 a_2 ... by hand
    robot = PlanarArm(
        link_lengths=(1.0, 1.0), max_speed=(4.0, 4.0), max_acceleration=(9.0, 9.0), gravity=(0.0, 0.0),
        link_masses=(1.0, 1.0), link_centers=(1.0, 1.0), link_inertias=(0.0, 0.0), max_torque=(32.0, 12.0),
    )  # fmt: skip
    shares = dict(shares_of_limits(robot, bang_bang(), np.array([0.0])))
    # M = [[1 + 4, 2], [2, 1]] stretched, a = (2, 2), at rest: tau = (14, 6)
    np.testing.assert_allclose(shares["torque"], [[14.0 / 32.0, 6.0 / 12.0]])


def test_every_limit_of_sizes_has_a_line() -> None:
    assert set(STYLES) == set(QUANTITIES)


def test_labels_name_each_unit_once() -> None:
    assert alternatives(("N m", "N", "N m")) == "N m or N"
    assert alternatives(("rad", "rad")) == "rad"


@pytest.mark.parametrize("limited", [True, False])
def test_the_joints_figure_has_a_panel_of_torques(limited: bool) -> None:
    motion = lifted_motion(limited)
    axes = joints_figure(PlannedMotion(scenario=None, motion=motion)).axes[-1]  # type: ignore[arg-type]
    assert axes.get_ylabel() == "torque [N m or N]"
    drawn = [line for line in axes.lines if len(line.get_xdata()) > 2]
    np.testing.assert_allclose([line.get_ydata() for line in drawn], motion.torques(motion.times).T)
    level = {line.get_ydata()[0] for line in axes.lines if len(line.get_xdata()) == 2}
    assert level == ({120.0, 40.0, 20.0, 10.0, -120.0, -40.0, -20.0, -10.0} if limited else set())


def test_an_arm_without_masses_has_no_panel_of_torques() -> None:
    assert len(joints_figure(space_plan()).axes) == 4
