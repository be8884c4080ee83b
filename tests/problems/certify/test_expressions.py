"""Proofs for expressions of a user's own: certified, violated or undecided, and never certified wrongly.

Of an arm whose class the core does not know by intervals of its expression, of others by Taylor models in the core.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from helpers.slow import slow_except
from helpers.space import sliding_arm, small_arm

from benchmarks.taylor_models import checked
from problems import CertificateStatus, PlanarArm, Robot, Trajectory
from problems.certify import Verdict, limit_verdicts
from problems.certify.cells import BINARY, UNARY, Ranges
from problems.certify.core_expressions import prove_in_core
from problems.evaluation import interpreter as tapes
from problems.limits import ExpressionLimit, StatedExpression
from problems.motions import traced


class OwnArm(PlanarArm):
    """A class that the core does not know."""


PLANE, SPACE = equal_links(2), small_arm(2)
ARM = OwnArm(**vars(PLANE))
BOTH = pytest.mark.parametrize("arm", [ARM, SPACE], ids=["intervals", "core"])


def prove_expression(limit: ExpressionLimit, trajectory: Trajectory) -> Verdict:
    [outcome] = limit_verdicts([limit], trajectory)
    return outcome


SWING = Trajectory.from_pieces(np.array([1.0]), [np.array([[0.0, 0.0], [0.0, 0.0], [3.0, 1.5], [-2.0, -1.0]])])
CERTIFIED, VIOLATED, UNDECIDED = CertificateStatus.CERTIFIED, CertificateStatus.VIOLATED, CertificateStatus.UNDECIDED


def limit(stated: Any, lower: float | None = None, upper: float | None = None, arm: Robot = ARM) -> ExpressionLimit:
    bounds = [None if bound is None else (bound,) for bound in (lower, upper)]
    return StatedExpression("own", "m", traced(stated, arm, "c"), *bounds).for_robot(arm, ())


def dense(kept: ExpressionLimit, motion: Trajectory) -> np.ndarray:
    times = np.linspace(0.0, motion.duration, 20_000)
    return np.asarray(kept.function.at(motion.samples(times, kept.robot)))[:, 0]


@BOTH
@pytest.mark.parametrize(
    "stated",
    [
        lambda m: m.q[0] + m.q[1],
        lambda m: ca.norm_2(m.tool_velocity),
        lambda m: m.tool[1] - 1.0 + 2.0 * m.tool[0] ** 2,
        lambda m: ca.atan2(m.tool[1], m.tool[0] + 3.0),
        lambda m: ca.atan2(m.tool[1] + 3.0, m.tool[0] - 4.0) - ca.atan2(m.tool[1] - 3.0, m.tool[0] - 2.0),
        lambda m: ca.fmax(m.speed[0], ca.fabs(m.acceleration[1])) * ca.exp(-m.time) ** 1.5,
        lambda m: ca.if_else(m.tool[0] > 0.3, m.tool[1], 0.1) + m.time / m.duration,
        lambda m: ca.log1p(ca.hypot(m.tool[0], m.tool[1])) + ca.tan(m.q[1] / 4.0),
    ],
)
def test_close_bounds_are_proven_and_what_breaks_them_is_seen(stated: Any, arm: Robot) -> None:
    kept = limit(stated, -1e3, 1e3, arm)
    values = dense(kept, SWING)
    low, high = float(values.min()), float(values.max())
    close = 1e-3 * (high - low)
    [held] = limit_verdicts([limit(stated, low - close, high + close, arm)], SWING)
    assert held.status is CERTIFIED
    assert held.worst == pytest.approx(low, abs=close) or held.worst == pytest.approx(high, abs=close)
    for bounds in ((low + close, None), (None, high - close)):
        assert prove_expression(limit(stated, *bounds, arm=arm), SWING).status is VIOLATED


OPERATIONS: dict[str, Any] = {
    "sum": lambda m: m.q[0] + m.speed[1] - 2.0 * m.acceleration[2] + 0.1 * m.jerk[3],
    "product": lambda m: (m.q[0] - m.q[1]) * m.speed[2],
    "quotient": lambda m: m.q[0] / (6.0 + m.q[1] ** 2) + 1.0 / (9.0 + m.q[2]),
    "sine": lambda m: ca.sin(2.0 * m.q[1]) * ca.cos(m.q[2]),
    "root": lambda m: ca.sqrt(5.0 + m.q[1]),
    "length": lambda m: ca.norm_2(m.q - m.q[0]),
    "size": lambda m: ca.fabs(m.q[1]) + m.time / m.duration,
    "larger": lambda m: ca.fmax(m.q[1], m.q[2]) - ca.fmin(m.q[0], m.speed[1]),
    "arcs": lambda m: ca.asin(m.q[1] / 5.0) - ca.acos(m.q[2] / 5.0) + ca.atan(m.q[3]),
    "growth": lambda m: ca.exp(m.q[1]) - ca.log(6.0 + m.q[2]),
    "angle": lambda m: ca.atan2(m.tool[1], m.tool[0] + 3.0) + m.positions[2][0] - m.positions[-1][1],
    "places": lambda m: ca.norm_2(m.positions[3] - m.positions[1]) * m.tool[2],
    "rotation": lambda m: m.rotation[0, 1] * m.rotation[2, 0],
    "velocity": lambda m: ca.norm_2(m.tool_velocity),
}


def there_and_back() -> Trajectory:
    """Four joints, from rest to rest in two pieces; accelerations vanish at both ends."""
    bump, slopes = np.poly1d([-1.0, 1.0, 0.0]) ** 3, np.random.default_rng(5).normal(size=(4, 3))
    joints = [80.0 * bump * np.poly1d([a, b]) + np.poly1d([c]) for a, b, c in slopes]
    whole = Trajectory(np.array([0.0, 1.0]), np.array([each.c for each in joints]).T[:, None])
    return whole.part(0.0, 0.4).followed_by(whole.part(0.4, 1.0))


TURNED = PlanarArm(
    (0.5, 0.4, 0.3, 0.2), (9.0,) * 4, (99.0,) * 4, base_point=(0.1, -0.2), base_angle=0.7, tool_offset=(0.1, 0.2)
)


@pytest.mark.parametrize("arm", [sliding_arm(), small_arm(4), TURNED], ids=["sliding", "turning", "plane"])
@pytest.mark.parametrize("name", OPERATIONS)
def test_every_operation_of_the_core_is_proven_closely(name: str, arm: Robot) -> None:
    if arm is TURNED and name in ("places", "rotation"):
        return  # which it has not
    motion, stated = there_and_back(), OPERATIONS[name]
    kept = limit(stated, -1e3, 1e3, arm)
    times, step = np.linspace(0.0, motion.duration, 2_000), motion.breakpoints[1]
    sides = np.concatenate([times, [np.nextafter(step, 0.0)]])
    values = kept.function.probed(arm, motion.samples(sides, arm).states, motion.duration)[:, 0]
    assert kept.in_core is not None
    np.testing.assert_allclose(
        kept.in_core.values(motion.samples(sides, arm).states, motion.duration)[:, 0], values, rtol=1e-12, atol=1e-12
    )
    low, high = float(values.min()), float(values.max())
    close = 1e-3 * (high - low)
    for bounds, status in (
        ((low - close, high + close), CERTIFIED), ((None, high - close), VIOLATED), ((low + close, None), VIOLATED)
    ):  # fmt: skip
        outcome = prove_in_core(limit(stated, *bounds, arm=arm), motion)
        assert outcome is not None and outcome.status is status
        reached = low if outcome.bound in (low - close, low + close) else high
        assert outcome.worst == pytest.approx(reached, abs=close)


@pytest.mark.parametrize("seeds", slow_except([range(9, 13), range(9), range(13, 200)], 1), ids=str)
def test_verdicts_are_those_of_samples_and_of_intervals(seeds: range) -> None:
    found = [one for seed in seeds for one in checked(seed, 2_000)]
    assert not any(one.is_false for one in found)
    assert {CERTIFIED, VIOLATED} <= {one.status for one in found}
    assert all(one.status is CERTIFIED for one in found if one.second and one.second[0] is CERTIFIED)


def test_nothing_is_certified_of_angles_whose_sines_are_not_known() -> None:
    far = Trajectory.standing(np.array([3e5, 0.0]), 1.0)
    several = StatedExpression("own", "m", traced(lambda m: [m.tool[1], m.q[1]], SPACE, "c"), None, (5.0,))
    outcome = prove_in_core(several.for_robot(SPACE, ()), far)
    assert outcome is not None and outcome.status is UNDECIDED


def test_a_spike_between_the_samples_is_not_overlooked() -> None:
    times = np.linspace(0.0, 1.0, 401)
    spike = float((times[100] + times[101]) / 2.0)
    narrow = limit(lambda m: ca.exp(-(((m.time - spike) * 2e5) ** 2)), upper=0.5)
    assert dense(narrow, SWING).max() < 0.5  # nor by twenty thousand samples
    assert prove_expression(narrow, SWING).status is not CERTIFIED
    jump = limit(lambda m: ca.if_else(ca.fabs(m.time - spike) < 1e-9, 1.0, 0.0), upper=0.5)
    assert prove_expression(jump, SWING).status is not CERTIFIED


SPOT = float((np.linspace(0.0, 1.0, 401)[100:102]).mean())  # between two of the first samples


def dip(m: Any) -> Any:
    """Negative for two microseconds."""
    return (m.time - SPOT) ** 2 - 1e-12


@BOTH
@pytest.mark.parametrize(
    ("stated", "lower", "upper"),
    [
        (lambda m: ca.tanh(ca.sqrt(dip(m))), None, 1.5),
        (lambda m: ca.fmin(1.0, ca.sqrt(dip(m))), None, 1.5),
        (lambda m: ca.atan(ca.log(dip(m))), None, 1.6),
        (lambda m: ca.fabs(ca.log(dip(m))), -0.1, None),
        (lambda m: ca.exp(ca.sqrt(dip(m))), -0.1, None),
        (lambda m: ca.sin(1.0 / (m.time - SPOT)), -1.1, 1.1),
        (lambda m: ca.atan2(ca.sqrt(dip(m)), m.q[0] - 10.0), -4.0, 4.0),
        (lambda m: ca.atan2(dip(m), -1.0), 0.0, None),
        (lambda m: ca.atan(ca.tan(ca.log(dip(m)))), -2.0, 2.0),
        (lambda m: ca.if_else(m.time > 2.0, 1.0, ca.tanh(ca.asin(1.0 - dip(m)))), -2.0, 2.0),
        (lambda m: ca.tanh(dip(m) ** 1.5), -2.0, 2.0),
        (lambda m: 1.0 / (m.time - SPOT) ** 2, 0.0, None),
    ],
)
def test_what_is_undefined_for_a_moment_is_never_certified(stated: Any, lower: float, upper: float, arm: Robot) -> None:
    kept = limit(stated, lower, upper, arm)
    assert np.isfinite(dense(kept, SWING)).all()
    assert prove_expression(kept, SWING).status is not CERTIFIED


def test_what_is_guarded_or_far_from_its_poles_is_proven() -> None:
    guarded = limit(lambda m: ca.if_else(m.q[0] > 0.5, ca.log(m.q[0] - 0.4), 0.0), upper=0.0)
    assert prove_expression(guarded, SWING).satisfied
    assert prove_expression(limit(lambda m: ca.sqrt(ca.fmax(m.q[0] - 0.5, 0.0)), upper=0.8), SWING).satisfied
    assert prove_expression(limit(lambda m: ca.sin(1e8 * m.q[0]), upper=1.0 + 1e-8), SWING).satisfied


@pytest.mark.parametrize("far", [1e3, 1e12])
def test_a_far_bound_does_not_blunt_the_near_one(far: float) -> None:
    highest = float(dense(limit(lambda m: m.q[0], upper=1.0), SWING).max())
    for bounds in ((-far, highest - 1e-6), (highest - 1e-6, None), (1e-6, far)):
        assert prove_expression(limit(lambda m: m.q[0], *bounds), SWING).status is VIOLATED


@BOTH
def test_a_jerk_is_infinite_where_accelerations_jump(arm: Robot) -> None:
    found = prove_expression(
        limit(lambda m: m.jerk[0], upper=1e6, arm=arm), SWING
    )  # which starts with 6 rad/s^2 at once
    assert found.status is VIOLATED
    assert found.worst == np.inf
    assert found.where == "accelerations jump, t = 0 s"


def test_what_cannot_be_bounded_is_undecided_and_what_is_undefined_violated() -> None:
    assert prove_expression(limit(lambda m: ca.erf(m.q[0]), upper=1.0), SWING).satisfied
    touched = limit(lambda m: m.q[0] - m.q[0] * ca.cos(m.q[1] - m.q[1]), upper=0.0)
    assert prove_expression(touched, SWING).status in (CERTIFIED, UNDECIDED)
    remainder = limit(lambda m: ca.fmod(m.q[0], 10.0), upper=5.0)
    assert prove_expression(remainder, SWING).status is UNDECIDED
    undefined = prove_expression(limit(lambda m: ca.sqrt(m.q[0] - 0.5), upper=5.0), SWING)
    assert undefined.status is VIOLATED
    assert undefined.worst == np.inf


@pytest.mark.parametrize("name", [*UNARY, *BINARY])
def test_ranges_hold_what_is_in_them(name: str) -> None:
    rng, count, unary = np.random.default_rng(7), 300, name in UNARY
    corners = np.sort(rng.normal(scale=1.5, size=(2, count, 2)), axis=2)
    corners[:, :60] = np.round(corners[:, :60])  # on kinks, poles and zeros
    interpreter = Ranges(count)
    sides = [(each[:, 0], each[:, 1]) for each in corners]
    low, high = interpreter.unary(name, sides[0]) if unary else interpreter.binary(name, sides[0], sides[1])
    x = ca.SX.sym("x", 2)
    operation = ca.SX.unary(tapes.UNARY[name], x[0]) if unary else ca.SX.binary(tapes.BINARY[name], x[0], x[1])
    function = ca.Function("f", [x], [operation])
    for share in np.linspace(0.0, 1.0, 20):
        other = rng.choice([0.0, 1.0, rng.uniform()], size=count)
        inside = np.stack([c[:, 0] + s * (c[:, 1] - c[:, 0]) for c, s in zip(corners, (share, other), strict=True)])
        inside = np.clip(inside, *np.moveaxis(corners, 2, 0))
        values = np.asarray(function(inside)).ravel()
        defined = np.isfinite(values)
        known = np.isfinite(low) & np.isfinite(high)
        assert defined[known].all()  # what has bounds is defined all over the box
        assert (values[known] >= low[known]).all()
        assert (values[known] <= high[known]).all()
    assert known.any() or name in ("copysign", "fmod")


def test_a_power_with_one_exponent_is_sharp() -> None:
    interpreter = Ranges(2)
    base = np.array([-2.0, 1.0]), np.array([1.0, 3.0])
    for exponent in (2.0, 3.0):
        low, high = interpreter.binary("pow", base, interpreter.constant(exponent))
        np.testing.assert_allclose(low, [0.0, 1.0] if exponent == 2.0 else [-8.0, 1.0])
        np.testing.assert_allclose(high, [4.0, 9.0] if exponent == 2.0 else [1.0, 27.0])


@pytest.mark.parametrize(
    ("stated", "degree"),
    [
        (lambda m: ca.norm_2(m.tool_velocity), 1.0),
        (lambda m: ca.sumsqr(m.speed), 2.0),
        (lambda m: m.acceleration[0], 2.0),
        (lambda m: m.jerk[1] * m.speed[0], 4.0),
        (lambda m: m.tool[1], None),
        (lambda m: m.speed[0] + m.acceleration[0], None),
        (lambda m: m.speed[0] * m.time, None),
        (lambda m: 0.0 * m.speed[0], None),
    ],
)
def test_which_limits_every_shape_keeps_if_it_is_slow_enough(stated: Any, degree: float | None) -> None:
    kept = limit(stated, -0.5, 1.0)
    assert kept.degree == degree
    assert kept.scales_with_time is (degree is not None)
    assert limit(stated, 0.5, 1.0).degree is None  # standing still breaks it
    if degree is not None:
        samples = SWING.samples(SWING.times(50), ARM)
        factor = float(kept.time_scale(ca.mmax(kept.magnitudes(samples))))
        slower = SWING.time_scaled(factor)
        values = np.asarray(kept.function.at(slower.samples(slower.times(50), ARM)))
        assert max(values.max() / 1.0, values.min() / -0.5) == pytest.approx(1.0)
