"""The limit of torques by hand, of rods in known postures; slowing a motion down restores it, and only just."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import InvalidProblem, PlanarArm
from problems.base import FloatArray, as_array
from problems.limits import SAMPLING_MARGIN, TorqueLimit, can_hold, holding_torques
from problems.limits.torque import StaticTorque
from problems.motions import LEAST_ROOM, Samples

MASS, LENGTH, GRAVITY = 2.0, 0.5, 9.81
WEIGHT = MASS * GRAVITY * LENGTH  # N m: of a rod at its far end
MOTORS = (3.0 * WEIGHT, 0.75 * WEIGHT)
RODS = PlanarArm((LENGTH,) * 2, (4.0,) * 2, (40.0,) * 2, link_masses=(MASS,) * 2, max_torque=MOTORS)
RUBBING = PlanarArm(
    (0.5, 0.4, 0.3),
    (4.0,) * 3,
    (40.0,) * 3,
    link_masses=(2.0, 1.5, 1.0),
    viscous_friction=(2.0, 1.0, 0.5),
    coulomb_friction=(3.0, 2.0, 1.0),
    max_torque=(40.0, 20.0, 8.0),
)


def samples_of(robot: PlanarArm, theta: FloatArray, speed: FloatArray, acceleration: FloatArray) -> Samples:
    return Samples(robot=robot, derivatives=tuple(map(ca.DM, (theta, speed, acceleration))), duration=ca.DM(1.0))


def at_rest(robot: PlanarArm, theta: list[float], acceleration: list[float]) -> Samples:
    return samples_of(robot, np.array([theta]), np.zeros((1, robot.dof)), np.array([acceleration]))


def test_rods_stretched_out_by_hand() -> None:
    """Held: m g l/2 about the second joint, m g l/2 + m g 3l/2 about the first."""
    assert holding_torques(RODS, np.zeros((1, 2))) == pytest.approx(np.array([[2.0 * WEIGHT, 0.5 * WEIGHT]]))
    [constraint] = TorqueLimit(RODS).constraints(at_rest(RODS, [0.0, 0.0], [0.0, 0.0]))
    assert as_array(constraint.expression) == pytest.approx(np.array([[2.0 * WEIGHT, 0.5 * WEIGHT]]))
    assert constraint.unit == "N m"
    assert float(constraint.graded_penalty()) == 0.0


def test_how_much_more_slowly_a_rod_has_to_be_lifted_by_hand() -> None:
    """The first joint turns two rods as one of 2 m, 2 l: (2 m)(2 l)^2 / 3 a; what is left of its motor is m g l."""
    a = 40.0
    inertia = 2.0 * MASS * (2.0 * LENGTH) ** 2 / 3.0
    factors = as_array(TorqueLimit(RODS).magnitudes(at_rest(RODS, [0.0, 0.0], [a, 0.0])))
    assert factors[0, 0] == pytest.approx(np.sqrt(inertia * a / WEIGHT))
    lowered = as_array(TorqueLimit(RODS).magnitudes(at_rest(RODS, [0.0, 0.0], [-a, 0.0])))
    assert lowered[0, 0] == pytest.approx(np.sqrt(inertia * a / (5.0 * WEIGHT)))


def test_viscous_friction_takes_its_share_by_hand() -> None:
    """Without gravity or inertia: d v / s is the limit."""
    robot = PlanarArm(
        (1.0, 1.0), (4.0,) * 2, (40.0,) * 2, link_masses=(1.0,) * 2, viscous_friction=(3.0, 0.0), max_torque=(2.0, 2.0),
        gravity=(0.0, 0.0),
    )  # fmt: skip
    factors = TorqueLimit(robot).magnitudes(samples_of(robot, *np.array([[[0.3, 0.0]], [[4.0, 0.0]], [[0.0, 0.0]]])))
    assert as_array(factors) == pytest.approx(np.array([[6.0, 0.0]]))


def test_a_posture_that_cannot_be_held_breaks_the_static_limit_by_how_much() -> None:
    weak = PlanarArm(RODS.link_lengths, (4.0,) * 2, (40.0,) * 2, link_masses=(MASS,) * 2, max_torque=(WEIGHT, WEIGHT))
    assert can_hold(weak, np.array([[0.0, 0.0], [np.pi / 2, 0.0], [-np.pi / 2, 0.0]])).tolist() == [False, True, True]
    [static] = TorqueLimit(weak).static_limits
    excess = [
        float(c.graded_penalty())
        for a in (0.0, 0.5, 1.5)
        for c in static.constraints(at_rest(weak, [a, 0.0], [0.0, 0.0]))
    ]
    room = 1.0 - SAMPLING_MARGIN
    assert excess == pytest.approx([2.0 / room - 1.0, 2.0 * np.cos(0.5) / room - 1.0, 0.0])
    assert can_hold(PlanarArm((1.0, 1.0), (4.0,) * 2, (40.0,) * 2), np.zeros((3, 2))).all()


def test_torques_of_unknown_masses_are_refused() -> None:
    with pytest.raises(InvalidProblem, match="masses"):
        TorqueLimit.for_robot(PlanarArm((1.0, 1.0), (4.0,) * 2, (40.0,) * 2, max_torque=(1.0, 1.0)), ())


SIZES = (st.floats(-3.0, 3.0), st.floats(-4.0, 4.0), st.floats(-60.0, 60.0))


@settings(deadline=None)
@given(*(st.lists(size, min_size=9, max_size=9) for size in SIZES))
def test_slowed_down_the_torques_are_kept_and_one_is_used_up(
    theta: list[float], speed: list[float], acceleration: list[float]
) -> None:
    """Where motors can hold the arm; a factor of 0 says that any speed will do."""
    q, v, a = (np.array(values).reshape(3, 3) for values in (theta, speed, acceleration))
    static, limit = StaticTorque(RUBBING), TorqueLimit(RUBBING)
    [constraint] = static.at(samples_of(RUBBING, q, v, a))
    holds = (np.abs(as_array(constraint.expression)) <= constraint.bounds[1]).all(axis=1)
    q, v, a = q[holds], v[holds], a[holds]
    if not holds.any():
        return
    samples = samples_of(RUBBING, q, v, a)
    s = float(limit.time_scale(limit.magnitudes(samples)))
    for factor in (s, 1.5 * s, 40.0 * s, 1.0 / LEAST_ROOM):
        if factor < max(s, 1e-3):
            continue
        torques = as_array(samples_of(RUBBING, q, v / factor, a / factor**2).torque)
        used = (np.abs(torques) / np.array(limit.bounds)).max()
        assert used <= 1.0 + 1e-9
        if factor == s:
            assert used == pytest.approx(1.0, abs=1e-6)
