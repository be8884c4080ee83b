"""A plan as Python code meets it: a motion, its proof, and what can be made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from problems import CertificateStatus, Trajectory, Verdict
from problems.base.matrix import FloatArray
from solvers import Result
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.storage.content import result_of
from tpbso_casadi.storage.motion_table import table_of
from tpbso_casadi.storage.result import RunResult
from tpbso_casadi.storage.run_folder import write_run

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Plan:
    """A motion that was planned, judged for all t.

    Attributes:
        planned: the scenario, the motion, and how it was found.
    """

    planned: PlannedMotion

    @property
    def scenario(self) -> Scenario:
        """Robot, task, limits and solver: everything to plan it again."""
        return self.planned.scenario

    @property
    def motion(self) -> Motion:
        """The motion with its verification."""
        return self.planned.motion

    @property
    def trajectory(self) -> Trajectory:
        """Joint values over time; ``plan.trajectory(t)`` evaluates it."""
        return self.planned.trajectory

    @property
    def times(self) -> FloatArray:
        """At least 201 times from 0 to T, (n,), s."""
        return self.planned.times

    @property
    def duration(self) -> float:
        """T, s."""
        return self.trajectory.duration

    @property
    def objective(self) -> float:
        """The value of what was minimised, in its unit."""
        return self.planned.objective

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Each constraint, judged for all t."""
        return self.planned.verdicts

    @property
    def status(self) -> CertificateStatus:
        """Of all constraints together, for all t."""
        return self.motion.status

    @property
    def certified(self) -> bool:
        """Whether every constraint is proven to hold for all t."""
        return self.planned.feasible

    @property
    def search(self) -> Result | None:
        """The record of the search; None where a given path was timed."""
        return None if self.planned.searched is None else self.planned.searched.search

    @property
    def result(self) -> RunResult:
        """The content of ``result.json``."""
        return result_of(self.planned)

    def __repr__(self) -> str:
        objective = self.planned.criteria.objective
        return (
            f"<plan: {objective.name} {self.objective:.6g} {objective.unit}, {self.status}, T = {self.duration:.4g} s>"
        )

    def to_numpy(self, times: FloatArray | None = None) -> dict[str, FloatArray]:
        """The motion as arrays, by column name: ``t``, ``q1`` ..., as in ``trajectory.csv``.

        Args:
            times: at which, (n,), s; :attr:`times` by default.
        """
        header, table = table_of(self.motion, self.times if times is None else times)
        return dict(zip(header, table.T, strict=True))

    def to_dataframe(self, times: FloatArray | None = None) -> pd.DataFrame:
        """The same as a pandas data frame; needs pandas."""
        import pandas as pd  # noqa: PLC0415 (optional)

        return pd.DataFrame(self.to_numpy(times))

    def plot(self, kind: str = "path") -> Figure:
        """A figure of the motion: ``path``, ``joints`` or ``limits``."""
        from tpbso_casadi.figures.run import FIGURES  # noqa: PLC0415 (matplotlib is slow to load)

        return FIGURES[kind](self.planned)

    def animate(self, path: str | Path) -> Path:
        """Write the motion as ``.gif``, ``.mp4`` or an ``.html`` player."""
        from tpbso_casadi.animation import animate, check_animation  # noqa: PLC0415 (slow to load)

        check_animation(Path(path))
        animate(Path(path), Path(path).stem, self.motion)
        return Path(path)

    def save(self, folder: str | Path, export: Sequence[str] = (), plots: bool = True) -> Path:
        """Write a run folder: ``result.json``, ``trajectory.csv``, figures and exports for a robot."""
        from functools import partial  # noqa: PLC0415

        from tpbso_casadi.storage.exporting import export_motion  # noqa: PLC0415

        further = [partial(export_motion, motion=self.motion, kind=kind) for kind in export]
        write_run(Path(folder), self.planned, plots, further)
        return Path(folder)

    def audit(self) -> dict[str, Any]:
        """The certificate of the plan, constraint by constraint, and what holds it back."""
        raise NotImplementedError
