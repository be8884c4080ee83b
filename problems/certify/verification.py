"""The verdict of every limit on a motion, at its goal too, and the time scale that makes all hold.

How a limit is proven depends on its kind; a kind without a proof of its own is proven by interval arithmetic.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np

from problems.base import FloatArray
from problems.certify.cells import prove_by_cells
from problems.certify.clearance import ClearanceProof, MovingPairs, halves, prove_clearance
from problems.certify.core_clearance import prove_clearance_in_core
from problems.certify.core_expressions import prove_in_core
from problems.certify.settings import DEFAULT_STAY, StaySettings
from problems.certify.torque import TorqueOfAnyFriction, prove_torques, torque_time_scale
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, WorstIs, infinite, verdict
from problems.core import found_core
from problems.library import missing_core
from problems.limits import (
    AT_GOAL,
    SAMPLING_MARGIN,
    CoverClearance,
    CoverLimit,
    ExpressionLimit,
    Limit,
    Proximity,
    TorqueLimit,
    minimum_time_scale,
    peaks_of,
    scaling,
    time_dependent_parts,
)
from problems.motions import Trajectory
from problems.robots import Robot
from problems.scene import Obstacle


def limit_verdicts(
    limits: Iterable[Limit], trajectory: Trajectory, end_accelerations: FloatArray | None = None
) -> list[Verdict]:
    """The verdicts on all limits of a motion, for all t.

    Args:
        limits: to be kept.
        trajectory: the motion.
        end_accelerations: of the joints before and after it, (2, k), rad/s^2; zero if None.
    """
    return [outcome for limit in limits for outcome in _verdicts_of(limit, trajectory, end_accelerations)]


def _verdicts_of(limit: Limit, trajectory: Trajectory, end_accelerations: FloatArray | None) -> list[Verdict]:
    if limit.order is None:
        return prove(limit, trajectory)
    return polynomial_verdicts(limit, limit.order, trajectory, end_accelerations)


def polynomial_verdicts(
    limit: Limit, order: int, trajectory: Trajectory, end_accelerations: FloatArray | None = None
) -> list[Verdict]:
    """The verdicts on a limit of a derivative of the joint angles.

    Where the derivative below it jumps, it is infinite for a moment. The worst values are found at the roots of
    derivatives; that they hold is proven without these, by Bernstein coefficients.
    """
    times = trajectory.extreme_times(order)
    jumps = trajectory.jumps_below(order, end_accelerations)
    verdicts = []
    for constraint in limit.constraints_at(trajectory.samples(times, order=order)):
        outcome = verdict(constraint, times)
        if jumps is not None:
            outcome = infinite(outcome, jumps)
        (lower, upper), slack = constraint.bounds, TOLERANCE * constraint.scales
        cell = trajectory.unproven_cell(order, lower - slack, upper + slack) if outcome.satisfied else None
        verdicts.append(outcome if cell is None else outcome.undecided_in(cell))
    return verdicts


@singledispatch
def prove(limit: Limit, trajectory: Trajectory) -> list[Verdict]:
    """The verdicts on any other limit; register a function for a kind of limit with a sharper proof than intervals."""
    return prove_by_cells(limit, trajectory)


@prove.register
def _(limit: ExpressionLimit, trajectory: Trajectory) -> list[Verdict]:
    """The verdict on an expression of one instant, in the core where that knows it."""
    outcome = prove_in_core(limit, trajectory)
    return _for_want_of_a_core(prove_by_cells(limit, trajectory)) if outcome is None else [outcome]


@prove.register
def _(limit: Proximity, trajectory: Trajectory) -> list[Verdict]:
    """The verdict on a clearance, from a proven lower bound."""
    proof = prove_clearance_in_core(limit, trajectory) or prove_clearance(limit, trajectory)
    return [] if proof is None else [_of_clearance(limit, limit.robot.margin, proof)]


@prove.register
def _(limit: CoverLimit, trajectory: Trajectory) -> list[Verdict]:
    """The verdict on covers, from a proven lower bound."""
    proof = prove_clearance_in_core(limit, trajectory)
    assert proof is not None
    return [_of_clearance(limit, limit.margin, proof)]


def _of_clearance(limit: Limit, bound: float, proof: ClearanceProof) -> Verdict:
    certified = proof.status is CertificateStatus.CERTIFIED
    worst, worst_is = (proof.proven, WorstIs.BOUND) if certified else (proof.smallest, WorstIs.FOUND)
    where = f"{proof.where}, t = {proof.time:.4g} s"
    outcome = Verdict(
        name=limit.name, worst=worst, bound=bound, unit="m", status=proof.status, where=where, worst_is=worst_is,
        time=proof.time,
    )  # fmt: skip
    if proof.status is not CertificateStatus.UNDECIDED:
        return outcome
    if proof.cell is None:
        outcome = replace(outcome, where=f"{where}; too near by a lower bound of the distance, maybe not in truth")
    return outcome.undecided_in(proof.cell)


TORQUE_ORDER = 2  # of the highest derivative on which torques depend


@prove.register
def _(limit: TorqueLimit, trajectory: Trajectory) -> list[Verdict]:
    """The verdict on torques, for the joint that comes nearest to what its motor gives."""
    if found_core() is None:
        return _for_want_of_a_core(prove_by_cells(TorqueOfAnyFriction(limit.robot), trajectory))
    outcome, jumps = prove_torques(limit, trajectory).verdict, trajectory.jumps_below(TORQUE_ORDER)
    return [outcome if jumps is None else infinite(outcome, jumps)]


def _for_want_of_a_core(verdicts: list[Verdict]) -> list[Verdict]:
    """The verdicts by intervals; one that a core might decide says how to get it, where there is none."""
    if found_core() is not None:
        return verdicts
    open_ = CertificateStatus.UNDECIDED
    advice = f"; a sharper proof needs {missing_core()}"
    return [replace(each, where=each.where + advice) if each.status is open_ else each for each in verdicts]


DENSE_SAMPLES = 401  # of a finished motion, for a limit whose peaks have no closed form
ROUNDING_ALLOWANCE = 1e-12  # relative: keeps a time-scaled motion under its limits in floating point


def exact_time_scale(limits: Iterable[Limit], trajectory: Trajectory) -> float:
    """The time scale for all t of a finished motion; 0 without limits that scale with time.

    For a derivative it is exact; for torques the least that is proven, 1e-7 above it at most; for any other limit it
    comes from many samples, and is a little more.
    """
    return float(np.fmax.reduce([time_scale(limit, trajectory) for limit in scaling(limits)], initial=0.0))


@singledispatch
def time_scale(limit: Limit, trajectory: Trajectory) -> float:
    """The time scale of one limit that scales with time; register a function for a kind whose peaks have no samples."""
    if limit.order is not None:
        peaks = peaks_of(limit, trajectory.samples(trajectory.extreme_times(limit.order)))
    else:
        samples = trajectory.samples(trajectory.times(DENSE_SAMPLES), limit.robot_or_none)
        peaks = peaks_of(limit, samples) * (1.0 + SAMPLING_MARGIN)
    return float(minimum_time_scale([limit], [peaks]))


@time_scale.register
def _(limit: TorqueLimit, trajectory: Trajectory) -> float:
    if found_core() is None:
        return time_scale.dispatch(Limit)(limit, trajectory)
    return torque_time_scale(limit, trajectory)


def safe_time_scale(limits: Iterable[Limit], trajectory: Trajectory) -> float:
    """:func:`exact_time_scale` and a little more, so that rounding breaks no limit."""
    return exact_time_scale(limits, trajectory) * (1.0 + ROUNDING_ALLOWANCE)


@dataclass(frozen=True)
class AtGoal:
    """How long a robot that stands at its goal is clear of what moves.

    Attributes:
        clear_until: time in s until which it is proven to be clear from its arrival on; infinite for ever.
        touched: whether something comes too near about then; if not, later times were not examined.
    """

    clear_until: float
    touched: bool


def stay_verdicts(limits: Iterable[Limit], trajectory: Trajectory, seconds: float) -> list[Verdict]:
    """The verdicts on what depends on the time itself, from the end of a motion on, for so many s; none for 0 s."""
    if seconds <= 0.0:
        return []
    standing = _standing(trajectory, seconds)
    return [
        replace(verdict, name=f"{verdict.name}{AT_GOAL}")
        for limit in time_dependent_parts(list(limits))
        for verdict in prove(limit, standing)
    ]


def _standing(trajectory: Trajectory, seconds: float) -> Trajectory:
    """The posture at the end of a motion, for the time after it."""
    end = trajectory.breakpoints[-1:]
    return Trajectory(np.append(end, end + seconds), trajectory.at(end)[None])


def at_goal(
    limits: Iterable[Limit],
    obstacles: Sequence[Obstacle],
    trajectory: Trajectory,
    settings: StaySettings = DEFAULT_STAY,
) -> AtGoal | None:
    """The time until which the end of a motion stays clear; None where no moving obstacle could come near.

    Proven as in :mod:`problems.certify.clearance`: where the distance in the middle of a time cell is larger than what
    the obstacle moves within it.
    """
    parts = time_dependent_parts(list(limits))
    moving = [limit for limit in parts if isinstance(limit, Proximity | CoverClearance)]
    if not moving:
        return None
    arrival, around = trajectory.duration, max(_around(limit.robot) for limit in moving)
    shortest = arrival + settings.resolution  # for obstacles that have come to rest
    quiet = max(shortest, *(obstacle.quiet_after(around) for obstacle in obstacles))
    horizon = min(quiet, arrival + settings.longest)
    theta = trajectory.at(np.array([arrival]))
    until = min(_clear_until(limit, theta, arrival, horizon, settings) for limit in moving)
    if until < horizon:
        return AtGoal(until, touched=True)
    return AtGoal(np.inf if quiet <= horizon else horizon, touched=False)


def _around(robot: Robot) -> float:
    """A bound of the distance from the world's origin of points that keep a distance, and of that distance, m."""
    thickest = max(float(body.radius) for body in robot.bodies.each)
    return float(robot.reach()[1] + np.linalg.norm(robot.base) + thickest + robot.margin)


