"""The interface of the [[obstacles]] tables of a scenario file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from problems import Obstacle
from tpbso_casadi.scenario.section import Section, Word


class ObstacleSection(Section):
    """One of the [[obstacles]]: the interface of every shape."""

    shape: Word

    @classmethod
    def variant(cls, table: Mapping[str, Any]) -> type[ObstacleSection]:
        """The section that reads a table of this shape; this one, where the shape is the same in plane and space."""
        return cls

    @property
    def corners(self) -> int:
        """How many corners its clearance is computed from; 1 for what has none."""
        return 1

    def build(self) -> Obstacle:
        """The obstacle itself.

        Raises:
            InvalidProblem: it cannot be.
        """
        raise NotImplementedError
