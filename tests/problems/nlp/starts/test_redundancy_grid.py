"""Dynamic programming over the redundancy: against every sequence there is, on a small grid."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from problems import Ellipse, PlanarArm
from problems.families.knots import starts
from problems.families.knots.starts import RedundancyGrid
from problems.nlp.starts import Postures

LIMITS = ((-3.0, 3.0), (0.0, 3.0), (-2.9, 2.9))
POINTS = [(1.0, 0.0), (1.0, 0.4), (0.7, 0.9), (0.2, 1.1)]
WEIGHTS = np.array([1.0, 0.5, 2.0])


def grid(elbows: tuple[float, ...] = (1.0,), limited: bool = False, exponent: float = 3.0) -> RedundancyGrid:
    arm = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3, LIMITS if limited else None)
    return RedundancyGrid(Postures(arm, POINTS), elbows, (), WEIGHTS, exponent)


@pytest.mark.parametrize(("elbows", "limited"), [((1.0,), False), ((-1.0, 1.0), False), ((1.0,), True)])
@pytest.mark.parametrize("exponent", [1.5, 3.0])
def test_no_sequence_is_cheaper(
    elbows: tuple[float, ...], limited: bool, exponent: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(starts, "MAX_POSTURES_PER_KNOT", 7)
    small, shift = grid(elbows, limited, exponent), np.array([0.3])
    way = small.cheapest(shift)
    theta, possible = small.table(shift)
    costs = {}
    for chosen in product(range(theta.shape[1]), repeat=len(POINTS)):
        if all(possible[knot, state] for knot, state in enumerate(chosen)):
            steps = np.diff([theta[knot, state] for knot, state in enumerate(chosen)], axis=0)
            short = steps if limited else (steps + np.pi) % (2.0 * np.pi) - np.pi
            costs[chosen] = float((np.abs(WEIGHTS * short) ** exponent).sum())
    assert way is not None
    assert (np.abs(WEIGHTS * np.diff(way, axis=0)) ** exponent).sum() == pytest.approx(min(costs.values()))
    best = theta[range(len(POINTS)), min(costs, key=lambda chosen: costs[chosen])]
    assert np.exp(1j * way) == pytest.approx(np.exp(1j * best))


def test_the_first_posture_can_be_asked_for() -> None:
    theta, possible = grid().table(np.zeros(1))
    expected = theta[0][possible[0]][int(0.6 * possible[0].sum())]
    way = grid().cheapest(np.zeros(1), 0.6)
    assert way is not None
    assert way[0] == pytest.approx(expected)


def test_postures_that_touch_an_obstacle_are_left_out() -> None:
    free = grid()
    beside = Ellipse((0.45, 0.35), (0.1, 0.1))
    around = RedundancyGrid(free.postures, (1.0, -1.0), (beside,), WEIGHTS, 3.0)
    way = around.cheapest(np.zeros(1))
    assert way is not None
    for theta in way:
        corners = np.append(0.0, np.cumsum(np.array([0.7, 0.7, 0.6]) * np.exp(1j * np.cumsum(theta))))
        along = np.linspace(corners[:-1], corners[1:], 200)
        assert np.abs(along - (0.45 + 0.35j)).min() > 0.1 - 1e-3
    everywhere = Ellipse((0.6, 0.2), (0.55, 0.55))
    assert RedundancyGrid(free.postures, (1.0,), (everywhere,), WEIGHTS, 3.0).cheapest(np.zeros(1)) is None


def test_an_arm_of_many_links_has_no_more_states() -> None:
    arm = PlanarArm((0.5,) * 5, (4.0,) * 5, (20.0,) * 5)
    states = RedundancyGrid(Postures(arm, POINTS), (1.0,), (), np.ones(5), 3.0).angles
    assert states.shape == (64, 3)
    assert len(np.unique(states, axis=0)) == 64
