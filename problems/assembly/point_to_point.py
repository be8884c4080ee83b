"""Point-to-point planning, Section III-A, first case: (3)-(6), (8)-(18), for any k >= 2.

The arm's own quantities are theta_s, theta_m, dtheta_m, theta_f, t1 and t2: the motion runs from theta_s at rest
along a quartic to theta_m, and along a quintic to theta_f at rest. A search vector is turned into them by inverse
kinematics (:class:`PointToPoint`); a nonlinear program may take them as its variables. Objective and
limits depend on the quantities alone.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from math import pi
from typing import TYPE_CHECKING, get_args

import casadi as ca
import numpy as np

from problems.assembly.problem import SAMPLING_MARGIN, Model, Problem, Variable
from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, as_array, split
from problems.certify.verification import end_verdicts
from problems.encodings.penalty import Ceilings, PenaltyWeights, graded_cost, paper_cost, penalty_weights
from problems.limits.constraint import Constraint, Verdict
from problems.limits.motion_limits import minimum_time_scale, motion_constraints
from problems.motions.samples import Samples
from problems.motions.segments import (
    QUARTIC,
    QUINTIC,
    middle_acceleration,
    quartic_data,
    quintic_data,
    sampling_matrix,
)
from problems.motions.trajectory import Trajectory
from problems.objectives.objective import OBJECTIVES, Objective
from problems.robots.planar import PlanarArm
from problems.robots.redundancy import restore
from problems.scene.ellipse import Ellipse
from problems.tasks.checks import (
    Elbow,
    Formulation,
    check_choices,
    check_elbow,
    check_obstacles,
    check_point,
    check_range,
    elbow_signs,
)

if TYPE_CHECKING:
    from problems.nlp.point_to_point import PointToPointNlp

SHARE = (0.1, 0.9)  # reduced: t1 / (t1 + t2)
DETOUR = pi  # reduced: how far theta_m may lie from the middle of theta_s and theta_f, rad
SHAPE_SPEED = 8.0  # reduced: bound of dtheta_m in rad per duration of the motion


@dataclass(frozen=True)
class Quantities:
    """The arm's own quantities: angles (1, k) in rad, speeds (1, k) in rad/s, times scalar in s."""

    theta_s: Matrix
    theta_m: Matrix
    dtheta_m: Matrix
    theta_f: Matrix
    t1: Matrix
    t2: Matrix

    def time_scaled(self, factor: Matrix) -> Quantities:
        """The same shape run ``factor`` times slower."""
        slower = self.dtheta_m / factor, self.theta_f, self.t1 * factor, self.t2 * factor
        return Quantities(self.theta_s, self.theta_m, *slower)

    @property
    def data(self) -> tuple[Matrix, Matrix]:
        """Boundary data of the quartic (3, k) and the quintic (4, k), rad."""
        start = self.theta_s, self.theta_m, self.dtheta_m, self.t1
        first = quartic_data(*start)
        second = quintic_data(self.theta_m, self.dtheta_m, middle_acceleration(*start), self.theta_f, self.t2)
        return first, second

    def sampled(self, samples: int) -> Samples:
        """Both segments in ``samples`` equal steps each: (2 samples + 1, k)."""
        tau = np.arange(1, samples + 1) / samples
        blocks = []
        early, late = self.data
        for derivative in range(3):
            first = sampling_matrix(QUARTIC, np.append(0.0, tau), derivative)
            second = sampling_matrix(QUINTIC, tau, derivative)
            blocks.append(
                ca.vertcat(
                    ca.mtimes(first, early / self.t1**derivative),
                    ca.mtimes(second, late / self.t2**derivative),
                )
            )
        return Samples(blocks[0], blocks[1], blocks[2], self.t1 + self.t2)

    def trajectory(self) -> Trajectory:
        """Quartic (3) and quintic (5), exactly; of numeric quantities."""
        pieces = [
            coefficients @ as_array(data) for coefficients, data in zip((QUARTIC, QUINTIC), self.data, strict=True)
        ]
        return Trajectory.from_pieces(np.array([float(self.t1), float(self.t2)]), pieces)

    def arrays(self) -> dict[str, FloatArray]:
        """Numeric quantities by name, each (k,) or (1,)."""
        return {field.name: as_array(getattr(self, field.name)).ravel() for field in fields(self)}