def _clear_until(
    limit: Proximity | CoverClearance, theta: FloatArray, start: float, end: float, settings: StaySettings
) -> float:
    """The time in s until which a posture (1, dof) is proven to keep a limit, at the latest ``end``."""
    edges, resolution = np.linspace(start, end, settings.initial_cells + 1), settings.resolution
    cells, until, touched = np.column_stack([edges[:-1], edges[1:]]), end, end
    while len(cells):
        nearest, low = _clearances(limit, theta, cells)
        touching = cells[nearest < limit.robot.margin].mean(axis=1)
        cells = cells[low < limit.robot.margin]
        until = min(until, *cells[np.diff(cells, axis=1)[:, 0] < resolution, 0], np.inf)
        first = touched = min([until, touched, *touching])
        cells = halves(cells[(cells[:, 0] < first) & (np.diff(cells, axis=1)[:, 0] >= resolution)])
        cells = cells[np.argsort(cells[:, 0])]
        if len(cells) > settings.most_cells:
            cells, until = cells[: settings.most_cells], min(until, float(cells[settings.most_cells, 0]))
    return float(min(until, touched))  # times after a touch have not been examined


def _clearances(
    limit: Proximity | CoverClearance, theta: FloatArray, cells: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The smallest clearance in the middle of each cell, and a lower bound of it all through, both (n,), m."""
    if isinstance(limit, CoverClearance):
        nearest = limit.clearances(np.repeat(theta, len(cells), axis=0), cells.mean(axis=1))
        return nearest, nearest - limit.obstacles_travel(cells)
    standing = Trajectory(np.array([cells.min(), cells.max()]), theta[None])
    everywhere = np.ones((len(cells), 1), dtype=bool)
    nearest, _, low = MovingPairs.of(limit.robot, limit.pairs, standing).around_middles(cells, everywhere)
    return nearest, low.min(axis=1)
