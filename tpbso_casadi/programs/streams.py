"""Rows at the period of a controller, and what is proven of whatever it makes of them between two rows."""

from __future__ import annotations

import csv
import io
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil
from typing import Annotated, ClassVar

import numpy as np

from problems import CertificateStatus, Trajectory
from problems.base import FloatArray, Range
from problems.motions import held_and_joined
from tpbso_casadi.planning import JudgedMotion, PlannedMotion
from tpbso_casadi.programs.program import Coding, ControllerExporter, Program, Proof, Signal
from tpbso_casadi.programs.proofs import clear_within, has_moving_obstacles, parts_of, said
from tpbso_casadi.storage import OutputError

SAME_TIME = 1e-9  # of a period: a motion that is so little longer than whole periods needs no row more
MOST_ROWS = 1_000_000
RATES = ("speed", "acceleration", "jerk")


@dataclass(frozen=True, eq=False)
class Stream:
    """Rows of a motion at equal steps of time; the last ones, where it stands already, are its end.

    Attributes:
        motion: of which they are.
        period: between two rows, s.
        coding: of the numbers in a program.
        signals: each with the row before which it is told.
    """

    motion: JudgedMotion
    period: float
    coding: Coding
    signals: tuple[tuple[int, Signal], ...]

    @cached_property
    def times(self) -> FloatArray:
        """The times of the rows, (n,), s; the last may be later than the end of the motion."""
        count = ceil(self.motion.trajectory.duration / self.period - SAME_TIME)
        return np.asarray(np.arange(count + 1.0) * self.period)

    @cached_property
    def values(self) -> FloatArray:
        """The numbers of the program, (n, dof)."""
        trajectory = self.motion.trajectory
        return self.coding.encoded(trajectory.at(np.minimum(self.times, trajectory.duration)))

    @cached_property
    def rows(self) -> FloatArray:
        """The numbers of the program as they are read, (n, dof), rad or m."""
        return self.coding.decoded(self.values)

    @cached_property
    def lasting(self) -> Trajectory:
        """The motion and, until the last row, the robot that stands at its end."""
        trajectory = self.motion.trajectory
        beyond = self.times[-1] - trajectory.duration
        if beyond <= SAME_TIME * self.period:
            return trajectory
        return trajectory.followed_by(Trajectory.standing(trajectory.value_at_end(), beyond))

    @cached_property
    def deviations(self) -> tuple[FloatArray, FloatArray]:
        """How far joints are from the plan at most, (dof,), where rows are held, and where they are joined by lines."""
        times = self.times.copy()
        times[-1] = self.lasting.duration
        return held_and_joined(self.lasting, times, self.rows)

    @cached_property
    def shares(self) -> dict[str, tuple[float, float]]:
        """The largest difference quotient of rows as a share of its limit, by rate, and what rounding may add."""
        found, step = {}, self.coding.rounding
        rows = np.concatenate([self.rows[:1].repeat(3, axis=0), self.rows, self.rows[-1:].repeat(3, axis=0)])
        for order, name in enumerate(RATES, start=1):
            limit = getattr(self.motion.criteria.robot.limits, name)
            if limit is not None:
                size = self.period**order * np.array(limit)
                quotient = np.abs(np.diff(rows, order, axis=0)).max(axis=0) / size
                found[name] = float(quotient.max()), float((2.0**order * step / size).max()) + 1e-6
        return found


class StreamExporter(ControllerExporter):
    """A writer of rows at the period of a controller that is sent one after the other.

    Attributes:
        joined: what the maker documents of the motion between two rows, or that nothing is.
        unsaid: what the format has no place for.
    """

    joined: ClassVar[str]
    unsaid: ClassVar[tuple[str, ...]] = ("velocities and accelerations of the rows, torques",)

    period: Annotated[float, Range(least=1e-4, most=0.1)] = field(default=0.004)

    @abstractmethod
    def text(self, stream: Stream, notes: list[str]) -> dict[str, str]:
        """The files of a program, by their names.

        Args:
            stream: its rows.
            notes: lines of comment.
        """

    def program(self, plan: PlannedMotion) -> Program:
        motion, robot = plan.motion, plan.criteria.robot
        coding = self.coding(robot)
        if motion.trajectory.duration / self.period > MOST_ROWS:
            raise OutputError(f"{self.title}: more than {MOST_ROWS} rows")
        told = [(stage.start, self.signal(*stage.signal)) for stage in motion.stages if stage.signal is not None]
        signals = tuple((ceil(time / self.period - SAME_TIME), signal) for time, signal in told)
        stream = Stream(motion, self.period, coding, signals)
        program = Program(
            content=f"{self.title}: {len(stream.times)} rows, one every {1e3 * self.period:g} ms",
            proofs=(*self._clear(motion, *stream.deviations), self._rates(stream)),
            assumptions=("the robot stands at the first row", self.joined),
            unstated=(*self.silent(signal for _, signal in signals), *self.unsaid),
            planned=motion.status,
        )
        return program.with_files(self.text(stream, program.notes))

    def _clear(self, motion: JudgedMotion, held: FloatArray, joined: FloatArray) -> Iterator[Proof]:
        """Proofs on what is between two rows: on lines, and on rows that are held until the next.

        Rows that are held are postures of the plan up to a period ago, which matters for obstacles that move.
        """
        robot, moving = motion.criteria.robot, has_moving_obstacles(parts_of(motion))
        lines = clear_within(parts_of(motion), joined)
        yield Proof(f"clearances where rows are joined by lines, {said(robot, joined)} from the plan at most", lines)
        yield Proof(
            f"clearances where rows are held until the next, {said(robot, held)} behind the plan at most",
            clear_within(parts_of(motion), held) if moving else lines,
        )

    def _rates(self, stream: Stream) -> Proof:
        """The proof on difference quotients of the rows: they are finitely many."""
        kept = all(share <= 1.0 + rounding for share, rounding in stream.shares.values())
        shares = ", ".join(f"{name} {100.0 * share:.4g} %" for name, (share, _) in stream.shares.items())
        status = CertificateStatus.CERTIFIED if kept else CertificateStatus.VIOLATED
        return Proof(f"difference quotients of rows: {shares} of the limits", status)


class RowTable(StreamExporter):
    """A writer of rows as a table, for a program of the user's that sends them; the class names the file.

    Attributes:
        columns: the names of the axes.
    """

    columns: ClassVar[str]

    def text(self, stream: Stream, notes: list[str]) -> dict[str, str]:
        told: dict[int, list[str]] = {}
        for row, signal in stream.signals:
            told.setdefault(row, []).append(signal.said)
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        axes = range(1, stream.rows.shape[1] + 1)
        rows.writerow(["t", *map(self.columns.format, axes), "signal"])
        for row, (time, values) in enumerate(zip(stream.times.tolist(), stream.values, strict=True)):
            rows.writerow([f"{time:.6f}", *stream.coding.text(values), " ".join(told.get(row, ()))])
        file = f"{self.name}-{type(self).__name__.lower()}"
        return {f"{file}.csv": text.getvalue(), f"{file}.txt": "\n".join([*notes, ""])}
