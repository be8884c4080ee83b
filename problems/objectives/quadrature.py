"""Integrals over the time of a finished motion, by Gauss's rule in cells that are halved until they agree.

All cells that are left are evaluated at once: SciPy's ``cubature``, which settles one after the other, takes twenty
times as long here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from problems.base.matrix import FloatArray

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
RELATIVE_TOLERANCE = 1e-11  # of the integral of |f|, shared among the cells by their lengths
MAX_HALVINGS = 48
MAX_CELLS = 20_000  # at once; more are only left where the integrand is nothing but rounding


def integral(f: Callable[[FloatArray], FloatArray], edges: FloatArray, floor: float) -> float:
    """The integral of f from the first edge to the last; to 1e-9, kinks between the edges included.

    Args:
        f: values (n,) at arguments (n,).
        edges: increasing, (m,): where f may have kinks that need no search.
        floor: what is too small to matter, in the unit of the integral.
    """
    starts, ends = edges[:-1], edges[1:]
    coarse, settled = _gauss(f, starts, ends), 0.0
    allowed = (RELATIVE_TOLERANCE * np.abs(coarse).sum() + floor) / (edges[-1] - edges[0])
    for _ in range(MAX_HALVINGS):
        middles = (starts + ends) / 2.0
        halves = np.array([_gauss(f, starts, middles), _gauss(f, middles, ends)])
        fine = halves.sum(axis=0)
        left = np.abs(fine - coarse) > allowed * (ends - starts)
        settled += float(fine[~left].sum())
        if not left.any() or 2 * left.sum() > MAX_CELLS:
            return settled + float(fine[left].sum())
        coarse = halves[:, left].ravel()
        starts, ends = np.append(starts[left], middles[left]), np.append(middles[left], ends[left])
    return settled + float(coarse.sum())


def _gauss(f: Callable[[FloatArray], FloatArray], starts: FloatArray, ends: FloatArray) -> FloatArray:
    """The integral over each cell, by one rule."""
    half = (ends - starts)[:, None] / 2.0
    points = (starts + ends)[:, None] / 2.0 + half * NODES
    return np.asarray((f(points.ravel()).reshape(points.shape) * half) @ WEIGHTS)
