"""What was executed against what obstacles really did: the true distances, proven for all t."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby

import casadi as ca
import numpy as np

from problems import CertificateStatus, Trajectory, Verdict
from problems.base.matrix import FloatArray, as_array
from problems.certify.clearance import prove_clearance
from problems.certify.verification import limit_verdicts
from problems.limits import limits_of, proximity_limits
from problems.limits.distances.proximity import Proximity
from problems.motions.samples import Samples
from tpbso_casadi.simulation.executed import part, stands
from tpbso_casadi.simulation.record import SimulationRecord

SHORTEST = 1e-9  # s, of a stretch
SAMPLES = 51  # of a stretch, besides those of its proof
WORST_FIRST = (CertificateStatus.VIOLATED, CertificateStatus.UNDECIDED)


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A time in which the arm moves, or stands still; of one period at the most.

    Attributes:
        first: start, s.
        last: end, s.
        moves: whether the arm does.
        status: of the claim that it touches nothing, for all t.
        distance: the smallest that was seen, m; negative where it touches something, infinite where nothing can touch.
        time: of that, s.
        pair: of that; empty where nothing can touch.
    """

    first: float
    last: float
    moves: bool
    status: CertificateStatus
    distance: float
    time: float
    pair: str


def stretches(record: SimulationRecord) -> list[Stretch]:
    """The executed motion against the true motions of all obstacles, cut at every tick and where it starts or stops."""
    executed, every = record.executed, record.settings.every
    ticks = every * np.arange(1.0, round(executed.duration / every), dtype=np.float64)
    edges, moves = _edges(executed, ticks)
    return [
        _judged(record, float(first), float(last), bool(moving))
        for first, last, moving in zip(edges[:-1], edges[1:], moves, strict=True)
    ]


def _edges(executed: Trajectory, ticks: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where stretches begin and end, (n + 1,), s, and whether the arm moves in each, (n,)."""
    moving, breaks = ~stands(executed), executed.breakpoints
    changes = breaks[1:-1][moving[1:] != moving[:-1]]
    apart = np.array([change for change in changes if np.abs(ticks - change).min(initial=np.inf) > SHORTEST])
    edges = np.unique(np.concatenate([[0.0], ticks, apart, breaks[-1:]]))
    pieces = np.searchsorted(breaks, (edges[1:] + edges[:-1]) / 2.0, side="right") - 1
    return edges, moving[pieces]


def _judged(record: SimulationRecord, first: float, last: float, moves: bool) -> Stretch:
    trajectory = part(record.executed, first, last)
    around = (obstacle.during(first, last).later(first) for obstacle in record.obstacles)
    limits = proximity_limits(replace(record.robot, margin=0.0), tuple(around))
    seen = [found for limit in limits for found in _distances(limit, trajectory)]
    statuses = {status for status, *_ in seen}
    status = next((worst for worst in WORST_FIRST if worst in statuses), CertificateStatus.CERTIFIED)
    _, distance, time, pair = min(seen, key=lambda each: each[1], default=(status, np.inf, 0.0, ""))
    return Stretch(first=first, last=last, moves=moves, status=status, distance=distance, time=first + time, pair=pair)


def _distances(limit: Proximity, trajectory: Trajectory) -> Iterator[tuple[CertificateStatus, float, float, str]]:
    """A proof and the smallest distance that it met; the smallest of equally spaced times."""
    proof = prove_clearance(limit, trajectory)
    if proof is None:
        return
    yield proof.status, proof.smallest, proof.time, proof.where
    times = np.linspace(0.0, trajectory.duration, SAMPLES)
    samples = Samples(
        robot=limit.robot,
        derivatives=(ca.DM(trajectory.at(times)),),
        duration=ca.DM(trajectory.duration),
        times=ca.DM(times),
    )
    found = as_array(limit.clearances(samples))
    row, column = np.unravel_index(int(np.argmin(found)), found.shape)
    yield proof.status, float(found[row, column]), float(times[row]), str(limit.pairs[int(column)])


def contacts(found: list[Stretch], moving: bool) -> int:
    """How often something was touched while the arm moved, or while it stood still: stretches in a row are one."""
    touched = (stretch.status is CertificateStatus.VIOLATED and stretch.moves is moving for stretch in found)
    return sum(is_contact for is_contact, _ in groupby(touched))


def kept_limits(record: SimulationRecord) -> list[Verdict]:
    """The robot's limits of speed, acceleration, jerk, torque and range, judged for all t of what was executed."""
    robot = replace(record.robot, self_collision=False)
    return limit_verdicts(limits_of(robot, ()), record.executed)
