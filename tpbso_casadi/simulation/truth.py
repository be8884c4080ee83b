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

SAMPLES = 21  # of a period, besides those of a proof
WORST_FIRST = (CertificateStatus.VIOLATED, CertificateStatus.UNDECIDED)


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A time in which the arm moves, or stands still; of one period at the most where that is not proven clear.

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

    @property
    def is_open(self) -> bool:
        """Whether the arm moves and it is neither proven nor disproven that it touches nothing."""
        return self.moves and self.status is CertificateStatus.UNDECIDED


def stretches(record: SimulationRecord) -> list[Stretch]:
    """The executed motion against the true motions of all obstacles, in order; it is cut where it starts and stops."""
    executed = record.executed
    moving, breaks = ~stands(executed), executed.breakpoints
    edges = np.concatenate([[0.0], breaks[1:-1][moving[1:] != moving[:-1]], breaks[-1:]])
    pieces = np.searchsorted(breaks, (edges[1:] + edges[:-1]) / 2.0, side="right") - 1
    return [
        stretch
        for first, last, piece in zip(edges[:-1], edges[1:], pieces, strict=True)
        for stretch in _settled(record, float(first), float(last), bool(moving[piece]))
    ]


def _settled(record: SimulationRecord, first: float, last: float, moves: bool) -> Iterator[Stretch]:
    """Halves of a stretch that is not proven clear, until they are, or one period long at the most."""
    judged = _judged(record, first, last, moves)
    if judged.status is CertificateStatus.CERTIFIED or last - first <= record.settings.every:
        yield judged
        return
    middle = (first + last) / 2.0
    for start, end in ((first, middle), (middle, last)):
        yield from _settled(record, start, end, moves)


def _judged(record: SimulationRecord, first: float, last: float, moves: bool) -> Stretch:
    trajectory = part(record.executed, first, last)
    around = (obstacle.during(first, last).later(first) for obstacle in record.obstacles)
    limits = proximity_limits(replace(record.robot, margin=0.0), tuple(around))
    times = np.linspace(0.0, last - first, int(np.ceil((last - first) / record.settings.every * SAMPLES)) + 1)
    seen = [found for limit in limits for found in _distances(limit, trajectory, times)]
    statuses = {status for status, *_ in seen}
    status = next((worst for worst in WORST_FIRST if worst in statuses), CertificateStatus.CERTIFIED)
    _, distance, time, pair = min(seen, key=lambda each: each[1], default=(status, np.inf, 0.0, ""))
    return Stretch(first=first, last=last, moves=moves, status=status, distance=distance, time=first + time, pair=pair)


def _distances(
    limit: Proximity, trajectory: Trajectory, times: FloatArray
) -> Iterator[tuple[CertificateStatus, float, float, str]]:
    """A proof and the smallest distance that it met; the smallest at times (n,) in s."""
    proof = prove_clearance(limit, trajectory)
    if proof is None:
        return
    yield proof.status, proof.smallest, proof.time, proof.where
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
    """The robot's limits of speed, acceleration, jerk, torque and range, judged for all t until the arm stands.

    What would have followed counts too, lest an end in the middle of a motion be taken for a jump.
    """
    robot = replace(record.robot, self_collision=False)
    return limit_verdicts(limits_of(robot, ()), record.executed.followed_by(record.following))
