"""The content of a simulation's ``result.json``, and what it sums up."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from platform import python_version
from typing import Any

import numpy as np
from pydantic import Field

from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.validation import StrictModel
from tpbso_casadi.simulation.record import SimulationRecord
from tpbso_casadi.simulation.truth import Stretch, contacts, kept_limits, stretches
from tpbso_casadi.storage.plain import as_json, plain
from tpbso_casadi.storage.result import ConstraintResult, Count, FileName, Number, PiecesResult, Seconds
from tpbso_casadi.storage.seal import sealed
from tpbso_casadi.storage.versions import versions

WHAT = "a simulation of the planner: no robot was driven"
LARGEST_JUMP = 1e-9  # rad, rad/s, rad/s^2: more is no rounding


class ClosestResult(StrictModel):
    """Where the arm really came nearest to anything; m, s."""

    distance: Number
    time: Seconds
    pair: str
    moving: bool


class SummaryResult(StrictModel):
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
        return max(self.largest_jumps) < LARGEST_JUMP


class CourseResult(StrictModel):
    """What an obstacle that moves really did.

    Attributes:
        obstacle: its number in the scenario, from 1.
        true: shape and motion in numbers: pieces of time with coefficients of its displacement, highest power first.
    """

    obstacle: Count
    true: dict[str, Any]


class VisitResult(StrictModel):
    """A goal, by its index, and since when the arm was at rest there, s."""

    goal: Count
    time: Seconds


class SimulationResult(StrictModel):
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
    files: dict[FileName, str] = Field(default_factory=dict)

    @classmethod
    def of(cls, record: SimulationRecord) -> SimulationResult:
        """What is to be written of a simulation; its distances are judged here."""
        return cls(
            scenario=record.scenario,
            seed=record.scenario.solver.seed,
            summary=summary_of(record, stretches(record)),
            limits=[ConstraintResult(**asdict(each), satisfied=each.satisfied) for each in kept_limits(record)],
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
        return as_json(sealed(plain(self.model_dump(mode="json"))))


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
