"""Where a motion breaks its limits, marked: in the figure of limits and in the player."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.animation.frames import broken_notes, judged_frames
from tpbso_casadi.animation.player import page
from tpbso_casadi.animation.player_data import shared_data
from tpbso_casadi.figures.limits import limits_figure
from tpbso_casadi.planning import PlannedMotion

ARM = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (30.0, 30.0))
FIRST = 0.8 * (1.0 - np.sqrt(1.0 - 4.0 * np.sqrt(1.6 / 30.0))) / 2.0  # where 30 u^2 (1 - u)^2 / 0.8 s is 2 rad/s


@cache
def fast(seconds: float = 0.8) -> PlannedMotion:
    ends = np.array([[0.0, 0.3], [1.0, 0.3]])
    return tp.certify(([0.0, seconds], ends, 0.0 * ends, 0.0 * ends), ARM).planned


def test_the_figure_has_a_band_where_a_limit_is_broken() -> None:
    above = limits_figure(fast()).axes[0]
    [band] = above.patches
    left, right = band.get_extents().transformed(above.transData.inverted()).intervalx
    assert (left, right) == pytest.approx((FIRST, 0.8 - FIRST), abs=1e-4)
    assert above.get_title().endswith("; broken: speed")
    assert above.get_ylim()[1] == pytest.approx(1.05 * 1.875 / 0.8 / 2.0, rel=1e-3)
    assert not limits_figure(fast(2.0)).axes[0].patches


def test_speeds_that_jump_are_lines() -> None:
    rows = np.array([[0.0, 0.3], [0.4, 0.3], [0.4, 0.3]])
    motion = tp.certify(([0.0, 1.0, 2.0], rows), ARM).planned
    above = limits_figure(motion).axes[0]
    assert [line.get_xdata()[0] for line in above.lines if len(set(line.get_xdata())) == 1] == [1.0]
    assert motion.motion.broken_spans == {"acceleration": [(1.0, 1.0)]}


def test_the_player_tells_when_and_marks_it() -> None:
    frames = judged_frames(fast().motion)
    data = shared_data(frames)
    assert data["broken"] == [pytest.approx([FIRST, 0.8 - FIRST], abs=1e-6)]
    assert [text for _, text in data["notes"]] == ["broken now: speed", ""]
    assert "markedBy(broken, clock.end)" in page("fast", frames)
    assert shared_data(judged_frames(fast(2.0).motion))["broken"] == []


def test_notes_name_all_that_is_broken_at_a_time() -> None:
    notes = broken_notes({"speed": [(0.25, 1.5)], "torque": [(0.5, 0.5)]}, 12.5)
    assert [text for _, text in notes] == [
        "broken now: speed", "broken now: speed, torque", "broken now: speed", "",
    ]  # fmt: skip
    assert [time for time, _ in notes] == pytest.approx([0.25, 0.5, 0.75, 1.5])
