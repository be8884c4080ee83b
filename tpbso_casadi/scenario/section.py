"""What every table of a scenario file has in common."""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import Field

from tpbso_casadi.scenario.validation import StrictModel

Positive = Annotated[float, Field(gt=0)]
PlanarPoint: TypeAlias = tuple[float, float]
Interval: TypeAlias = tuple[float, float]


class ScenarioError(ValueError):
    """A scenario that cannot be planned; the message is one line: file, key, reason."""


class Section(StrictModel):
    """A table of a scenario file."""
