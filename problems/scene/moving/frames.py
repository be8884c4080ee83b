"""Where a frame is at many times, in numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray


@dataclass(frozen=True, eq=False)
class Frames:
    """A frame at n times.

    Attributes:
        origins: (n, dim), m.
        axes: its axes, one in each column, (n, dim, dim); None where it does not turn.
    """

    origins: FloatArray
    axes: FloatArray | None = None

    def at(self, rows: NDArray[np.intp]) -> Frames:
        """At some of the times."""
        return Frames(self.origins[rows], None if self.axes is None else self.axes[rows])

    def seen(self, points: FloatArray) -> FloatArray:
        """Points (n, dim), one for each time, as seen from the frame then, (n, dim), m."""
        away = points - self.origins
        return away if self.axes is None else np.asarray(np.einsum("ni,nij->nj", away, self.axes))

    def placed(self, points: FloatArray) -> FloatArray:
        """Points (m, dim) of the frame as seen from outside, (n, m, dim), m."""
        turned = points[None] if self.axes is None else np.einsum("mj,nij->nmi", points, self.axes)
        return np.asarray(turned + self.origins[:, None])
