"""Rows for the control interface of Franka Robotics, which takes a posture every millisecond.

[1] Franka Control Interface documentation, https://frankarobotics.github.io/docs: joint positions at 1 kHz, of which
the controller computes velocities, accelerations and jerks by backward differences and holds them against limits.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from problems.base import Range
from tpbso_casadi.programs.program import IN_RADIANS
from tpbso_casadi.programs.streams import RowTable


class Franka(RowTable):
    """Rows of joint angles every millisecond, for the callback of ``robot.control`` in libfranka."""

    title: ClassVar[str] = "Franka FCI, rows"
    axes: ClassVar[int] = 7
    per_unit: ClassVar[tuple[float, float]] = IN_RADIANS
    digits: ClassVar[int] = 12
    columns: ClassVar[str] = "q{}"
    joined: ClassVar[str] = (
        "the callback sends each row as it is, without low-pass filter and rate limiter of libfranka"
    )

    period: Annotated[float, Range(least=0.001, most=0.001)] = 0.001
