"""The paper's first case: point to point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from problems.assembly import CostSteps, Problem, SearchedTimeScale, objective_named, peak_loop
from problems.base import FloatArray
from problems.evaluation import Program, Step
from problems.families.two_segments.encoding import SEGMENT_ENCODINGS, SegmentsEncoding
from problems.families.two_segments.motion import Quantities, TwoSegments
from problems.families.two_segments.program import PointToPointNlp
from problems.limits import LimitKind, limits_of
from problems.motions import Trajectory
from problems.objectives import Objective
from problems.tasks import Milestone, PointToPoint, check_at_least, check_choice


def point_to_point(
    task: PointToPoint,
    objective: Objective | str = "time",
    formulation: str = "paper",
    samples: int = 50,
    limits: Sequence[LimitKind] = (),
) -> PointToPointProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, start, goal, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        formulation: a key of ``SEGMENT_ENCODINGS``: ``paper``, the cost (15) over the paper's solution vector; or
            ``reduced``, feasible by construction.
        samples: time steps a segment at which objective and constraints are sampled.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, or too few samples.
    """
    check_choice("formulation", formulation, SEGMENT_ENCODINGS)
    check_at_least("samples", samples, 2, " time steps a segment")
    motion, minimised = TwoSegments(task.robot, samples), objective_named(objective, task.robot)
    kind = SEGMENT_ENCODINGS[formulation]
    return PointToPointProblem(
        task=task,
        motion=motion,
        encoding=kind(task, motion, SearchedTimeScale.where_needed(minimised, task) if kind.scales_time else None),
        objective=minimised,
        limits=limits_of(task.robot, task.obstacles, limits),
    )


@dataclass(frozen=True, kw_only=True)
class PointToPointProblem(Problem[Quantities]):
    """Move the tool from rest at one point to rest at another."""

    task: PointToPoint
    motion: TwoSegments
    encoding: SegmentsEncoding

    def cost_program(self) -> Program:
        """Decode, [find the peaks, scale the time,] sample, finish."""
        return SegmentSteps(self).program()

    def nlp(self) -> PointToPointNlp:
        """The same problem for solvers that follow gradients."""
        return PointToPointNlp(self.task, self.motion, self.objective, self.limits, self.parameters_of)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """theta_s, theta_m, dtheta_m, theta_f, t1, t2 of one candidate (d,)."""
        return self.parameters_of(x).arrays()

    def milestones(self, trajectory: Trajectory) -> tuple[Milestone, ...]:
        """The control point, where the segments meet."""
        return (Milestone(label="control point", time=float(trajectory.breakpoints[1])),)


class SegmentSteps(CostSteps[Quantities]):
    """Decode; where time is scaled, find the peaks of the shape and scale it."""

    encoding: SegmentsEncoding

    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
        """The steps from the candidate to the motion's blocks."""
        decoded = self.encoding.decode(self.x)
        reach = {} if decoded.reach is None else {"reach": decoded.reach.expression.T}
        if not self.encoding.scales_time:
            outputs = self.motion_vectors(decoded.parameters, orders, starting_values)
            return [Step.of("decode", {"x": self.x, "p": self.p}, {**reach, **outputs})]
        loop = peak_loop(self.motion, self.slowing, self.p)
        outputs = {
            "shape": ca.vertcat(*(ca.vec(matrix) for matrix in self.motion.as_matrices(decoded.parameters))),
            "shape_durations": self.motion.durations(decoded.parameters),
            "shape_blocks": self.motion.blocks(decoded.parameters, loop.orders),
            "peaks": ca.SX.zeros(loop.starting_values["peaks"]),
        }
        decode = Step.of("decode", {"x": self.x, "p": self.p}, {**reach, **outputs})
        vector, peaks = ca.SX.sym("shape", outputs["shape"].shape[0]), ca.SX.sym("peaks", outputs["peaks"].shape[0])
        shape = Quantities.from_vector(vector)
        quantities = self.encoding.timed(shape, self.slowing, self.peaks_of_each(peaks), self.x)
        inputs = {**self.time_scale_inputs, "shape": vector, "peaks": peaks}
        return [
            decode,
            loop.step,
            Step.of("scale", inputs, self.motion_vectors(quantities, orders, starting_values)),
        ]

    @property
    def reach_size(self) -> int:
        """Two: k_s and k_f."""
        return 2
