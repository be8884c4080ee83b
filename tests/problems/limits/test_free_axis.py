"""Free axes of the tool, against SciPy's rotations: what is free, what is next to it, limits, what is refused."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from problems import InvalidProblem
from problems.base import FloatArray, as_array
from problems.limits import FreeAxis

KINDS = [
    FreeAxis("z"),
    FreeAxis("x", (-0.4, 0.9)),
    FreeAxis("y", (2.0, 5.5)),
    FreeAxis("x", tilt=0.3),
    FreeAxis("z", tilt=1.2),
]
ROUNDING = 1e-9


def rows(rotations: Rotation) -> ca.DM:
    return ca.DM(rotations.as_matrix().reshape(-1, 9))


def misses(free: FreeAxis, stated: Rotation, rotations: Rotation) -> FloatArray:
    return as_array(free.misses(rows(stated), rows(rotations))).max(axis=1)


def lean(free: FreeAxis, stated: Rotation, rotations: Rotation) -> FloatArray:
    """The angle between the axis as it is and as it is stated."""
    axis = np.eye(3)[free.index]
    return np.asarray(2.0 * np.arcsin(np.linalg.norm(rotations.apply(axis) - stated.apply(axis), axis=1) / 2.0))


@pytest.mark.parametrize("free", KINDS, ids=str)
@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_what_is_free_and_what_is_next_to_it(free: FreeAxis, seed: int) -> None:
    rng = np.random.default_rng(seed)
    stated, others = Rotation.random(1, rng), Rotation.random(8, rng)
    allowed = stated * Rotation.from_matrix(free.offsets(free.within(rng.normal(0.0, 3.0, (8, 3)))))
    assert misses(free, stated, allowed).max() <= ROUNDING
    assert lean(free, stated, allowed).max() <= free.tilt + 1e-7
    matrix = stated.as_matrix()[0]
    nearest = Rotation.from_matrix(free.nearest_of(matrix, others.as_matrix()))
    assert misses(free, stated, nearest).max() <= ROUNDING
    again = Rotation.from_matrix(free.nearest_of(matrix, nearest.as_matrix()))
    assert (nearest.inv() * again).magnitude().max() <= 1e-7
    if free.turn is None:  # of all that are free none is nearer: the axis goes straight to where it may be
        aside = lean(free, stated, others)
        assert (others.inv() * nearest).magnitude() == pytest.approx(np.maximum(0.0, aside - free.tilt), abs=1e-7)
        beyond = misses(free, stated, others)
        chords = 2.0 * np.sin(aside / 2.0) - 2.0 * np.sin(free.tilt / 2.0)
        assert not free.tilt or beyond == pytest.approx(np.maximum(0.0, chords), abs=1e-7)
    for rotation, (turn, tilt) in ((each, free.taken(matrix, each.as_matrix())) for each in allowed):
        assert tilt <= free.tilt + 1e-7
        assert free.turn is None or free.turn[0] - 1e-7 <= turn <= free.turn[1] + 1e-7
        untilted = (stated * Rotation.from_rotvec(turn * np.eye(3)[free.index]))[0]
        assert (untilted.inv() * rotation).magnitude() == pytest.approx(tilt, abs=1e-7)


@pytest.mark.parametrize("free", KINDS, ids=str)
def test_limits_hold_exactly_within(free: FreeAxis) -> None:
    rng, accuracy = np.random.default_rng(5), 0.01
    stated, turns = Rotation.random(1, rng), np.linspace(-np.pi, np.pi, 37)
    symbols = ca.SX.sym("stated", 1, 9), ca.SX.sym("rotation", 1, 9)
    expressions, uppers = zip(*free.limits(*symbols, accuracy), strict=True)
    function = ca.Function("limits", list(symbols), [ca.vertcat(*expressions)])
    bound, (low, high) = np.concatenate(uppers), free.turn or (-np.inf, np.inf)
    for turn in turns:
        for aside in (0.0, 0.005, 0.02, 0.29, 0.31, 1.19, 1.21, 3.0):
            lean_axis = np.eye(3)[(free.index + 1) % 3]  # which leaves the axis beside as it is turned
            rotation = (
                stated
                * Rotation.from_rotvec([turn * np.eye(3)[free.index]])
                * Rotation.from_rotvec([aside * lean_axis])
            )
            values = as_array(function(rows(stated), rows(rotation))).ravel()
            around = (turn - (low + high) / 2.0 + np.pi) % (2.0 * np.pi) - np.pi if free.turn else 0.0
            inside = aside <= max(free.tilt, accuracy) and (
                free.turn is None or abs(around) <= (high - low) / 2.0 + accuracy
            )
            assert (values <= bound).all() == inside, (turn, aside)


def test_looked_at_are_turns_and_leans_the_stated_one_first() -> None:
    assert len(FreeAxis("z").grid) == 24
    grid = FreeAxis("z", (-0.5, 0.5)).grid
    assert np.abs(grid[:, 0]).max() == 0.5
    for free in KINDS:
        found = free.grid
        assert free.turn is not None or not found[0].any()
        assert np.allclose(free.within(found), found)


@pytest.mark.parametrize(
    ("keys", "field", "reason"),
    [
        (("w", None, 0.0), "free", "'w' is no axis of the tool"),
        (("z", (0.1, 0.1), 0.0), "turn", "0.1 is not below 0.1"),
        (("z", (-4.0, 3.0), 0.0), "turn", "beyond a whole turn"),
        (("z", (-0.1, float("nan")), 0.0), "turn", "-0.1 is not below nan"),
        (("z", None, 1.6), "tilt", "1.6 is not within"),
        (("z", (-0.1, 0.1), 0.1), "tilt", "leave turn or tilt out"),
        ((None, (-0.1, 0.1), 0.0), "turn", "of which axis"),
        ((None, None, 0.1), "tilt", "of which axis"),
    ],
)
def test_what_is_no_free_axis_is_refused_by_name(keys: tuple, field: str, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason) as caught:
        free = FreeAxis.stated(*keys)
        assert free is not None
        free.check()
    assert caught.value.field == field
