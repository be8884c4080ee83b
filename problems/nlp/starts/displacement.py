"""How an objective weighs the angles through which the joints turn.

Without obstacles nothing else couples the joints: the least time is that of the joint with the largest displacement,
the rotation adds all displacements. Only here do the starts depend on the objective.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.objectives.objective import Objective


@dataclass(frozen=True, kw_only=True)
class Displacement:
    """How the displacements of the joints count.

    Attributes:
        longest: the largest of them counts, measured in time; otherwise their sum, in rad.
        exponent: p of the cost |step|^p of a joint's step between two knots of a path.
    """

    longest: bool
    exponent: float


LONGEST = Displacement(longest=True, exponent=3.0)
SUM = Displacement(longest=False, exponent=1.5)


def displacement_of(objective: Objective) -> Displacement:
    """How the displacements count for an objective."""
    return LONGEST if np.isinf(objective.norm) else SUM
