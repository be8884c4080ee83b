"""What limits every motion of an arm: speed (11), acceleration (12), joint range, clearance from obstacles (14).

One function builds the constraints from samples of a motion. The metaheuristics' penalty, the nonlinear program
and the verification of a finished trajectory all call it, each with its own samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, columns, differences, largest, repeated
from problems.limits.constraint import Constraint, PenaltyKind
from problems.motions.samples import Samples
from problems.robots.planar import PlanarArm
from problems.scene.ellipse import Ellipse

STEP_SHARE = 0.9  # the longest step of a joint between two samples, as a share of the smallest obstacle's width


def motion_constraints(
    arm: PlanarArm, obstacles: Sequence[Ellipse], samples: Samples, margin: float = 0.0
) -> list[Constraint]:
    """All constraints on a whole motion.

    Args:
        arm: whose limits hold.
        obstacles: to keep clear of.
        samples: of the motion, in order of time.
        margin: to keep at the samples for what lies between them, a share of the reach and of each joint's range.
    """
    built = [speed_limit(arm, samples), acceleration_limit(arm, samples)]
    if arm.joint_limits is not None:
        built.append(joint_range(arm, samples, margin))
    if obstacles:
        x, y = arm.joint_positions(samples.theta)
        built += obstacle_clearance(arm, obstacles, x, y, margin * arm.reach()[1])
    return built


def speed_limit(arm: PlanarArm, samples: Samples) -> Constraint:
    """(11), (21): |dtheta_i(t)| <= dtheta_max."""
    formula = "|dtheta_i(t_j)| <= max_speed_i, at every sample t_j"
    return _symmetric("speed", "(11), (16)", "rad/s", samples.speed, arm.max_speed, formula)


def acceleration_limit(arm: PlanarArm, samples: Samples) -> Constraint:
    """(12), (22): |d2theta_i(t)| <= d2theta_max."""
    formula = "|d2theta_i(t_j)| <= max_acceleration_i, at every sample t_j"
    return _symmetric("acceleration", "(12), (17)", "rad/s^2", samples.acceleration, arm.max_acceleration, formula)


def _symmetric(
    name: str, equation: str, unit: str, values: Matrix, bounds: Sequence[float], formula: str
) -> Constraint:
    limit = np.array(bounds)
    labels = _joint_labels(len(bounds))
    return Constraint(
        name, equation, unit, values, -limit, limit, labels, limit, weight=PenaltyKind.MAGNITUDE, formula=formula
    )


def joint_range(arm: PlanarArm, samples: Samples, margin: float = 0.0) -> Constraint:
    """Joint position limits (ours; the paper has none), kept by a share ``margin`` of the range."""
    assert arm.joint_limits is not None
    lowest, highest = np.array(arm.joint_limits).T
    spare = margin * (highest - lowest)
    lowest, highest = lowest + spare, highest - spare
    labels = _joint_labels(arm.links)
    formula = "lowest_i <= theta_i(t_j) <= highest_i, at every sample t_j"
    one = np.ones(arm.links)
    return Constraint("joint range", "-", "rad", samples.theta, lowest, highest, labels, one, formula=formula)


def obstacle_clearance(
    arm: PlanarArm, obstacles: Sequence[Ellipse], x: Matrix, y: Matrix, margin: float
) -> list[Constraint]:
    """(14): no link meets an obstacle at a sample, no joint crosses one between two samples.

    Links at the samples alone would let the tip jump a corner from one sample to the next, which the travel length
    rewards. The straight line that each joint draws between two samples closes the gap: together with the links
    it bounds the area that a link sweeps.

    Args:
        arm: the arm.
        obstacles: to keep clear of.
        x: of base, joints and tip at n samples, (n, k + 1), m.
        y: likewise.
        margin: the clearance to keep, m.
    """
    pairs = reachable_pairs(arm, obstacles, margin)
    if not pairs:
        return []
    labels = [str(pair) for pair in pairs]
    formula = (
        "clearance(link i at t_j, obstacle) >= margin: the link's point nearest to the ellipse, in its unit circle"
    )
    built = [_clearance("clearance", link_clearances(pairs, x, y), pairs, labels, margin, formula)]
    if x.shape[0] > 1:
        swept = ca.horzcat(
            *(
                pair.obstacle.segment_clearance(
                    *(ca.horzcat(values[:-1, pair.link], values[1:, pair.link]) for values in (x, y))
                )
                for pair in pairs
            )
        )
        ends = [f"end of {label}" for label in labels]
        formula = "clearance(line from a link's end at t_j to the same at t_j+1, obstacle) >= margin"
        built.append(_clearance("swept clearance", swept, pairs, ends, margin, formula))
    return built


@dataclass(frozen=True)
class Pair:
    """A link (1..k) and an obstacle (number 1, 2, ...) that it may touch."""

    link: int
    number: int
    obstacle: Ellipse

    def __str__(self) -> str:
        return f"link {self.link}, obstacle {self.number}"


def reachable_pairs(arm: PlanarArm, obstacles: Sequence[Ellipse], margin: float = 0.0) -> list[Pair]:
    """All links and obstacles but those that can never come within ``margin`` m of each other."""
    return [
        Pair(link, number, obstacle)
        for number, obstacle in enumerate(obstacles, start=1)
        for link in range(1, arm.links + 1)
        if arm.reach(link)[1] >= obstacle.distance_to_base() - margin
    ]


def link_clearances(pairs: Sequence[Pair], x: Matrix, y: Matrix) -> Matrix:
    """Clearance in m of each pair (columns) in each of n postures: (n, pairs); joint positions (n, k + 1)."""
    ends = [slice(pair.link - 1, pair.link + 1) for pair in pairs]
    return ca.horzcat(
        *(pair.obstacle.segment_clearance(x[:, link], y[:, link]) for pair, link in zip(pairs, ends, strict=True))
    )


def _clearance(
    name: str, expression: Matrix, pairs: Sequence[Pair], labels: Sequence[str], margin: float, formula: str
) -> Constraint:
    lower, upper, one = np.full(len(pairs), margin), np.full(len(pairs), np.inf), np.ones(len(pairs))

    def log_distances(clearance: Matrix) -> Matrix:
        each = zip(pairs, columns(clearance), strict=True)
        return ca.horzcat(*(pair.obstacle.log_distance(column) for pair, column in each))

    return Constraint(
        name,
        "(14), (18)",
        "m",
        expression,
        lower,
        upper,
        tuple(labels),
        one,
        transform=log_distances,
        formula=formula,
    )


def step_limit(arm: PlanarArm, obstacles: Sequence[Ellipse], samples: Samples) -> Constraint:
    """No joint moves so far between two samples that a link could leap over an obstacle.

    What a link sweeps in a step shorter than an obstacle's width cannot hold that obstacle: with the links at the
    samples and the lines between them clear, all of it is, but for the curvature of the motion.
    """
    x, y = arm.joint_positions(samples.theta)
    dx, dy = differences(x[:, 1:]), differences(y[:, 1:])
    width = 2.0 * min(min(obstacle.semi_axes) for obstacle in obstacles)
    bound = np.full(arm.links, (STEP_SHARE * width) ** 2)
    labels = tuple(f"end of link {link}" for link in range(1, arm.links + 1))
    endless = np.full(arm.links, -np.inf)
    formula = "|end of link i at t_j+1 - at t_j|^2 <= (0.9 x the smallest obstacle's width)^2"
    return Constraint("step", "-", "m^2", dx * dx + dy * dy, endless, bound, labels, bound, formula=formula)


def _joint_labels(joints: int) -> tuple[str, ...]:
    return tuple(f"joint {joint}" for joint in range(1, joints + 1))


def minimum_time_scale(arm: PlanarArm, speed: Matrix, acceleration: Matrix) -> Matrix:
    """The smallest factor by which time must be multiplied for the limits to hold, exactly.

    Args:
        arm: whose limits.
        speed: samples or extremes, (n, k), rad/s.
        acceleration: samples or extremes, (n, k), rad/s^2.

    Returns:
        max(max |v| / v_max, sqrt(max |a| / a_max)), a scalar; below 1 when time can be saved.
    """
    by_speed = _largest_ratio(speed, np.array(arm.max_speed))
    by_acceleration = _largest_ratio(acceleration, np.array(arm.max_acceleration))
    return ca.fmax(by_speed, ca.sqrt(by_acceleration))


def _largest_ratio(values: Matrix, limits: FloatArray) -> Matrix:
    if np.ptp(limits) == 0.0:
        return largest(ca.fabs(values)) / limits[0]
    return largest(ca.fabs(values) / repeated(limits, values.shape[0]))
