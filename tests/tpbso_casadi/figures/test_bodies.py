"""Links drawn as thick as they are."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure
from oracles.outlines import to_segment

from problems import PlanarArm
from tpbso_casadi.figures.scene import capsule, draw_bodies, wide_bodies

ARM = PlanarArm((0.5, 0.4), (1.0,) * 2, (1.0,) * 2, link_radius=(0.1, 0.0), tool_offset=(0.1, 0.1))


def test_only_wide_bodies_are_drawn_to_scale() -> None:
    skeleton = ARM.skeleton(np.array([[0.4, -0.9]]))[0]
    assert [body.name for body in wide_bodies(ARM)] == ["link 1"]
    [body] = wide_bodies(ARM)
    outline = capsule(body, skeleton)
    assert to_segment(outline, skeleton[0], skeleton[1]) == pytest.approx(np.full(len(outline), 0.1))
    ahead, beside = (skeleton[1] - skeleton[0]) / 0.5, np.array([-1.0, 1.0]) * ((skeleton[1] - skeleton[0]) / 0.5)[::-1]
    along, across = (outline - skeleton[0]) @ ahead, (outline - skeleton[0]) @ beside
    assert (along.min(), along.max()) == pytest.approx((-0.1, 0.6), abs=2e-3)
    assert (across.min(), across.max()) == pytest.approx((-0.1, 0.1))
    axes = Figure().subplots()
    [patch] = draw_bodies(axes, ARM, skeleton, "black")
    assert list(axes.patches) == [patch]
    assert draw_bodies(axes, PlanarArm((0.5, 0.4), (1.0,) * 2, (1.0,) * 2), skeleton, "black") == []
