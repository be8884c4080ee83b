"""What a motion of several stages is judged by: each of them by its own criteria."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from problems.assembly.criteria import Criteria
from problems.base import FloatArray
from problems.certify import AtGoal, CertificateStatus, ClosestApproach, Verdict
from problems.motions import Trajectory
from problems.robots import Robot
from problems.tasks import Sequence

ORDER = (CertificateStatus.VIOLATED, CertificateStatus.UNDECIDED, CertificateStatus.CERTIFIED)  # the worst first


@dataclass(frozen=True, eq=False)
class Stage:
    """A stage of a finished motion.

    Attributes:
        label: what it is called.
        kind: of stage.
        start: when it begins, s.
        end: when it ends; the same where nothing moves and nothing waits.
        criteria: by which its motion is judged; None where the arm stands.
        signal: what is told at its beginning, name and value; None where nothing is.
    """

    label: str
    kind: str
    start: float
    end: float
    criteria: Criteria | None = None
    signal: tuple[str, bool | float | str] | None = None

    def motion(self, trajectory: Trajectory) -> Trajectory:
        """Its part of the whole motion, from t = 0."""
        return trajectory.part(self.start, min(self.end, trajectory.duration))

    def verify(self, trajectory: Trajectory) -> tuple[Verdict, ...]:
        """The verdicts on its part of the whole motion; none where the arm stands, as it does where it came from."""
        return () if self.criteria is None else tuple(self.criteria.verify(self.motion(trajectory)))


@dataclass(frozen=True, kw_only=True)
class SequenceCriteria(Criteria):
    """Stages one after the other, at rest between them.

    Attributes:
        stages: in their order, from 0 to T without a gap.
    """

    task: Sequence
    stages: tuple[Stage, ...] = ()

    free_timing: ClassVar[bool] = True

    def at_free_times(self) -> Criteria:
        """Itself."""
        return self

    def by_stage(self, trajectory: Trajectory) -> tuple[tuple[Verdict, ...], ...]:
        """The verdicts on each stage, for all t."""
        return tuple(stage.verify(trajectory) for stage in self.stages)

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        """Those on all stages together."""
        return list(self.overall(self.by_stage(trajectory)))

    def overall(self, by_stage: Iterable[tuple[Verdict, ...]]) -> tuple[Verdict, ...]:
        """Of each constraint the verdict on the stage that keeps it least."""
        found: dict[str, list[Verdict]] = {}
        for stage, verdicts in zip(self.stages, by_stage, strict=True):
            for verdict in verdicts:
                found.setdefault(verdict.name, []).append(replace(verdict, where=f"{verdict.where}, {stage.label}"))
        return tuple(min(each, key=_severity) for each in found.values())

    def closest_approach(self, trajectory: Trajectory) -> ClosestApproach | None:
        """That of the stage that comes nearest to an obstacle."""
        near = [
            replace(found, time=found.time + stage.start)
            for stage in self._moving
            if (found := stage.criteria.closest_approach(stage.motion(trajectory))) is not None  # type: ignore[union-attr]
        ]
        return min(near, key=lambda found: found.distance, default=None)

    def at_goal(self, trajectory: Trajectory) -> AtGoal | None:
        """Nothing that is not carried moves."""
        return None

    def exact_time_scale(self, trajectory: Trajectory) -> float:
        """The largest of all stages."""
        scales = (stage.criteria.exact_time_scale(stage.motion(trajectory)) for stage in self._moving)  # type: ignore[union-attr]
        return max(scales, default=0.0)

    def safe_time_scale(self, trajectory: Trajectory) -> float:
        """Likewise."""
        scales = (stage.criteria.safe_time_scale(stage.motion(trajectory)) for stage in self._moving)  # type: ignore[union-attr]
        return max(scales, default=0.0)

    def robots(self, times: FloatArray) -> Iterator[tuple[Robot, NDArray[np.intp]]]:
        """The robots, with what they carry, and the indices of the times at which each of them is the one."""
        robot = self.robot
        last = len(self.stages) - 1
        for number, stage in enumerate(self.stages):
            robot = self.robot if stage.criteria is None else stage.criteria.robot
            within = (times >= stage.start) & ((times < stage.end) | (number == last))
            if within.any():
                yield robot, within.nonzero()[0]

    @property
    def _moving(self) -> list[Stage]:
        return [stage for stage in self.stages if stage.criteria is not None]


def _severity(verdict: Verdict) -> tuple[int, float]:
    """What is smallest of the worst: its status, then how near the bound it is, as a share of that."""
    size = max(abs(verdict.bound), 1e-9)
    distance = abs(verdict.worst - verdict.bound) / size
    return ORDER.index(verdict.status), -distance if verdict.excess else distance

