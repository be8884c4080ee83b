"""Bounds on an expression of one instant proven by the core, where that knows robot and expression.

In a cell of time every joint is a polynomial; the core makes of them Taylor models of the hand and of the expression.
Cells in which these do not settle the bounds are halved. Values are also seen at single times, where they are likely to
be worst.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from problems.base import as_array
from problems.certify.cells import of_values
from problems.certify.settings import DEFAULT_INTERVALS, IntervalSettings
from problems.certify.time_cells import PieceTimes
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, infinite
from problems.limits import ExpressionLimit
from problems.motions import Trajectory


def prove_in_core(
    limit: ExpressionLimit, trajectory: Trajectory, settings: IntervalSettings = DEFAULT_INTERVALS
) -> Verdict | None:
    """The verdict on an expression for all t, as :func:`problems.certify.cells.prove_by_cells` gives it.

    Args:
        limit: the expression and its bounds.
        trajectory: the motion.
        settings: of the proof.

    Returns:
        None where the core does not know robot or expression, or the motion is no number.
    """
    expression = limit.in_core
    if expression is None or not trajectory.is_finite:
        return None

    moments = PieceTimes.at(trajectory, trajectory.times(settings.first_times))
    settled = expression.settle(
        moments.numbers,
        limit.numbers_of_bounds,
        TOLERANCE,
        (settings.initial_cells, settings.most_cells),
        trajectory.duration / (settings.first_times - 1),
    )
    time = np.array([settled.time])
    (worst,) = limit.constraints_at(trajectory.samples(time, limit.robot))
    outcome = of_values(worst, as_array(worst.expression), time)
    if settled.kept is False:
        return replace(outcome, status=CertificateStatus.VIOLATED)
    jumps = trajectory.jumps_below(expression.order)
    if jumps is not None:
        return infinite(outcome, jumps)
    return outcome.undecided_in(settled.cell) if settled.kept is None else outcome
