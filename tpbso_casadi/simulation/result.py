"""What was true of a simulation, as its result says it, and the folder of its files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from math import isfinite
from pathlib import Path
from platform import python_version
from typing import Any

import casadi as ca
import numpy as np

from problems import CertificateStatus, Trajectory, Verdict
from problems.base import FloatArray, Table, as_array
from problems.certify import limit_verdicts, peak_near, prove_clearance, prove_clearance_in_core
from problems.limits import CoverLimit, Proximity, complete_limits, limits_of, proximity_limits
from problems.motions import Samples
from solvers import Interruption
from tpbso_casadi.plain import as_json, plain, versions
from tpbso_casadi.planning import JudgedMotion
from tpbso_casadi.scenario import Scenario
from tpbso_casadi.simulation.record import SimulationRecord, part, stands
from tpbso_casadi.storage import (
    ConstraintResult,
    Count,
    FileName,
    Number,
    PiecesResult,
    Seconds,
    Writer,
    replace_folder,
    sealed,
    write_csv,
    write_motion,
)

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
    around = tuple(obstacle.during(first, last).later(first) for obstacle in record.obstacles)
    robot = record.robot.touching
    judged = complete_limits(proximity_limits(robot, around), robot, around)
    limits = [limit for limit in judged if isinstance(limit, Proximity | CoverLimit)]
    times = np.linspace(0.0, last - first, int(np.ceil((last - first) / record.settings.every * SAMPLES)) + 1)
    seen = [found for limit in limits for found in _distances(limit, trajectory, times)]
    statuses = {status for status, *_ in seen}
    status = next((worst for worst in WORST_FIRST if worst in statuses), CertificateStatus.CERTIFIED)
    _, distance, time, pair = min(seen, key=lambda each: each[1], default=(status, np.inf, 0.0, ""))
    return Stretch(first=first, last=last, moves=moves, status=status, distance=distance, time=first + time, pair=pair)


def _distances(
    limit: Proximity | CoverLimit, trajectory: Trajectory, times: FloatArray
) -> Iterator[tuple[CertificateStatus, float, float, str]]:
    """A proof and the smallest distance that it met; the smallest at times (n,) in s, followed to its bottom."""
    if isinstance(limit, CoverLimit):
        found = prove_clearance_in_core(limit, trajectory)
        assert found is not None
        yield found.status, found.smallest, found.time, found.where
        clearance, time, pair = limit.nearest(trajectory, times)
        yield found.status, clearance, time, pair
        return
    proof = prove_clearance(limit, trajectory)
    if proof is None:
        return
    yield proof.status, proof.smallest, proof.time, proof.where

    def clearances(at: FloatArray) -> FloatArray:
        postures = (ca.DM(trajectory.at(at)),)
        duration = ca.DM(trajectory.duration)
        samples = Samples(robot=limit.robot, derivatives=postures, duration=duration, times=ca.DM(at))
        return as_array(limit.clearances(samples))

    def nearness(at: FloatArray) -> FloatArray:
        return -np.asarray(clearances(at).min(axis=1))

    nearest = float(times[int(np.argmax(nearness(times)))])
    _, time = peak_near(nearness, nearest, float(times[-1]) / max(1, len(times) - 1), trajectory.duration)
    found = clearances(np.array([time]))[0]
    yield proof.status, float(found.min()), time, str(limit.pairs[int(np.argmin(found))])


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


WHAT = "a simulation of the planner: no robot was driven"
LARGEST_JUMPS = (1e-9, 1e-9, 1e-7)  # rad, rad/s, rad/s^2: more is no rounding, of times within 1e-12 s either


class ClosestResult(Table):
    """The place at which the arm really came nearest to anything; m, s."""

    distance: Number
    time: Seconds
    pair: str
    moving: bool


class SummaryResult(Table):
    """A simulation in numbers.

    Attributes:
        seconds: that were simulated.
        replans: answers of the planner.
        new: of them, those that replaced the motion.
        old: those that let it go on.
        stop: those that stopped the arm.
        certified: of all, those that are proven clear of the obstacles as predicted.
        fail_safe: of all, those after which a stop in time is proven.
        deadlines_met: share of those that took no longer than the time between two.
        median_ms: that an answer took.
        percentile_99_ms: that 99 % took at the most.
        largest_ms: of all.
        collisions: how often the moving arm touched something.
        standing_contacts: how often something touched the arm where it stood.
        unproven: stretches of motion of which it is not proven, nor disproven, that they touched nothing.
        closest: over the whole simulation.
        closest_moving: the smallest distance while the arm moved, m.
        largest_jumps: of angle, speed and acceleration where motions join, rad, rad/s, rad/s^2.
        goals_reached: in all.
    """

    seconds: Seconds
    replans: Count
    new: Count
    old: Count
    stop: Count
    certified: Count
    fail_safe: Count
    deadlines_met: float
    median_ms: float
    percentile_99_ms: float
    largest_ms: float
    collisions: Count
    standing_contacts: Count
    unproven: Count
    closest: ClosestResult
    closest_moving: Number
    largest_jumps: tuple[float, float, float]
    goals_reached: Count

    @property
    def is_safe(self) -> bool:
        """Whether the arm is proven to have touched nothing while it moved."""
        return not self.collisions and not self.unproven

    @property
    def is_smooth(self) -> bool:
        """Whether nothing jumps where motions join."""
        return all(jump < most for jump, most in zip(self.largest_jumps, LARGEST_JUMPS, strict=True))


class CourseResult(Table):
    """The real motion of an obstacle.

    Attributes:
        obstacle: its number in the scenario, from 1.
        true: shape and motion in numbers: pieces of time with coefficients of its displacement, highest power first.
    """

    obstacle: Count
    true: dict[str, Any]


class VisitResult(Table):
    """A goal, by its index, and since when the arm was at rest there, s."""

    goal: Count
    time: Seconds


class SimulationResult(Table):
    """The keys of ``result.json``, in their order.

    Attributes:
        what: that no robot was driven.
        scenario: complete; its [simulation] table says how it was simulated.
        seed: of obstacles and planner.
        summary: in numbers.
        limits: of the robot, judged for all t of the executed motion.
        visits: in their order.
        executed: the motion, exact.
        courses: of the obstacles that move, exact.
        interrupted: whether Ctrl-C cut it short.
        versions: of the packages that decide a result.
        files: by name, the SHA-256 digests of the other files.
    """

    what: str = WHAT
    scenario: Scenario
    seed: Count
    summary: SummaryResult
    limits: list[ConstraintResult]
    visits: list[VisitResult]
    executed: PiecesResult
    courses: list[CourseResult]
    interrupted: bool
    versions: dict[str, str]
    files: dict[FileName, str] = field(default_factory=dict)

    @classmethod
    def of(cls, record: SimulationRecord) -> SimulationResult:
        """The result of a simulation as it is written; its distances are judged here."""
        return cls(
            scenario=record.scenario,
            seed=record.scenario.solver.seed,
            summary=summary_of(record, stretches(record)),
            limits=[ConstraintResult.like(each) for each in kept_limits(record)],
            visits=[VisitResult(goal=visit.goal, time=visit.time) for visit in record.visits],
            executed=PiecesResult(
                breakpoints=record.executed.breakpoints.tolist(), coefficients=record.executed.coefficients.tolist()
            ),
            courses=_courses(record),
            interrupted=record.interrupted,
            versions={"python": python_version(), **versions()},
        )

    @property
    def is_good(self) -> bool:
        """Whether nothing was touched by the moving arm, nothing jumped, and every limit was kept."""
        return self.summary.is_safe and self.summary.is_smooth and all(limit.satisfied for limit in self.limits)

    def to_json(self) -> str:
        """The text of ``result.json``, sealed."""
        return as_json(sealed(plain(self.table())))


def summary_of(record: SimulationRecord, judged: list[Stretch]) -> SummaryResult:
    """A simulation in numbers, given its stretches."""
    replans = record.replans
    milliseconds = 1000.0 * np.array([replan.seconds for replan in replans])
    kinds = Counter(replan.kind for replan in replans)
    nearest = min(judged, key=lambda stretch: stretch.distance)
    return SummaryResult(
        seconds=record.duration,
        replans=len(replans),
        new=kinds["new"],
        old=kinds["old"],
        stop=kinds["stop"],
        certified=sum(replan.certified for replan in replans),
        fail_safe=sum(replan.fail_safe for replan in replans),
        deadlines_met=float(np.mean(milliseconds <= 1000.0 * record.settings.every)),
        median_ms=float(np.median(milliseconds)),
        percentile_99_ms=float(np.percentile(milliseconds, 99.0)),
        largest_ms=float(milliseconds.max()),
        collisions=contacts(judged, moving=True),
        standing_contacts=contacts(judged, moving=False),
        unproven=sum(stretch.is_open for stretch in judged),
        closest=ClosestResult(distance=nearest.distance, time=nearest.time, pair=nearest.pair, moving=nearest.moves),
        closest_moving=min((stretch.distance for stretch in judged if stretch.moves), default=np.inf),
        largest_jumps=(*record.largest_jumps.tolist(),),
        goals_reached=len(record.visits),
    )


def _courses(record: SimulationRecord) -> list[CourseResult]:
    numbered = enumerate(record.obstacles, start=1)
    return [CourseResult(obstacle=number, true=plain(obstacle)) for number, obstacle in numbered if obstacle.moves]


ROWS_PER_SECOND = 100
REPLANS = (
    "tick", "t", "goal", "kind", "certified", "fail_safe", "ms", "in_time", "predicted_distance", "arrival",
    "jump_q", "jump_qd", "jump_qdd",
)  # fmt: skip


def write_simulation(
    folder: Path,
    record: SimulationRecord,
    result: SimulationResult,
    further: Sequence[Writer] = (),
    interruption: Interruption | None = None,
) -> list[str]:
    """Write the files of a simulation in place of everything in the folder.

    Args:
        folder: of the run.
        record: of the simulation.
        result: of the same.
        further: each writes files into the folder that it is given: figures, a player.
        interruption: after its request, further files that are not complete yet are left out.

    Returns:
        The names of the files.

    Raises:
        OutputError: as :func:`tpbso_casadi.storage.write_plan`.
    """

    def tables(staged: Path) -> None:
        times = row_times(record)
        motion = JudgedMotion(record.scenario.criteria(), record.executed, {})
        write_motion(staged / "trajectory.csv", motion, times)
        write_csv(staged / "replans.csv", REPLANS, replan_rows(record))
        write_csv(staged / "obstacles.csv", *obstacle_table(record, times))

    return replace_folder(
        folder,
        needed=[tables],
        further=further,
        result=result,
        interruption=interruption,
    )


def row_times(record: SimulationRecord) -> FloatArray:
    """The times in s of the rows of ``trajectory.csv`` and ``obstacles.csv``, every join among them."""
    return record.executed.times(int(np.ceil(ROWS_PER_SECOND * record.duration)) + 1)


def replan_rows(record: SimulationRecord) -> Iterator[list[object]]:
    """The rows of ``replans.csv``; s, m, rad and their rates, a distance that is not known is empty."""
    for each in record.replans:
        yield [
            each.tick, each.time, each.goal, each.kind, _yes(each.certified), _yes(each.fail_safe),
            1000.0 * each.seconds, _yes(each.seconds <= record.settings.every),
            each.predicted_distance if isfinite(each.predicted_distance) else None, each.arrival, *each.jumps,
        ]  # fmt: skip


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def obstacle_table(record: SimulationRecord, times: FloatArray) -> tuple[list[str], list[list[float]]]:
    """``t`` and, of every obstacle that moves, where a point of it truly is: ``x1, y1[, z1]``; s and m.

    Obstacles have their numbers in the scenario, from 1.
    """
    header, columns = ["t"], [times]
    for number, obstacle in enumerate(record.obstacles, start=1):
        if obstacle.moves:
            header += [f"{axis}{number}" for axis in "xyz"[: obstacle.dim]]
            columns += list(np.array([obstacle.during(time, time).at(time).place for time in times.tolist()]).T)
    return header, np.column_stack(columns).tolist()
