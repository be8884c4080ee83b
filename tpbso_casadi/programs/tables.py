"""Tables of a motion at equal steps of time, CSV and NPZ, for programs of the user's."""

from __future__ import annotations

import csv
import io
from abc import abstractmethod
from typing import Annotated, ClassVar, TypeAlias

import numpy as np

from problems.base import FloatArray, Range, as_array
from tpbso_casadi.planning import JudgedMotion, PlannedMotion
from tpbso_casadi.programs.program import Exporter, Program
from tpbso_casadi.storage import OutputError, table_of

DEFAULT_RATE = 100.0  # Hz, of tables
HIGHEST_RATE = 10_000.0  # Hz
MOST_ROWS = 200_000  # which take some hundred MB
Rate: TypeAlias = Annotated[float, Range(above=0.0, most=HIGHEST_RATE)]


def equal_steps(motion: JudgedMotion, rate: float) -> FloatArray:
    """Times in s from 0 to the end of the motion, at least two.

    Raises:
        OutputError: they are more than ``MOST_ROWS``.
    """
    duration = motion.trajectory.duration
    if not duration * rate <= MOST_ROWS:
        raise OutputError(
            f"--rate {rate:g}: makes more than {MOST_ROWS} rows of a motion of {duration:.4g} s; "
            f"at most {MOST_ROWS / duration:.4g} Hz"
        )
    times = np.arange(np.ceil(duration * rate * (1.0 - 1e-9))) / rate
    return np.append(times, duration)


class MotionTable(Exporter):
    """A writer of tables; ``rate`` is that of their rows, Hz."""

    file: ClassVar[str]

    rate: Rate = DEFAULT_RATE

    @abstractmethod
    def content(self, motion: JudgedMotion, times: FloatArray) -> bytes:
        """The content of the file, with rows at times (n,) in s."""

    def program(self, plan: PlannedMotion) -> Program:
        times = equal_steps(plan.motion, self.rate)
        return Program(
            content=f"{self.file}: {len(times)} rows at equal steps of time",
            proofs=(),
            assumptions=(),
            unstated=(),
            planned=plan.motion.status,
            files={self.file: self.content(plan.motion, times)},
        )


class Csv(MotionTable):
    """A table of positions, velocities, accelerations, the tool, torques."""

    title: ClassVar[str] = "CSV"
    file: ClassVar[str] = "joint_trajectory.csv"

    def content(self, motion: JudgedMotion, times: FloatArray) -> bytes:
        header, table = table_of(motion, times)
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(table.tolist())
        return text.getvalue().encode()


class Npz(MotionTable):
    """The arrays of the table, and the exact polynomials."""

    title: ClassVar[str] = "NPZ"
    file: ClassVar[str] = "joint_trajectory.npz"

    def content(self, motion: JudgedMotion, times: FloatArray) -> bytes:
        robot, samples = motion.criteria.robot, motion.trajectory.samples(times)
        pose = np.column_stack([*robot.tool.coordinates(as_array(samples.theta)).values()])
        arrays = {
            "t": times,
            "q": as_array(samples.theta),
            "qd": as_array(samples.speed),
            "qdd": as_array(samples.acceleration),
            "tip": pose[:, : robot.dim],
            "breakpoints": motion.trajectory.breakpoints,
            "coefficients": motion.trajectory.coefficients,
        }
        torques = motion.torques(times)
        if torques is not None:
            arrays["tau"] = torques
        if pose.shape[1] > robot.dim:
            arrays |= {"quaternion": pose[:, robot.dim :], "joint_names": np.array(robot.joints.identifiers)}
        found = io.BytesIO()
        np.savez(found, **arrays)  # type: ignore[arg-type]
        return found.getvalue()
