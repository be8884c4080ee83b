"""Expressions as rows of linear programs: values, slopes, room, time, and the nearest postures that keep them."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.space import small_arm

from problems.limits import StatedExpression, ToolRegion, ToolSpeed, Upright
from problems.motions import traced
from problems.polish import ExpressionLimits, ExpressionSettings
from problems.polish.settings import DEFAULT_REFINEMENT

ARM = small_arm()
MARGIN, SMALL_LENGTH = ExpressionSettings.margin, ExpressionSettings.small_length
RNG = np.random.default_rng(3)
UPRIGHT = Upright(toward=(0.0, 0.0, 1.0), tolerance=0.2).for_robot(ARM, ())
ABOVE = ToolRegion(point=(0.0, 0.0, 0.3), normal=(0.0, 0.0, 1.0)).for_robot(ARM, ())
SPEED = ToolSpeed(max=0.5).for_robot(ARM, ())
LIMITS = ExpressionLimits.of((UPRIGHT, ABOVE, SPEED))


def states(count: int) -> np.ndarray:
    return RNG.uniform(-1.0, 1.0, (count, 3 * ARM.dof))


def test_values_are_shares_of_the_scale_beyond_a_bound() -> None:
    state = states(5)
    full = np.pad(state, ((0, 0), (0, ARM.dof + 1)))
    tilt, height, speed = (limit.function.probed(ARM, full)[:, 0] for limit in (UPRIGHT, ABOVE, SPEED))
    expected = np.column_stack([(tilt - 0.2) / 0.2, -height, (speed - 0.5) / 0.5])
    np.testing.assert_allclose(LIMITS.values(state), expected, atol=1e-9)


def test_slopes_are_those_of_differences() -> None:
    state, step = states(3), 1e-6
    _, slopes = LIMITS.linear(state)
    for column in range(state.shape[1]):
        other = state.copy()
        other[:, column] += step
        change = (LIMITS.values(other) - LIMITS.values(state)) / step
        np.testing.assert_allclose(slopes.reshape(3, 3, -1)[:, :, column], change, atol=1e-4)


def test_expressions_that_the_core_does_not_know_have_slopes_too() -> None:
    steep = traced(lambda m: ca.sinh(m.tool[0]) + m.q[1] ** 2, ARM, "steep")
    own = ExpressionLimits.of((StatedExpression("steep", "m", steep, None, (0.5,)).for_robot(ARM, ()),))
    theta, step = RNG.uniform(-1.0, 1.0, (3, ARM.dof)), 1e-6
    values, slopes = own.linear(theta)
    np.testing.assert_allclose(values, own.values(np.pad(theta, ((0, 0), (0, 2 * ARM.dof)))))
    for column in range(ARM.dof):
        change = (own.values(theta + step * np.eye(ARM.dof)[column]) - values) / step
        np.testing.assert_allclose(slopes[:, :, 0, column], change, atol=1e-4)


def test_what_is_of_postures_alone_is_known_and_time_restores_the_rest() -> None:
    assert LIMITS.is_static.tolist() == [True, True, False]
    state = states(4)
    scale = LIMITS.time_scale(state)
    slower = state.copy()
    slower[:, ARM.dof :] /= scale
    assert LIMITS.values(slower)[:, 2].max() == pytest.approx(-MARGIN, abs=1e-9)
    assert ExpressionLimits.of((UPRIGHT,)).time_scale(state) == 0.0


def test_projected_postures_keep_what_they_must() -> None:
    theta = RNG.uniform(-0.4, 0.4, (20, ARM.dof))
    margins = np.full(3, MARGIN)
    found = LIMITS.projected(theta, margins)
    broken = (LIMITS.at_rest(theta)[:, :2] > 0.0).any(axis=1)
    assert broken.any() and LIMITS.allow(found).all()
    kept = (LIMITS.at_rest(theta)[:, :2] <= -MARGIN).all(axis=1)
    np.testing.assert_array_equal(found[kept], theta[kept])


def test_no_more_is_kept_than_the_ends_leave() -> None:
    theta = LIMITS.projected(RNG.uniform(-0.2, 0.2, (1, ARM.dof)), np.zeros(3))[0]
    margins = LIMITS.margins(theta, theta)
    assert (margins <= MARGIN).all() and (LIMITS.at_rest(theta[None])[0] + margins <= 1e-12).all()


@pytest.mark.parametrize("components", [2, 3])
def test_programs_know_a_small_ball_by_planes_that_touch_it(components: int) -> None:
    radius, point = 0.8 * SMALL_LENGTH, np.array([0.1, -0.2, 0.3])[:components]
    expression = traced(lambda m: ca.norm_2(m.q[:components] - ca.DM(point)), ARM, "ball")
    own = ExpressionLimits.of((StatedExpression("ball", "rad", expression, None, (radius,)).for_robot(ARM, ()),))
    theta = np.zeros((2000, ARM.dof))
    theta[:, :components] = point + RNG.uniform(-1.5, 1.5, (2000, components)) * radius
    away = np.linalg.norm(theta[:, :components] - point, axis=1) / radius
    values = own.at_rest(theta)
    np.testing.assert_allclose(values[:, 0], away - 1.0, atol=1e-6)
    assert values.shape[1] == 1 + {2: 8, 3: 14}[components]
    np.testing.assert_array_equal(own.allow(theta), away <= 1.0)
    middle = np.pad(point, (0, ARM.dof - components))
    margins = own.margins(middle, middle)
    assert (margins[0], margins[1:].min()) == (MARGIN, 0.2)
    kept = (values[:, 1:] + margins[1:] <= 0.0).all(axis=1)
    assert kept.any() and (away[kept] <= 1.0).all()


def test_what_depends_on_the_time_is_left_to_a_search() -> None:
    late = StatedExpression("late", "1", traced(lambda m: m.q[0] * m.time, ARM, "late"), None, (1.0,))
    assert ExpressionLimits.supports(UPRIGHT) and not ExpressionLimits.supports(late.for_robot(ARM, ()))
    assert ExpressionLimits.among(()) is None and ExpressionLimits.among((SPEED,)) is ExpressionLimits.among((SPEED,))


def test_first_steps_are_as_long_as_the_smallest_ball_lets_them() -> None:
    ball = StatedExpression("ball", "m", traced(lambda m: ca.norm_2(m.tool), ARM, "ball"), None, (2e-3,))
    first = ExpressionLimits.of((UPRIGHT, ball.for_robot(ARM, ()))).longest_first_step
    assert first == pytest.approx(np.sqrt(2.0 * 2e-3)) and LIMITS.longest_first_step == np.inf
    settings = DEFAULT_REFINEMENT.beginning_with(first)
    assert (settings.polish.region.first, settings.beginning_with(np.inf)) == (first, settings)
