"""Search vectors of tracing a path: redundancy along it, and the elbow; a spline leads through postures at knots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray
from problems.encodings.encoding import Variable
from problems.encodings.path_encoding import PathEncoding
from problems.encodings.timing.pace import Pace
from problems.encodings.timing.path_timing import step_limits
from problems.encodings.timing.slowness import Slowness
from problems.encodings.traced_knots import TracedKnots, longest_timing
from problems.limits.distances.step import StepLimit
from problems.limits.limit import Limit
from problems.motions.path_spline import TimedPath
from problems.motions.traced_spline import TracedSpline
from problems.objectives.objective import MotionBounds
from problems.robots.robot import Robot
from problems.tasks.elbow import Elbow
from problems.tasks.paths.path_tracing import PathTracing


@dataclass(frozen=True)
class Tracing(TracedKnots, PathEncoding[TimedPath]):
    """Feasible by construction, except for the accuracy, obstacles and joint ranges.

    Args:
        task: whose path and elbow.
        motion: that is decoded; its nodes are the knots.
        points: at the knots, m.
        redundancy_values: how many values of x_phi are decided for each redundant link.
        slowness: the last variable, where the duration is one.
        pace: the variables before it, where obstacles move.
    """

    task: PathTracing
    motion: TracedSpline
    points: tuple[tuple[float, ...], ...]
    redundancy_values: int = 5
    slowness: Slowness | None = None
    pace: Pace | None = None
    moving_ends: tuple[bool, bool] = field(init=False, default=(False, False))
    step_limits: tuple[StepLimit, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "step_limits", step_limits(self.task))

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @property
    def elbow(self) -> Elbow:
        """The branch of inverse kinematics."""
        return self.task.elbow

    @cached_property
    def knots(self) -> FloatArray:
        """Path parameters of the knots, (M,)."""
        return np.array(self.motion.nodes)

    @cached_property
    def knot_points(self) -> FloatArray:
        """The points at the knots, (M, dim), m."""
        return np.array(self.points)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """x_phi of each redundant link, [elbow,] [slowness]; one that changes nothing where nothing is to choose."""
        return (*self.posture_variables, *self.timing_variables) or (Variable("unused", 0.0, 1.0, "1"),)

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds of the motions of the search box: joints turn by at most pi from knot to knot."""
        return MotionBounds(
            duration=self.longest(longest_timing(self.motion), limits),
            rotation=self.robot.dof * np.pi * (self.knots.size - 1) * 4.0,
            radius=self.robot.reach()[1],
        )
