"""What a motion of several stages is judged by: each of them by its own criteria."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from problems.assembly.criteria import Criteria, MotionStage
from problems.base import FloatArray, tell_step
from problems.certify import AtGoal, CertificateStatus, ClosestApproach, Verdict, WorstIs
from problems.limits import Clearance
from problems.motions import Trajectory
from problems.tasks import Sequence as StagedTask

SAME_TIME = 1e-9  # of T: times that are one
ORDER = (CertificateStatus.VIOLATED, CertificateStatus.UNDECIDED, CertificateStatus.CERTIFIED)  # the worst first


def sparse_times(trajectory: Trajectory, at_least: int) -> FloatArray:
    """Equally spaced times, and all breakpoints: some stages have a hundred times as many pieces as others."""
    even, edges = np.linspace(0.0, trajectory.duration, at_least), trajectory.breakpoints
    following = np.clip(np.searchsorted(edges, even), 1, edges.size - 1)
    nearest = np.minimum(np.abs(edges[following] - even), np.abs(even - edges[following - 1]))
    return np.union1d(edges, even[nearest > SAME_TIME * trajectory.duration])


@dataclass(frozen=True, kw_only=True)
class SequenceCriteria(Criteria):
    """Stages one after the other, at rest between them.

    Attributes:
        stages: in their order, from 0 to T without a gap.
    """

    task: StagedTask
    free_timing: bool = True
    row_times: Callable[[Trajectory, int], FloatArray] = sparse_times
    stages: tuple[MotionStage, ...] = ()

    def with_clock(self, clock: Callable[[FloatArray], FloatArray]) -> Self:
        ends = clock(np.array([[stage.start, stage.end] for stage in self.stages])).tolist()
        stages = (replace(stage, start=start, end=end) for stage, (start, end) in zip(self.stages, ends, strict=True))
        return replace(self, stages=tuple(stages))

    def by_stage(self, trajectory: Trajectory) -> tuple[tuple[Verdict, ...], ...]:
        found = []
        for number, stage in enumerate(self.stages):
            tell_step("proofs", number, len(self.stages))
            found.append(stage.verify(trajectory))
        return tuple(found)

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        return list(self.overall(self.by_stage(trajectory)))

    def overall(self, by_stage: Iterable[tuple[Verdict, ...]]) -> tuple[Verdict, ...]:
        found: dict[str, list[Verdict]] = {}
        for stage, verdicts in zip(self.stages, by_stage, strict=True):
            for verdict in verdicts:
                found.setdefault(verdict.name, []).append(replace(verdict, where=f"{verdict.where}, {stage.label}"))
        return tuple(min(each, key=_severity) for each in found.values())

    def closest_approach(self, trajectory: Trajectory, by_stage: Sequence[Sequence[Verdict]]) -> ClosestApproach | None:
        """The closest of all stages; those are left out that provably keep farther away than another comes."""
        nearest: ClosestApproach | None = None
        bounds = map(_proven_clearance, by_stage)
        nearest_first = sorted(zip(bounds, self.stages, strict=True), key=lambda pair: pair[0])
        for number, (bound, stage) in enumerate(nearest_first):
            tell_step("closest approach", number, len(nearest_first))
            if stage.criteria is None:
                continue
            if nearest is not None and bound >= nearest.distance:
                break
            found = stage.criteria.closest_approach(stage.motion(trajectory), ())
            if found is not None and (nearest is None or found.distance < nearest.distance):
                nearest = replace(found, time=min(found.time + stage.start, stage.end))
        return nearest

    def at_goal(self, trajectory: Trajectory) -> AtGoal | None:
        return None

    def at_times(self, times: FloatArray) -> Iterator[tuple[Criteria, NDArray[np.intp]]]:
        """The criteria of the stages; where the arm stands, those of the stage that it came from, or of the first."""
        now = self._moving[0].criteria
        last = len(self.stages) - 1
        for number, stage in enumerate(self.stages):
            now = stage.criteria or now
            within = ((times > stage.start) | (number == 0)) & ((times <= stage.end) | (number == last))
            if within.any():
                assert now is not None
                yield now, within.nonzero()[0]

    def not_judged(self, trajectory: Trajectory) -> tuple[str, ...]:
        """The lines of all stages, each with its stage where it does not hold for all of them."""
        lines: dict[str, list[str]] = {}
        for stage in self._moving:
            assert stage.criteria is not None
            for line in stage.criteria.not_judged(stage.motion(trajectory)):
                lines.setdefault(line, []).append(stage.label)
        every = len(self._moving)
        return tuple(
            line if len(labels) == every else f"{line}, in {', '.join(labels)}" for line, labels in lines.items()
        )

    @property
    def _moving(self) -> list[MotionStage]:
        return [stage for stage in self.stages if stage.criteria is not None]


def _proven_clearance(verdicts: Sequence[Verdict]) -> float:
    """The proven clearance of a stage for all t, m; minus infinity where none is."""
    proven = [v.worst for v in verdicts if v.name == Clearance.name and v.satisfied and v.worst_is is WorstIs.BOUND]
    return min(proven, default=-np.inf)


def _severity(verdict: Verdict) -> tuple[int, float]:
    """The rank of a verdict, smallest for the worst: its status, then its distance from the bound, of that."""
    size = max(abs(verdict.bound), 1e-9)
    distance = abs(verdict.worst - verdict.bound) / size
    return ORDER.index(verdict.status), -distance if verdict.excess else distance
