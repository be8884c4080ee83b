"""A plan, with all that can be asked of it, and a plan read back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from problems import CertificateStatus, Trajectory, Verdict
from problems.assembly import MotionStage
from problems.base import FloatArray, shown_value
from problems.robots import own_name
from solvers import Result
from tpbso_casadi.audit_report import audit_run
from tpbso_casadi.facade.arguments import file_path, in_words_of_python, positive, times_array, whole
from tpbso_casadi.facade.audit import RunAudit
from tpbso_casadi.facade.showing import chosen, data_frame, exports_of
from tpbso_casadi.figures import figure_writers
from tpbso_casadi.figures.palette import DEFAULT, FORMATS
from tpbso_casadi.html import heading, picture, table
from tpbso_casadi.planning import ControllerRows, JudgedMotion, PlannedMotion
from tpbso_casadi.programs import Program, exporter_of
from tpbso_casadi.scenario import Scenario, plugin_failures_named
from tpbso_casadi.storage import (
    RunResult,
    StoredRun,
    result_of,
    stored,
    table_of,
    write_certificate,
    write_plan,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from tpbso_casadi.animation.live_view import LiveView


@dataclass(frozen=True, repr=False)
class Player:
    """A page that plays a motion; a notebook shows it in a frame.

    Attributes:
        page: the whole page, HTML.
        title: what it shows.
        height: of the frame, pixels.
    """

    page: str
    title: str
    height: int

    @classmethod
    def of(cls, motion: JudgedMotion, title: str, height: int) -> Self:
        """The player of a motion."""
        from tpbso_casadi.animation.frames import judged_frames  # noqa: PLC0415 (slow to load)
        from tpbso_casadi.animation.player import page  # noqa: PLC0415

        return cls(page(title, judged_frames(motion)), title, height)

    def __repr__(self) -> str:
        return f"<player of a {self.title}; plan.animate('motion.html') writes it>"

    def _repr_html_(self) -> str:
        page, style = escape(self.page), f"width: 100%; height: {self.height}px; border: 0"
        return f'<iframe title="{escape(self.title)}" srcdoc="{page}" style="{style}"></iframe>'


@dataclass(frozen=True, eq=False, repr=False)
class PlannedStage:
    """A stage of a sequence.

    Attributes:
        name: such as ``stage 3 (line)``.
        kind: of stage.
        start: when it begins, s.
        end: when it ends, s.
        trajectory: of the joints from its start on; None where nothing moves.
        verdicts: each constraint of its motion, judged for all t; none where nothing moves.
        signal: name and value of what is told when it begins; None where nothing is.
    """

    name: str
    kind: str
    start: float
    end: float
    trajectory: Trajectory | None
    verdicts: tuple[Verdict, ...]
    signal: tuple[str, bool | float | str] | None

    @classmethod
    def of(cls, stage: MotionStage, verdicts: tuple[Verdict, ...], whole: Trajectory) -> Self:
        """A stage with its part of the whole motion."""
        own = None if stage.criteria is None else stage.motion(whole)
        return cls(stage.label, stage.kind, stage.start, stage.end, own, verdicts, stage.signal)

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.end - self.start

    def __repr__(self) -> str:
        return f"<{self.name}, {self.start:.4g} to {self.end:.4g} s>"


@dataclass(frozen=True, eq=False, repr=False)
class PlannedArm:
    """The motion of one arm of several, on the clock of all.

    Attributes:
        name: of the arm.
        joints: names of its joints, as its own controller knows them.
        trajectory: of these.
    """

    name: str
    joints: tuple[str, ...]
    trajectory: Trajectory

    def __repr__(self) -> str:
        moves = f"{len(self.joints)} joints" if self.trajectory.moves else "stands still"
        return f"<arm {self.name!r} of a plan: {moves}, T = {self.trajectory.duration:.4g} s>"


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
    def motion(self) -> JudgedMotion:
        """The motion with its verification."""
        return self.planned.motion

    @property
    def trajectory(self) -> Trajectory:
        """Joint values over time; ``plan.trajectory(t)`` evaluates it, for t from 0 to T."""
        return self.planned.trajectory

    @property
    def times(self) -> FloatArray:
        """Times of the rows, at least 201 from 0 to T, (n,), s."""
        return self.planned.times

    @property
    def duration(self) -> float:
        """The duration T of the motion, s."""
        return self.trajectory.duration

    @property
    def least_duration(self) -> float | None:
        """A lower bound of the duration of any motion past the same postures, s; None where it passes none.

        Of a motion past given joint values. Computed in floating point, so that it is no certificate.
        """
        return self.motion.least_duration

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
        """The status of all constraints together, for all t."""
        return self.motion.status

    @property
    def controller_rows(self) -> ControllerRows:
        """The rows that are exported for ROS, the motion that its controller makes of them, and how that is judged."""
        return self.planned.controller_rows

    @property
    def stages(self) -> tuple[PlannedStage, ...]:
        """The stages of a sequence, in their order; none of a plan that is one motion."""
        judged = zip(self.motion.stages, self.motion.by_stage, strict=False)
        return tuple(PlannedStage.of(stage, verdicts, self.trajectory) for stage, verdicts in judged)

    def part(self, arm: str) -> PlannedArm:
        """The motion of one arm of several, or of one that stands still.

        Args:
            arm: its name, of a cell or of the tips of a robot.

        Raises:
            ValueError: no arm has this name; lists those that there are.
        """
        robot = self.motion.criteria.robot
        if arm in robot.arms:
            own = robot.arms[arm]
            names = tuple(own_name(robot.joints.identifiers[joint], arm) for joint in own)
            return PlannedArm(arm, names, self.trajectory.of_joints(own))
        still = {} if self.scenario.robots is None else self.scenario.robots.still
        if arm in still:
            table, joints = still[arm]
            return PlannedArm(
                arm, table.alone.build().joints.names, Trajectory.standing(np.array(joints), self.duration)
            )
        known = [*robot.arms, *still]
        there = f"there are {', '.join(known)}" if known else "there is one arm alone, which has no name"
        raise ValueError(f"arm: none is called {shown_value(arm)}; {there}")

    @property
    def not_judged(self) -> tuple[str, ...]:
        """Things that no verdict speaks of although they may be there, such as links without geometry; a line each."""
        return self.motion.not_judged

    @property
    def taken(self) -> tuple[str, ...]:
        """Lines on what the motion takes of that which the statement leaves to choose: of goals, of free turns."""
        return self.motion.taken

    @property
    def certified(self) -> bool:
        """Whether every constraint is proven to hold for all t."""
        return self.planned.feasible

    @property
    def search(self) -> Result | None:
        """The record of the search; None where a given path was timed, or the plan was read."""
        return self.planned.search

    @property
    def result(self) -> RunResult:
        """The content of ``result.json``."""
        return result_of(self.planned)

    def __repr__(self) -> str:
        objective = self.planned.criteria.objective
        parts = self.motion.objective_parts or [(objective, 1.0, self.objective)]
        values = ", ".join(
            f"{part.name} {value:.6g} {part.unit}" if isfinite(value) else f"{part.name} is undefined"
            for part, _, value in parts
        )
        return f"<plan: {values}, {self.motion.status_in_words}, T = {self.duration:.4g} s>"

    def to_numpy(self, times: FloatArray | None = None) -> dict[str, FloatArray]:
        """The motion as arrays, by column name: ``t``, ``q1`` ..., as in ``trajectory.csv``.

        Args:
            times: at which, (n,), s; :attr:`times` by default.

        Raises:
            ValueError: they are no times from 0 to T.
        """
        given = self.times if times is None else self.trajectory.checked_times(times_array(times))
        header, table = table_of(self.motion, given)
        return dict(zip(header, table.T, strict=True))

    def to_dataframe(self, times: FloatArray | None = None) -> pd.DataFrame:
        """The rows as a pandas data frame; needs pandas.

        Args:
            times: at which, (n,), s; :attr:`times` by default.

        Raises:
            ImportError: pandas is not installed.
        """
        return data_frame(self.to_numpy(times))

    def plot(self, kind: str = "path") -> Figure:
        """A figure, which a notebook shows.

        Args:
            kind: ``path``, ``joints`` or ``limits``; where something was searched ``convergence``; where obstacles move
                ``clearance``; and what the problem itself offers, such as ``accuracy`` of a path.

        Raises:
            ValueError: there is no such figure of this plan; lists those that there are.
        """
        from tpbso_casadi.figures.notebook import figure_of  # noqa: PLC0415 (matplotlib is slow to load)

        return figure_of(self.planned, kind)

    def animate(self, path: str | Path) -> Path:
        """Write the motion as a film, ``.gif`` or ``.mp4``, or as a player in a page of its own, ``.html``.

        Returns:
            The path of the file.

        Raises:
            TypeError: it is no path.
            OutputError: an unknown suffix, no ffmpeg for an MP4, or a file that cannot be written.
        """
        from tpbso_casadi.animation.write import animate, check_animation  # noqa: PLC0415 (slow to load)

        file = file_path("path", path)
        with in_words_of_python():
            check_animation(file)
            animate(file, file.stem, self.motion)
        return file

    def player(self, height: int = 520) -> Player:
        """The motion as a player, which a notebook shows.

        Args:
            height: of the frame, pixels.

        Raises:
            ValueError: it is no number above 0.
        """
        return Player.of(self.motion, repr(self)[1:-1], round(positive("height", height, "pixels")))

    def view(self, port: int = 8080) -> LiveView:
        """The motion of a robot in space in a scene of viser, which a browser or a notebook shows; needs viser.

        Args:
            port: of its server.

        Raises:
            ImportError: viser is not installed.
            ValueError: the robot is in the plane.
        """
        from tpbso_casadi.animation.live_view import LiveView  # noqa: PLC0415 (slow to load)

        return LiveView(self.motion, whole("port", port))

    def save(
        self,
        folder: str | Path,
        export: Sequence[str] = (),
        figures: Sequence[str] = DEFAULT,
        rate: float | None = None,
    ) -> Path:
        """Write a run folder: ``result.json``, ``trajectory.csv``, figures and exports for a robot.

        Args:
            folder: to write; what another run has left there is replaced.
            export: further files, ``csv`` or other kinds of :meth:`program`.
            figures: formats of the figures: ``png``, ``pdf`` or ``svg``; empty for none.
            rate: of the rows of the exports, Hz. Where it is left out, 100, and those for ROS are chosen so that what
                a controller makes of them is proven, see :attr:`controller_rows`.

        Returns:
            The path of the folder.

        Raises:
            TypeError: the folder is no path.
            ValueError: an unknown kind of export or of figures; a rate that is no number above 0.
            OutputError: the folder cannot be written, or holds anything but a run; the rate makes too many rows.
        """
        place = file_path("folder", folder)
        formats, exports = chosen("figures", figures, FORMATS), exports_of(self.planned, export, rate)
        write_plan(place, self.planned, [*figure_writers(self.planned, formats), *exports])
        return place

    def program(self, kind: str, **settings: Any) -> Program:
        """A program for a controller, a message or a table, with what is proven of the motion that is made of it.

        Args:
            kind: ``ros-json``, ``ros-yaml``, ``csv``, ``npz``, ``urscript``, ``urscript-movej``, ``krl``, ``rsi``,
                ``rapid``, ``egm``, ``fanuc``, ``franka``, ``inform``, an entry point or ``package.module:Class``.
            settings: of this kind, such as ``accuracy`` or ``outputs``.

        Raises:
            OutputError: there is no such kind or setting, or the plan cannot be stated in it.
        """
        return exporter_of(kind, settings).program(self.planned)

    def certificate(self, path: str | Path) -> Path:
        """Write a certificate that others can check with NumPy alone: ``python check_certificate.py FILE``.

        Args:
            path: of the file, JSON; zipped where it ends with ``.gz``.

        Returns:
            The path of the file.

        Raises:
            TypeError: it is no path.
            OutputError: the plan is not certified, there is no certificate of such robots, or the file cannot
                be written.
        """
        file = file_path("path", path)
        with in_words_of_python():
            return write_certificate(file, self.motion)

    def audit(self) -> RunAudit:
        """The certificate of the plan, constraint by constraint, and what holds it back; takes seconds.

        Every constraint is judged again for all t; where the task has a nonlinear program, the conditions of optimality
        are checked, the nearest optimum is searched for, and the motion is planned again with each limit looser.
        """
        with plugin_failures_named(self.scenario):
            return RunAudit(audit_run(self.planned))

    def as_run(self) -> StoredRun:
        """The run that reading the plan's run folder would give."""
        return stored(self.planned)

    def _repr_html_(self) -> str:
        from tpbso_casadi.figures.notebook import png_of  # noqa: PLC0415 (matplotlib is slow to load)

        rows = [(v.name, v.worst_is.number(v.worst), v.bound, v.unit, str(v.status), v.where) for v in self.verdicts]
        judged = table(("constraint", "worst", "limit", "unit", "for all t", "where"), rows)
        return heading(repr(self)[1:-1]) + picture(png_of(self.plot()), "the path of the motion") + judged
