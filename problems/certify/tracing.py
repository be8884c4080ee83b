"""That the tool stays near a path, for all t: distances in the middle of time cells, and how far the tool can move.

Between the times at which two consecutive points are passed the tool has to stay within the accuracy of the line that
joins them. A cell is settled where distance(m) + travel is small enough; the others are halved. The proof holds up to
rounding in floating point.
"""

from __future__ import annotations

import numpy as np

from problems.base.matrix import FloatArray, as_array
from problems.certify.travel import Travel, halves
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

INITIAL_CELLS = 1000
MAX_CELLS = 400_000


def prove_tracing(
    robot: Robot, points: FloatArray, accuracy: float, trajectory: Trajectory, times: FloatArray
) -> Verdict:
    """The verdict on the distance between tool and path.

    Args:
        robot: that moves.
        points: of the path, (n, dim), m.
        accuracy: the largest distance, m.
        trajectory: of the joints.
        times: at which the points are passed, not decreasing, the first 0, the last the duration; (n,), s.
    """
    travel, edges = Travel(robot, trajectory), np.unique(np.append(trajectory.times(INITIAL_CELLS), times))
    cells, allowed = np.column_stack([edges[:-1], edges[1:]]), accuracy * (1.0 + TOLERANCE)
    worst, when = _at_points(robot, points, trajectory, times)
    count, status = 0, CertificateStatus.CERTIFIED
    while len(cells) and worst <= allowed:
        middles, count = cells.mean(axis=1), count + len(cells)
        if count > MAX_CELLS:
            status = CertificateStatus.UNDECIDED
            break
        tool = as_array(trajectory.samples(middles, robot).tool)
        segment = np.clip(np.searchsorted(times, middles, side="right") - 1, 0, len(points) - 2)
        away = distance_from_segments(tool, points[segment], points[segment + 1])
        farthest = int(np.argmax(away))
        if away[farthest] > worst:
            worst, when = float(away[farthest]), float(middles[farthest])
        cells = halves(cells[away + travel.of_bodies(cells)[:, -1] > allowed])
    if worst > allowed:
        status = CertificateStatus.VIOLATED
    where = f"tip, t = {when:.4g} s"
    return Verdict(name="accuracy", worst=worst, bound=accuracy, unit="m", status=status, where=where)


def _at_points(robot: Robot, points: FloatArray, trajectory: Trajectory, times: FloatArray) -> tuple[float, float]:
    """The largest distance from a point when it is passed, and when that is."""
    tool = np.concatenate([robot.skeleton(trajectory.at(times))[:, -1]])
    away = np.hypot.reduce(tool - points, axis=1)
    return float(away.max()), float(times[int(np.argmax(away))])


def distance_from_segments(points: FloatArray, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Distances (n,) in m of points from straight lines, each (n, dim)."""
    along = ends - starts
    share = np.einsum("nd,nd->n", points - starts, along) / np.einsum("nd,nd->n", along, along)
    nearest = starts + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.asarray(np.hypot.reduce(points - nearest, axis=1))
