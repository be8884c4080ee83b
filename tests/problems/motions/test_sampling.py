"""Motions row by row and all at once: the same bits, times and quadrature; and the exact motion at these times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links

from problems.base import as_array
from problems.families.knots.motion import KnotSpline
from problems.families.time_splines import TimeSpline
from problems.families.two_segments import Quantities
from problems.families.two_segments.motion import TwoSegments
from problems.families.via_times.motion import NodeStates, StatePieces
from problems.motions import SMOOTH_ORDERS, Motion, PathSpline, Samples, TimedPath
from problems.motions.splines import SplineShape

RNG = np.random.default_rng(0)
ROBOT = equal_links(3)
UNEVEN = (0.0, 0.02, 0.06, 0.1, 0.5, 0.52, 0.9, 0.98, 1.0)


def quantities(t1: float, t2: float) -> Quantities:
    return Quantities(*(ca.DM(RNG.normal(size=(1, 3))) for _ in range(4)), ca.DM(t1), ca.DM(t2))


def spline(knots: Sequence[float], steps: int, time: float) -> tuple[KnotSpline, SplineShape]:
    motion = KnotSpline(ROBOT, tuple(knots), 11, steps)
    shape = motion.spline.coefficients(ca.DM(RNG.normal(size=(len(knots), 3))))
    return motion, SplineShape(shape, ca.DM(time))


def path(nodes: Sequence[float], steps: int, slower: float, integrated: bool = False) -> tuple[PathSpline, TimedPath]:
    motion = PathSpline(ROBOT, tuple(nodes), steps, integrated=integrated)
    points = ca.DM(RNG.normal(size=(motion.spline.size, 3)))
    return motion, motion.timed(points, (ca.DM(0.0), None)).time_scaled(slower, 0.0)


def time_spline(pieces: int, steps: int, time: float) -> tuple[TimeSpline, SplineShape]:
    motion = TimeSpline(ROBOT, pieces, steps)
    return motion, SplineShape(ca.DM(RNG.normal(size=(motion.spline.size, 3))), ca.DM(time))


def states(pieces: int, steps: int) -> tuple[StatePieces, NodeStates]:
    rows = (ca.DM(RNG.normal(size=(pieces + 1, 3))) for _ in range(3))
    return StatePieces(ROBOT, pieces, steps), NodeStates(*rows, ca.DM(RNG.uniform(0.2, 2.0, pieces)))


MOTIONS: dict[str, tuple[Motion[Any], Any]] = {
    "two segments": (TwoSegments(ROBOT, 7), quantities(0.3, 1.7)),
    "two segments, few steps": (TwoSegments(ROBOT, 1), quantities(2.1, 0.4)),
    "spline": spline(np.linspace(0.0, 1.0, 6).tolist(), 4, 1.3),
    "spline, uneven knots": spline(UNEVEN, 6, 0.37),
    "spline of two knots": spline((0.0, 1.0), 2, 2.0),
    "path": path(np.linspace(0.0, 1.0, 5).tolist(), 6, 1.0),
    "path, uneven nodes, slowly": path(UNEVEN, 5, 1.7),
    "path, with points for integrals": path(UNEVEN, 5, 1.3, integrated=True),
    "spline in time": time_spline(4, 13, 1.9),
    "between states": states(4, 3),
    "between two states": states(1, 2),
    "spline in time of two pieces": time_spline(2, 5, 0.4),
}
each_motion = pytest.mark.parametrize(("motion", "parameters"), MOTIONS.values(), ids=MOTIONS)


def row_by_row(motion: Motion[Any], parameters: Any, orders: tuple[int, ...]) -> list[Samples]:
    """What a compiled loop would see."""
    blocks = motion.blocks(parameters, orders)
    size, width = motion.piece_sizes(orders)
    assert blocks.shape[1] == 1
    return [
        motion.at(blocks[piece * size : piece * size + width], ca.DM(row), motion.durations(parameters), orders)
        for row, piece in zip(motion.grid.rows, motion.grid.pieces, strict=True)
    ]


@each_motion
@pytest.mark.parametrize("orders", [(0,), (1, 2), (0, 1, 2)], ids=str)
def test_rows_have_the_bits_of_all_samples(motion: Motion[Any], parameters: Any, orders: tuple[int, ...]) -> None:
    every, rows = motion.samples(parameters), row_by_row(motion, parameters, orders)
    assert len(rows) == every.count
    for order in motion.orders:
        values = [sample.derivatives[order] for sample in rows]
        if order not in orders:
            assert all(value is None for value in values)
            continue
        assert all(value.shape == (1, 3) for value in values)
        assert (np.vstack([as_array(value) for value in values]) == as_array(every.derivatives[order])).all()
    for name in ("times", "weights"):
        assert (np.vstack([as_array(getattr(row, name)) for row in rows]) == as_array(getattr(every, name))).all()
    assert {float(row.duration) for row in rows} == {float(every.duration)}


@each_motion
def test_samples_are_the_exact_motion(motion: Motion[Any], parameters: Any) -> None:
    samples, trajectory = motion.samples(parameters), motion.trajectory(parameters)
    times = as_array(samples.times).ravel()
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(trajectory.duration)
    assert (np.diff(times) > -1e-12).all()  # two pieces may have a sample each where they meet
    assert float(samples.duration) == pytest.approx(trajectory.duration)
    assert float(motion.duration(motion.durations(parameters))) == float(samples.duration)
    assert motion.durations(parameters).shape == (motion.duration_count, 1)
    for order in motion.orders:
        exact = trajectory.at(np.minimum(times, trajectory.duration), order)
        scale = 1e-8 * max(1.0, np.abs(exact).max())
        inner = np.abs(times[:, None] - trajectory.breakpoints[1:-1]).min(axis=1, initial=1.0) > 1e-9
        chosen = inner if order > SMOOTH_ORDERS - 1 else slice(None)  # a jerk may jump where two pieces meet
        assert as_array(samples.derivatives[order])[chosen] == pytest.approx(exact[chosen], abs=scale)


@each_motion
def test_weights_are_those_of_the_trapezoidal_rule(motion: Motion[Any], parameters: Any) -> None:
    """Exact for lines; for a square too large by (b - a) h^2 / 6 in a stretch from a to b of equal steps h."""
    samples = motion.samples(parameters)
    times, weights = (as_array(part).ravel() for part in (samples.times, samples.weights))
    steps, end = np.diff(times), times[-1]
    assert weights.sum() == pytest.approx(end)
    assert weights @ times == pytest.approx(end**2 / 2.0)
    assert weights @ (3.0 - 2.0 * times) == pytest.approx(3.0 * end - end**2)
    assert weights @ times**2 == pytest.approx(end**3 / 3.0 + (steps**3).sum() / 6.0)


def test_points_for_integrals_are_the_exact_motion_and_integrate_cubics() -> None:
    """Two of Gauss's in each interval: inside of it, so that no jump of an acceleration is seen from one side alone."""
    motion, parameters = MOTIONS["path, with points for integrals"]
    samples, trajectory = motion.samples(parameters), motion.trajectory(parameters)
    points = samples.for_integrals
    assert points is samples.quadrature is not None
    times, weights = (as_array(part).ravel() for part in (points.times, points.weights))
    assert times.size == 2 * (samples.count - 1)
    for order in motion.orders:
        exact = trajectory.at(times, order)
        assert as_array(points.derivatives[order]) == pytest.approx(exact, abs=1e-8 * max(1.0, np.abs(exact).max()))
    for power in range(4):
        assert weights @ times**power == pytest.approx(trajectory.duration ** (power + 1) / (power + 1), rel=1e-12)
    rows = [row.quadrature for row in row_by_row(motion, parameters, (0, 1, 2))]
    of_rows = [[as_array(part).ravel() for part in (row.times, row.weights)] for row in rows if row is not None]
    assert len(of_rows) == samples.count and of_rows[-1][1].tolist() == [0.0, 0.0]
    for column, expected in enumerate((times, weights)):
        each = np.array([row[column] for row in of_rows[:-1]])
        assert each.T.ravel().tolist() == expected.tolist()


@each_motion
def test_rows_of_a_table_hold_the_samples(motion: Motion[Any], parameters: Any) -> None:
    trajectory, times = motion.trajectory(parameters), as_array(motion.samples(parameters).times).ravel()
    rows = motion.row_times(trajectory, 201)
    assert rows.size >= 201
    assert (np.diff(rows) > 0.0).all()
    assert np.abs(rows[:, None] - times).min(axis=0).max() <= 1e-12 * trajectory.duration
