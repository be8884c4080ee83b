"""What every table of a scenario file has in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
Pair = tuple[float, float]


class ScenarioError(ValueError):
    """A scenario that cannot be planned; the message is one line: file, key, reason."""


class Section(BaseModel):
    """A table of the file: unknown keys and NaN or infinite numbers are errors, types are not guessed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
