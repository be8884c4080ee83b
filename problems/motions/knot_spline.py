"""The paper's motion along a path: a C2 spline through knots on it, the path passed at equal intervals of time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray, as_array
from problems.motions.motion import SampleGrid
from problems.motions.splines.in_time import SplineInTime, SplineShape
from problems.motions.splines.rest import RestSpline
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

ROWS_PER_SAMPLE = 8  # of a tabulated trajectory


@dataclass(frozen=True)
class KnotSpline(SplineInTime):
    """A spline at rest at both ends, sampled at equal steps of time.

    Args:
        robot: that moves.
        knots: path parameters u of the knots, increasing from 0 to 1.
        points: how many points the path has, at equal steps of u.
        steps: of time between two points.
    """

    robot: Robot
    knots: tuple[float, ...]
    points: int
    steps: int

    @cached_property
    def spline(self) -> RestSpline:
        """The spline through the knots."""
        return RestSpline(np.array(self.knots))

    @cached_property
    def parameters_u(self) -> FloatArray:
        """Path parameters of the samples, (n,); every ``steps``-th is a point of the path."""
        return np.linspace(0.0, 1.0, self.steps * (self.points - 1) + 1)

    @cached_property
    def point_parameters(self) -> FloatArray:
        """Path parameter of each point, (points,)."""
        return np.linspace(0.0, 1.0, self.points)

    @cached_property
    def point_grid(self) -> SampleGrid:
        """The rows at the points of the path, for the angles alone."""
        basis, pieces = self.spline.local_basis(self.point_parameters, 0)
        return SampleGrid(rows=basis, pieces=pieces)

    @cached_property
    def node_grid(self) -> SampleGrid:
        """Rows for the peaks of speed and acceleration at and between the nodes: bases of both, half a step before."""
        speed, pieces = self.spline.local_basis(self.spline.nodes, 1)
        acceleration, _ = self.spline.local_basis(self.spline.nodes, 2)
        half_steps = np.append(0.0, np.diff(self.spline.nodes) / 2.0)
        return SampleGrid(rows=np.column_stack([speed, acceleration, half_steps]), pieces=pieces)

    def trajectory(self, parameters: SplineShape) -> Trajectory:
        """The exact piecewise polynomial of the spline."""
        pieces = self.spline.pieces(as_array(parameters.coefficients))
        return Trajectory.from_pieces(np.diff(self.spline.nodes) * float(parameters.time), pieces)

    def quantities(self, phi: FloatArray, time: float) -> dict[str, FloatArray]:
        """Quantities by name: redundant values at the knots (M, redundancy), t_T, and the knots themselves."""
        named = {f"phi_{j}": column for j, column in enumerate(phi.T, start=3)}
        return {"t_T": np.array([time]), **named, "u_knots": self.spline.knots}

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Equal steps, the samples among them; many, as pieces are short."""
        intervals = self.parameters_u.size - 1
        steps = intervals * max(ROWS_PER_SAMPLE, int(np.ceil((at_least - 1) / intervals)))
        return np.linspace(0.0, trajectory.duration, steps + 1)
