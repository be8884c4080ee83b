"""The outline and the box of an ellipse, for drawing."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from problems import Ellipse
from problems.base import as_array


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
def test_the_outline_lies_on_the_ellipse_and_fills_its_box(angle: float) -> None:
    ellipse = Ellipse((0.8, -0.3), (0.15, 0.25), angle)
    outline = ellipse.outline(4000)
    assert outline.shape == (4000, 2)
    u, v = (as_array(part) for part in ellipse.to_unit_circle(ca.DM(outline)))
    np.testing.assert_allclose(u**2 + v**2, 1.0, atol=1e-12)
    lower, upper = ellipse.bounding_box()
    np.testing.assert_allclose(outline.min(axis=0), lower, atol=1e-5)
    np.testing.assert_allclose(outline.max(axis=0), upper, atol=1e-5)
    x, y = outline.T
    assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0.0  # counter-clockwise
