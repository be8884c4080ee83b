"""Whether a stored value is what a recomputation gives; a contradiction is one line that names the key."""

from __future__ import annotations

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.storage.plain import plain

TOLERANCE = 1e-9  # between a stored and a recomputed number, relative to the largest of its column
TIMING_TOLERANCE = 1e-6  # where a timing is computed again, which another machine does not to the last digits


class Contradiction(ValueError):
    """A stored value that contradicts its recomputation; the message is one line: ``key.path: reason``."""


def agree(key: str, stored: float | None, computed: float, scale: float = 0.0, tolerance: float = TOLERANCE) -> None:
    """A number is the computed one, to the tolerance of it or of a scale; none where that is not finite.

    Raises:
        Contradiction: it is not.
    """
    if stored is None or not np.isfinite(computed):
        agrees = stored is None and not np.isfinite(computed)
    else:
        agrees = bool(abs(stored - computed) <= tolerance * max(abs(computed), scale))
    if not agrees:
        raise Contradiction(f"{key}: {stored!r} is stored, {computed!r} is computed")


def close(key: str, stored: FloatArray, computed: FloatArray) -> None:
    """Arrays of the motion that a search vector stands for.

    Raises:
        Contradiction: they are not.
    """
    if computed.shape != stored.shape or not np.allclose(stored, computed, rtol=TOLERANCE, atol=TOLERANCE):
        raise Contradiction(f"{key}: not the motion of solution.variables")


def same(key: str, stored: object, computed: object) -> None:
    """A value is the computed one.

    Raises:
        Contradiction: it is not.
    """
    if stored != computed:
        raise Contradiction(f"{key}: {plain(stored)!r} is stored, {plain(computed)!r} is computed")
