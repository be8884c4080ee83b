"""Constraints by hand: penalties, rows of a program, verdicts, margins that vanish at the ends, angles from a line."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from scipy.spatial.transform import Rotation, Slerp

from problems import Constraint, Ellipse, Limit, PenaltyKind
from problems.base import as_array
from problems.certify import verdict
from problems.limits import AngularAccuracy, Clearance, TaperedMargin, shares_along
from problems.limits.joint_limits import JointRange, SpeedLimit
from problems.limits.staying import TAPER
from problems.motions import Samples
from problems.robots import Orientations


def limit(values: list[list[float]], penalty: PenaltyKind = PenaltyKind.COUNT, **more: Any) -> Constraint:
    two = ca.DM([[2.0, 4.0]])
    options: dict[str, Any] = {"name": "limit", "equation": "(1)", "unit": "m", "columns": ("a", "b"), "scale": two}
    return Constraint(expression=ca.DM(values), lower=-two, upper=two, penalty=penalty, **(options | more))


def single(values: list[float], **more: Any) -> Constraint:
    return Constraint(**({"name": "c", "unit": "1", "expression": ca.DM(values), "columns": ("x",)} | more))


def test_rows_of_a_program_are_scaled_column_after_column() -> None:
    rows = limit([[1.0, -5.0], [3.0, 4.0]])
    assert np.asarray(rows.row_values()).ravel().tolist() == [0.5, 1.5, -1.25, 1.0]
    low, high = rows.row_bounds()
    assert low.tolist() == [-1.0] * 4
    assert high.tolist() == [1.0] * 4


def test_transformed_rows_break_exactly_when_the_limit_does() -> None:
    values = np.linspace(0.0, 3.0, 31)
    two = ca.DM(2.0)
    rows = single(values, lower=None, upper=two, scale=two, transform=lambda v: v**3)
    lower, upper = rows.row_bounds()
    row_entries = np.asarray(rows.row_values()).ravel()
    assert (lower == -np.inf).all()
    assert ((row_entries > upper) == (values > 2.0)).all()


def test_verdict_names_the_worst_entry() -> None:
    broken = verdict(limit([[1.0, -5.0], [1.9, 4.0]]), np.array([0.5, 1.5]))
    assert (broken.worst, broken.bound, broken.satisfied, broken.excess) == (-5.0, -4.0, False, 1.0)
    assert broken.where == "b, t = 0.5 s"
    inside = verdict(limit([[1.0, -3.0], [1.9, 3.0]], for_all_t=False), np.array([0.5, 1.5]))
    assert (inside.worst, inside.bound, inside.satisfied, inside.excess, inside.where) == (1.9, 2.0, True, 0.0, "a")


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


@pytest.mark.parametrize(("share", "part"), [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0), (1.0 / TAPER.rate_easing, 1.0)])
def test_rates_keep_a_margin_soon_after_the_start(share: float, part: float) -> None:
    lower, upper = at(SpeedLimit(ARM), share * TAPER.rate_easing)
    assert upper == pytest.approx([4.0 * (1.0 - part * TAPER.rate_share)] * 2)
    assert lower == pytest.approx(-upper)


@pytest.mark.parametrize(
    ("share", "part"),
    [(0.0, 0.0), (TAPER.place_easing / 3.0, 1.0 / 3.0), (0.5, 1.0), (1.0 - TAPER.place_easing / 4.0, 0.25), (1.0, 0.0)],
)
def test_postures_keep_a_margin_in_the_middle(share: float, part: float) -> None:
    lower, upper = at(JointRange(ARM), share)
    assert upper == pytest.approx(np.array([1.0, 2.0]) - part * TAPER.place_share * np.array([2.0, 4.0]))
    assert lower == pytest.approx(-upper)
    clearance = Clearance.for_robot(ARM, (OBSTACLE,))
    assert clearance is not None
    lower, upper = at(clearance, share)
    assert lower == pytest.approx([part * TAPER.place_share * ARM.radius] * len(clearance.pairs))
    assert not upper.size


def test_angles_are_those_of_spherical_interpolation() -> None:
    rng = np.random.default_rng(5)
    ends = Rotation.from_rotvec([[0.2, -0.3, 0.1], [0.9, 0.8, -0.4]])
    line = Orientations(ends.as_quat())
    row = np.concatenate([line.matrices[0].ravel(), line.axes[0], line.angles])
    shares = rng.uniform(0.0, 1.0, 12)
    wanted = Slerp([0.0, 1.0], ends)(shares)
    angles = np.array([0.0, 1e-6, *rng.uniform(0.0, 3.1, 10)])
    axes = rng.normal(size=(12, 3))
    tool = wanted * Rotation.from_rotvec(angles[:, None] * axes / np.linalg.norm(axes, axis=1)[:, None])
    constraint = AngularAccuracy(0.01).along(
        ca.DM(tool.as_matrix().reshape(-1, 9)), ca.DM(shares), ca.DM(np.tile(row, (12, 1))), margin=0.1
    )
    assert constraint.expression.full().ravel() == pytest.approx(angles, rel=1e-9, abs=1e-12)
    assert constraint.bounds[1] == pytest.approx([0.009])


def test_nearest_points_of_lines_by_hand() -> None:
    tool = ca.DM([[0.5, 1.0, 0.0], [-1.0, 0.0, 2.0], [3.0, 0.0, 0.0]])
    starts, ends = ca.DM.zeros(3, 3), ca.repmat(ca.DM([[2.0, 0.0, 0.0]]), 3, 1)
    assert shares_along(tool, starts, ends).full().ravel().tolist() == [0.25, 0.0, 1.0]