@dataclass(frozen=True)
class PointToPoint(Problem):
    """Move the tip from rest at ``start`` to rest at ``goal``.

    Args:
        arm: the arm.
        start: tip position at t = 0, m.
        goal: tip position at t = T, m.
        objective: ``time`` (8), ``rotation`` (9) or ``length`` (10).
        elbow: the branch of inverse kinematics at both ends; ``free`` adds one decision variable an end, whose
            sign picks it.
        formulation: ``paper``, the cost (15) over the paper's solution vector; or ``reduced``, feasible by
            construction: time scaling keeps the speed and acceleration limits, normalised redundancy keeps
            within reach, and theta_m is counted from the middle of theta_s and theta_f.
        samples: time steps a segment at which objective and constraints are sampled.
        obstacles: to keep clear of.
        segment_time: bounds of t1 and t2, s. The upper one is the paper formulation's search box only.

    Raises:
        InvalidProblem: a point is out of reach, too close to the base or inside an obstacle, or a field is not
            one of the above.
    """

    arm: PlanarArm
    start: tuple[float, float]
    goal: tuple[float, float]
    objective: str = "time"
    elbow: Elbow = "free"
    formulation: Formulation = "paper"
    samples: int = 50
    obstacles: tuple[Ellipse, ...] = ()
    segment_time: tuple[float, float] = (0.1, 4.0)

    def __post_init__(self) -> None:
        check_choices(self, objective=OBJECTIVES, elbow=get_args(Elbow), formulation=get_args(Formulation))
        if self.samples < 2:
            raise InvalidProblem("samples", f"{self.samples} is fewer than 2 time steps a segment")
        check_range("segment_time", self.segment_time)
        check_elbow(self.arm, self.elbow)
        check_obstacles(self.obstacles)
        for field in ("start", "goal"):
            check_point(self.arm, self.obstacles, field, getattr(self, field))

    @property
    def measured_by(self) -> Objective:
        """The objective (8), (9) or (10)."""
        return OBJECTIVES[self.objective]

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The paper's solution vector: theta_m, dtheta_m, phi_s, phi_f, [elbows,] t1, t2 (reduced: their shape)."""
        reduced = self.formulation == "reduced"
        joints, links = range(1, self.arm.links + 1), range(3, self.arm.links + 1)
        ranges = self.arm.joint_limits or ((-pi, pi),) * self.arm.links
        listed = []
        if reduced:
            listed += [Variable(f"detour[{i}]", -DETOUR, DETOUR, "rad") for i in joints]
            listed += [Variable(f"dtheta_m[{i}]", -SHAPE_SPEED, SHAPE_SPEED, "rad/T") for i in joints]
        else:
            listed += [Variable(f"theta_m[{i}]", *ranges[i - 1], "rad") for i in joints]
            speeds = self.arm.max_speed
            listed += [Variable(f"dtheta_m[{i}]", -speeds[i - 1], speeds[i - 1], "rad/s") for i in joints]
        box, unit = ((0.0, 1.0), "1") if reduced else ((-pi, pi), "rad")
        symbol = "x_phi" if reduced else "phi"
        listed += [Variable(f"{symbol}_{end}[{j}]", *box, unit) for end in "sf" for j in links]
        if self.elbow == "free":
            listed += [Variable(f"elbow_{end}", -1.0, 1.0, "1") for end in "sf"]
        if reduced:
            return (*listed, Variable("t1/T", *SHARE, "1"))
        return (*listed, *(Variable(name, *self.segment_time, "s") for name in ("t1", "t2")))

    def decode(self, x: Matrix) -> tuple[Quantities, Matrix]:
        """From a search vector (d, 1) to the arm's own quantities, and k_s, k_f of (13) as a (1, 2) row."""
        k, extra = self.arm.links, self.arm.links - 2
        branches = 2 if self.elbow == "free" else 0
        times_given = 1 if self.formulation == "reduced" else 2
        theta_m, dtheta_m, phi_s, phi_f, branch, times = split(x, [k, k, extra, extra, branches, times_given])
        elbow = elbow_signs(self.elbow, branch, ends=2)
        start, goal = ca.DM(list(self.start)), ca.DM(list(self.goal))
        if self.formulation == "reduced":
            phi_s, phi_f = restore(self.arm, start, phi_s), restore(self.arm, goal, phi_f)
        theta_s, k_s = self.arm.inverse(start, phi_s, elbow[0])
        theta_f, k_f = self.arm.inverse(goal, phi_f, elbow[1])
        theta_s = self.arm.wrap(theta_s)
        theta_f = self.arm.wrap_near(theta_f, theta_s)
        reach = ca.horzcat(k_s, k_f)
        if self.formulation == "paper":
            return Quantities(theta_s, theta_m.T, dtheta_m.T, theta_f, times[0], times[1]), reach
        theta_m = (theta_s + theta_f) / 2.0 + theta_m.T
        shape = Quantities(theta_s, theta_m, dtheta_m.T, theta_f, times[0], 1.0 - times[0])
        return shape.time_scaled(self._least_duration(shape)), reach

    def _least_duration(self, shape: Quantities) -> Matrix:
        """T in s at which a shape of duration 1 just keeps its limits at the samples and t1, t2 their minimum."""
        samples = shape.sampled(self.samples)
        shortest = self.segment_time[0] / ca.fmin(shape.t1, shape.t2)
        return ca.fmax(shortest, minimum_time_scale(self.arm, samples.speed, samples.acceleration))

    @cached_property
    def model(self) -> Model:
        """Cost (15), or its reduced form, over the search vector."""
        x = ca.SX.sym("x", len(self.variables))
        quantities, cosines = self.decode(x)
        samples = quantities.sampled(self.samples)
        objective = self.measured_by.of(self.arm, samples)
        limits = motion_constraints(self.arm, self.obstacles, samples, SAMPLING_MARGIN)
        reach = reach_limit(cosines)
        if self.formulation == "paper":
            cost = paper_cost(objective, limits, reach, self._weights(limits))
        else:
            kept = [limit for limit in limits if limit.name not in ("speed", "acceleration")]
            cost = graded_cost(objective, kept, self._ceilings.objective)
        return Model(x, objective, (*limits, reach), cost)

    @property
    def objective_upper_bound(self) -> float:
        """What the objective cannot exceed in the search box, in its unit."""
        return self._ceilings.objective

    @property
    def penalty_weights(self) -> PenaltyWeights:
        """lambda_1 and lambda_2 of (15) for this problem."""
        return self._weights([c for c in self.constraints if c.name != "reach"])

    def _weights(self, limits: list[Constraint]) -> PenaltyWeights:
        return penalty_weights(limits, self._ceilings)

    @cached_property
    def _ceilings(self) -> Ceilings:
        """Bounds over the whole box from the Bernstein form of (3) and (5); crude, but proven."""
        largest = {v.name: max(abs(v.lower), abs(v.upper)) for v in self.variables}
        joints = range(1, self.arm.links + 1)
        speed = np.array([largest[f"dtheta_m[{i}]"] for i in joints])
        angles = np.pi if self.arm.joint_limits is None else np.abs(self.arm.joint_limits).max()
        step = np.full(self.arm.links, 2.0 * (angles + 2.0 * pi))  # |theta_m - theta_s|, |theta_f - theta_m|
        t1 = t2 = self.segment_time
        if self.formulation == "reduced":
            t1 = t2 = SHARE
        middle = 6.0 * speed / t1[0] + 12.0 * step / t1[0] ** 2
        fastest = 5.0 * step / min(t1[0], t2[0]) + 2.0 * speed + middle * t2[1] / 4.0
        sharpest = 20.0 * step / min(t1[0], t2[0]) ** 2 + 12.0 * speed / t2[0] + 2.0 * middle
        duration = t1[1] + t2[1]
        rotation = duration * fastest
        if self.formulation == "reduced":
            stretch = float(minimum_time_scale(self.arm, ca.DM(fastest).T, ca.DM(sharpest).T))
            duration = max(stretch, self.segment_time[0] / SHARE[0])
        length = self.arm.reach()[1] * float(rotation.sum())
        objective = {"time": duration, "rotation": float(rotation.sum()), "length": length}[self.objective]
        return Ceilings(objective, {"speed": fastest, "acceleration": sharpest})

    @cached_property
    def _decoder(self) -> ca.Function:
        quantities, _ = self.decode(self.model.x)
        return ca.Function("decode", [self.model.x], [getattr(quantities, f.name) for f in fields(Quantities)])

    def quantities_of(self, x: FloatArray) -> Quantities:
        """Numeric quantities of one candidate (d,)."""
        return Quantities(*self._decoder(x))

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """theta_s, theta_m, dtheta_m, theta_f, t1, t2 of one candidate (d,)."""
        return self.quantities_of(x).arrays()

    def trajectory(self, x: FloatArray) -> Trajectory:
        """Quartic (3) and quintic (5) of one candidate (d,), exactly."""
        return self.quantities_of(x).trajectory()

    def nlp(self) -> PointToPointNlp:
        """The same problem for solvers that follow gradients."""
        from problems.nlp.point_to_point import PointToPointNlp  # noqa: PLC0415 (it builds on this module)

        return PointToPointNlp(self)

    def task_verdicts(self, trajectory: Trajectory) -> list[Verdict]:
        """Start and goal."""
        return end_verdicts(self.arm, trajectory, self.start, self.goal)

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Equal steps in each segment, a whole number of them between two samples of the search."""
        steps = self.samples * int(np.ceil((at_least - 1) / (2 * self.samples)))
        return trajectory.times(2 * steps + 1)


def reach_limit(cosines: Matrix) -> Constraint:
    """(13), with absolute values: cos(theta_2) at both ends, (1, 2)."""
    one = np.ones(2)
    formula = "|k_s|, |k_f| <= 1: cos(theta_2) that (1) asks for at start and goal"
    return Constraint("reach", "(13)", "1", cosines, -one, one, ("k_s", "k_f"), one, for_all_t=False, formula=formula)
