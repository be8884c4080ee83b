"""Half-spaces: a table that ends nowhere, a floor, a wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.scene.solids.solid import Solid
from problems.scene.solids.surface import Surface

DRAWN = 2.0  # m: the side of the square that is drawn of its face


@dataclass(frozen=True, kw_only=True)
class HalfSpace(Solid):
    """Everything on one side of a plane: below its centre, a point of the plane, as seen along its own z axis."""

    @property
    def width(self) -> float:
        """Without end."""
        return float(np.inf)

    @property
    def extent(self) -> float:
        """Without end."""
        return float(np.inf)

    @property
    def half_extents(self) -> FloatArray:
        """Half the size of the smallest box around what is drawn of it, (3,), m."""
        return np.asarray(np.abs(self.axes[:, :2]).sum(axis=1) * DRAWN / 2.0)

    def point_clearance(self, points: Matrix) -> Matrix:
        """Signed distances, exact."""
        return self.local(points)[2]

    def surface(self) -> Surface:
        """A square of its face around its centre."""
        corners = np.array([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]])
        return self.placed(DRAWN * corners), [[0, 1, 2, 3]]
