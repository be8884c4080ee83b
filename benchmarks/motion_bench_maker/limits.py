"""Limits of the joints: speeds and ranges of the URDF; accelerations and jerks of the data sheet, or given."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.motion_bench_maker.kinematics import Kinematics
from benchmarks.motion_bench_maker.problem_file import InvalidFile
from problems.robots import JointLimits

PANDA = (  # Franka Emika's data sheet, rad/s^2 and rad/s^3
    (15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
    (7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0),
)
CUROBO = 15.0, 500.0  # of all joints of any robot, where a data sheet has none


def limits_of(
    kinematics: Kinematics, acceleration: Sequence[float] | None = None, jerk: Sequence[float] | None = None
) -> JointLimits:
    """Limits of a robot.

    Args:
        kinematics: of the robot.
        acceleration: rad/s^2; one number for all joints or one for each, by default the data sheet's.
        jerk: rad/s^3; likewise.

    Raises:
        InvalidFile: another number of them.
    """
    k = len(kinematics.names)
    sheet = PANDA if kinematics.names[0].startswith("panda") else ((CUROBO[0],), (CUROBO[1],))
    return JointLimits(
        speed=tuple(kinematics.speed.tolist()),
        acceleration=_each("--max-acceleration", acceleration or sheet[0], k),
        jerk=_each("--max-jerk", jerk or sheet[1], k),
        position=tuple((low, high) for low, high in kinematics.position.tolist()),
    )


def _each(option: str, values: Sequence[float], joints: int) -> tuple[float, ...]:
    if len(values) not in (1, joints) or min(values) <= 0.0:
        raise InvalidFile(f"{option}: is not one positive number, or {joints}")
    return tuple(values) * (joints // len(values))
