"""A finished motion: the exact trajectory, how it stands to every constraint, and what it is worth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from problems import CertificateStatus, Problem, Trajectory, Verdict
from problems.base.matrix import FloatArray

ROWS = 201  # of trajectory.csv, at the least


@dataclass(frozen=True)
class Motion:
    """A trajectory, judged.

    Attributes:
        problem: what it solves.
        trajectory: the motion itself.
        quantities: the arm's own quantities behind it, by the paper's symbols.
        time_scale: the factor by which what was found has been slowed so that the speed and acceleration limits
            hold between its samples too; 1 when they did already.
    """

    problem: Problem
    trajectory: Trajectory
    quantities: dict[str, FloatArray]
    time_scale: float = 1.0

    @cached_property
    def verdicts(self) -> tuple[Verdict, ...]:
        """How it stands to every constraint, for all t."""
        return tuple(self.problem.verify(self.trajectory))

    @property
    def status(self) -> CertificateStatus:
        """The certificate: of all constraints together, for all t."""
        found = {verdict.status for verdict in self.verdicts}
        return next(
            (s for s in (CertificateStatus.VIOLATED, CertificateStatus.UNDECIDED) if s in found),
            CertificateStatus.CERTIFIED,
        )

    @property
    def feasible(self) -> bool:
        """Whether every constraint is certified to hold."""
        return self.status is CertificateStatus.CERTIFIED

    @property
    def worst_violation(self) -> float:
        """The largest excess over any bound, in that constraint's unit; 0 when feasible."""
        return max((verdict.excess for verdict in self.verdicts), default=0.0)

    @cached_property
    def times(self) -> FloatArray:
        """The times in s of the rows of ``trajectory.csv``."""
        return self.problem.row_times(self.trajectory, ROWS)

    @cached_property
    def objective(self) -> float:
        """The objective, measured at the rows of ``trajectory.csv``."""
        return self.problem.objective_value(self.trajectory, self.times)

    @property
    def price(self) -> float:
        """One number to compare motions by: the objective, or more than any objective when a constraint is broken."""
        return self.objective if self.feasible else self.problem.objective_upper_bound + 1.0 + self.worst_violation


def found_motion(problem: Problem, x: FloatArray) -> Motion:
    """The motion of a search vector (d,), slowed by the least factor that the limits need for all t."""
    trajectory = problem.trajectory(x)
    stretch = max(1.0, trajectory.safe_time_scale(problem.arm))
    return Motion(problem, trajectory.time_scaled(stretch), problem.quantities(x), stretch)
