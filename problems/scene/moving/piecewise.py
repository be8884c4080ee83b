"""Piecewise polynomials of time in formulas, without a branch: the sum of what each piece adds."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import casadi as ca

from problems.base.matrix import Matrix, Operand


def piecewise(times: Matrix, breaks: Sequence[Operand], pieces: Sequence[Sequence[Operand]]) -> Matrix:
    """A continuous piecewise polynomial; before its first break and after its last it keeps its value there.

    Args:
        times: at which it is evaluated, (n, 1), s.
        breaks: p + 1, increasing, s.
        pieces: p times coefficients, highest power first; each piece starts its own time at 0.

    Returns:
        (n, 1).
    """
    value: Matrix = pieces[0][-1] + 0.0 * times
    for start, end, coefficients in zip(breaks[:-1], breaks[1:], pieces, strict=True):
        since = ca.fmin(ca.fmax(times - start, 0.0), end - start)
        *high, _ = coefficients
        value = value + since * reduce(lambda sum_, coefficient: sum_ * since + coefficient, high)
    return value
