"""Margins that vanish at the ends of a motion, by hand."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links

from problems import Ellipse
from problems.base import Arguments, as_array
from problems.limits import Clearance, Limit, TaperedMargin, limits_of
from problems.limits.joint_limits import JointRange, SpeedLimit
from problems.limits.staying import PLACE_EASING, PLACE_SHARE, RATE_EASING, RATE_SHARE
from problems.motions import Samples

ARM = replace(equal_links(2), joint_limits=((-1.0, 1.0), (-2.0, 2.0)))
OBSTACLE = Ellipse((1.5, 1.5), (0.1, 0.2))
DURATION = 4.0


def at(limit: Limit, share: float) -> tuple[np.ndarray, np.ndarray]:
    """The bounds of the first constraint at a share of the duration."""
    still = (ca.DM.zeros(1, 2),) * 4
    now = Samples(robot=ARM, derivatives=still, duration=ca.DM(DURATION), times=ca.DM(share * DURATION))
    constraint = TaperedMargin(limit).constraints_at(now)[0]
    lower, upper = (np.empty(0) if b is None else as_array(b).ravel() for b in (constraint.lower, constraint.upper))
    return lower, upper


@pytest.mark.parametrize(("share", "part"), [(0.0, 0.0), (RATE_EASING / 2.0, 0.5), (RATE_EASING, 1.0), (1.0, 1.0)])
def test_rates_keep_a_margin_soon_after_the_start(share: float, part: float) -> None:
    lower, upper = at(SpeedLimit(ARM), share)
    assert upper == pytest.approx([4.0 * (1.0 - part * RATE_SHARE)] * 2)
    assert lower == pytest.approx(-upper)


@pytest.mark.parametrize(
    ("share", "part"),
    [(0.0, 0.0), (PLACE_EASING / 3.0, 1.0 / 3.0), (0.5, 1.0), (1.0 - PLACE_EASING / 4.0, 0.25), (1.0, 0.0)],
)
def test_postures_keep_a_margin_in_the_middle(share: float, part: float) -> None:
    lower, upper = at(JointRange(ARM), share)
    assert upper == pytest.approx(np.array([1.0, 2.0]) - part * PLACE_SHARE * np.array([2.0, 4.0]))
    assert lower == pytest.approx(-upper)
    clearance = Clearance.for_robot(ARM, (OBSTACLE,))
    assert clearance is not None
    lower, upper = at(clearance, share)
    assert lower == pytest.approx([part * PLACE_SHARE * ARM.radius] * len(clearance.pairs))
    assert not upper.size


def test_steps_keep_it_too() -> None:
    clearance = Clearance.for_robot(ARM, (OBSTACLE,))
    assert clearance is not None
    before, after = (
        Samples(robot=ARM, derivatives=(ca.DM.zeros(1, 2),), duration=ca.DM(2.0), times=ca.DM(t)) for t in (0.9, 1.0)
    )
    [swept] = TaperedMargin(clearance).between(before, after)
    assert swept.lower is not None
    assert as_array(swept.lower) == pytest.approx(np.full((1, len(clearance.pairs)), PLACE_SHARE * ARM.radius))


def test_the_twin_has_the_numbers_of_the_limit() -> None:
    for limit in limits_of(ARM, (OBSTACLE,)):
        own, eased = Arguments(), Arguments()
        own.symbolic_copy(limit)
        eased.symbolic_copy(TaperedMargin(limit))
        assert own.values.tolist() == eased.values.tolist()
        assert TaperedMargin(limit).robot_or_none is limit.robot_or_none
