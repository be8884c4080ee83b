"""A motion and moments of it, as the core reads them for a proof by cells of time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.motions import Trajectory

STATUS = {1: True, 0: False, -1: None}  # of the core: proven, broken, not known


@dataclass(frozen=True, eq=False)
class MotionNumbers:
    """Polynomials, and moments that are looked at first.

    Attributes:
        breaks: where pieces begin and end, (pieces + 1,), s.
        coefficients: (order, pieces, k), the highest power first.
        pieces: of moments, (n,).
        offsets: of moments from where their pieces begin, (n,), s.
    """

    breaks: FloatArray
    coefficients: FloatArray
    pieces: NDArray[np.int32]
    offsets: FloatArray

    @classmethod
    def of(cls, trajectory: Trajectory, pieces: NDArray[np.intp], offsets: FloatArray) -> Self:
        """The numbers of a motion and of moments (n,)."""
        breaks, coefficients, seconds = (
            np.ascontiguousarray(part, dtype=np.float64)
            for part in (trajectory.breakpoints, trajectory.coefficients, offsets)
        )
        return cls(breaks, coefficients, np.ascontiguousarray(pieces, dtype=np.int32), seconds)

    @property
    def of_motion(self) -> tuple[int, int, int, int]:
        """Numbers of pieces and of coefficients, and addresses."""
        order, count, _ = self.coefficients.shape
        return count, order, self.breaks.ctypes.data, self.coefficients.ctypes.data

    @property
    def of_moments(self) -> tuple[int, int, int]:
        """The number of moments, and addresses."""
        return self.pieces.size, self.pieces.ctypes.data, self.offsets.ctypes.data
