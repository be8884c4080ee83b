"""Limits beyond the paper's: on jerk, on the speed of the tip, on speeds that do not scale; kept by both programs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links

from problems import (
    CertificateStatus,
    Constraint,
    InvalidProblem,
    Limit,
    PathFollowing,
    PlanarArm,
    PointToPoint,
    Problem,
    Robot,
    closed_curve,
    path_following,
    point_to_point,
)
from problems.base import Matrix
from problems.certify import exact_time_scale
from problems.limits import holds_time, limits_of
from problems.limits.joint_limits import SpeedLimit
from problems.motions import Samples
from problems.robots import JointLimits
from solvers import IPOPT, Descent

MAX_JERK = 150.0  # rad/s^3
BETWEEN = 0.03  # may be broken between samples in a single descent
LINK = 2.0 / 3.0  # m
FASTEST = 1.2  # m/s


@dataclass(frozen=True)
class SmoothArm(PlanarArm):
    """A planar arm with a largest jerk."""

    @property
    def limits(self) -> JointLimits:
        return replace(super().limits, jerk=(MAX_JERK,) * self.links)


@dataclass(frozen=True)
class TipSpeed(Limit):
    """The tip is never faster than ``FASTEST``: run slowly enough, every shape keeps it."""

    name: ClassVar[str] = "tip speed"
    robot: Robot

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Any) -> Self:
        return cls(robot)

    def velocity(self, samples: Samples) -> Matrix:
        angle, turn = ca.cumsum(samples.theta, 1), ca.cumsum(samples.speed, 1)
        x, y = (ca.sum2(LINK * part(angle) * turn) for part in (ca.sin, ca.cos))
        return ca.sqrt(x**2 + y**2)

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        return [
            Constraint(
                name=self.name,
                unit="m/s",
                expression=self.velocity(samples),
                lower=None,
                upper=ca.DM(FASTEST * (1.0 - margin)),
                columns=("tip",),
            )
        ]

    @property
    def scales_with_time(self) -> bool:
        return True

    def magnitudes(self, samples: Samples) -> Matrix:
        return self.velocity(samples)

    def time_scale(self, peaks: Matrix) -> Matrix:
        return peaks[0] / FASTEST


@dataclass(frozen=True)
class NotTooSoon(Limit):
    """The first joint is never faster than 1 rad/s; not told to scale with time."""

    name: ClassVar[str] = "not too soon"
    robot: Robot

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Any) -> Self:
        return cls(robot)

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        return [
            Constraint(
                name=self.name,
                unit="rad/s",
                expression=samples.speed[:, 0],
                lower=ca.DM(-1.0),
                upper=ca.DM(1.0),
                columns=("joint 1",),
            )
        ]


def arm(kind: type[PlanarArm] = PlanarArm) -> PlanarArm:
    plain = equal_links(3)
    return kind(plain.link_lengths, plain.max_speed, plain.max_acceleration)


@cache
def problem(kind: str, robot: PlanarArm, *limits: type[Limit], objective: str = "time") -> Problem[Any]:
    if kind == "point to point":
        return point_to_point(PointToPoint(robot, (1.0, 0.0), (0.5, 1.5), elbow="up"), objective, limits=limits)
    path = closed_curve((0.1, 0.0), 1.0, 0.0, 3, 0.1, 20)
    return path_following(PathFollowing(robot, path, 0.05, elbow="up"), objective, limits=limits)


@pytest.mark.parametrize("kind", ["point to point", "path"])
@pytest.mark.parametrize("limits", [(), (TipSpeed,), (NotTooSoon,)], ids=["jerk", "scales", "holds time"])
@pytest.mark.parametrize("objective", ["time", "rotation"])
def test_ipopt_keeps_them(kind: str, limits: tuple[type[Limit], ...], objective: str) -> None:
    stated = problem(kind, arm() if limits else arm(SmoothArm), *limits, objective=objective)
    program = stated.nlp()
    solution = Descent(program, IPOPT())(next(program.starts(np.random.default_rng(1))))
    verdicts = stated.verify(program.trajectory(solution.x))
    names = [verdict.name for verdict in verdicts]
    assert ("jerk" if not limits else limits[0].name) in names
    broken = [v for v in verdicts if v.status is CertificateStatus.VIOLATED and v.worst > v.bound * (1.0 + BETWEEN)]
    assert not broken


def test_the_time_scale_of_a_limit_without_closed_form() -> None:
    stated = problem("point to point", arm())
    motion = stated.trajectory(np.mean(stated.bounds, axis=0))
    limit = TipSpeed(stated.robot)
    scaled = motion.time_scaled(exact_time_scale([limit], motion))
    fastest = float(ca.mmax(limit.velocity(scaled.samples(scaled.times(5001), stated.robot))))
    assert fastest <= FASTEST
    assert fastest > FASTEST * 0.99


@pytest.mark.parametrize(("limit", "expected"), [(NotTooSoon, True), (TipSpeed, False), (SpeedLimit, False)])
def test_which_limits_hold_time(limit: type[Limit], expected: bool) -> None:
    built = limit.for_robot(arm(), ())
    assert built is not None
    assert holds_time([built]) is expected


def test_no_limit_is_there_twice() -> None:
    with pytest.raises(InvalidProblem, match="'tip speed' is there twice"):
        limits_of(arm(), (), (TipSpeed, TipSpeed))
