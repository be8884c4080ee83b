"""The [simulation] table: what happens while ``python -m tpbso_casadi.simulate`` plans again and again."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from tpbso_casadi.scenario.section import MOST_EVALUATIONS, NotNegative, Number, Positive, Section
from tpbso_casadi.scenario.tasks.places import AnyPlaces
from tpbso_casadi.scenario.validation import NestedError

MOST_TICKS = 100_000
WHOLE = 1e-9  # so much short of a whole number of periods is rounding
Corner = Annotated[list[Number], Field(min_length=2, max_length=3)]


class SimulationSection(Section):
    """[simulation]; other commands do not read it.

    Attributes:
        seconds: that are simulated.
        every: time between two replans, which is also how long each may take, s.
        goals: places visited one after the other, cyclically; the task's goal and start if left out.
        changes_every: mean time between two changes of the course of an obstacle that has a velocity, s; none if left
            out.
        course_rate: no two velocities of an obstacle differ by more, m/s. The planner counts on it, and on no more.
        region: lower and upper corner of a box, m, which obstacles that have a velocity do not leave: they turn around.
        evaluations: of each replan.
        within: or its time, s.
    """

    seconds: Positive = 10.0
    every: Positive = 0.1
    goals: AnyPlaces | None = None
    changes_every: Positive | None = None
    course_rate: NotNegative = 0.0
    region: Annotated[list[Corner], Field(min_length=2, max_length=2)] | None = None
    evaluations: int = Field(default=1500, gt=0, le=MOST_EVALUATIONS)
    within: Positive | None = None

    @model_validator(mode="after")
    def _of_one_size(self) -> Self:
        if self.every > self.seconds:
            raise NestedError(f"every: {self.every:g} s is more than the {self.seconds:g} s that are simulated")
        if self.seconds / self.every > MOST_TICKS:
            raise NestedError(f"every: {self.seconds / self.every:.0f} replans; at most {MOST_TICKS} are simulated")
        if self.changes_every is not None and not self.course_rate:
            raise NestedError("course_rate: missing key; changes_every needs to know how large a change may be")
        if self.region is not None:
            self._check_region(*self.region)
        return self

    def _check_region(self, lower: list[float], upper: list[float]) -> None:
        if len(lower) != len(upper):
            raise NestedError(f"region: corners of {len(lower)} and of {len(upper)} coordinates")
        if not all(low < high for low, high in zip(lower, upper, strict=True)):
            raise NestedError("region: the first corner has to be below the second one in every coordinate")

    @property
    def ticks(self) -> int:
        """How often the planner is asked, the last time at most one period before the end."""
        return int(self.seconds / self.every + WHOLE)
