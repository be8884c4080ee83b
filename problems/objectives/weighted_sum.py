"""Weighted sums of objectives."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.arguments import Statement
from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.objectives.objective import MotionBounds, Objective
from problems.robots.robot import Robot


@dataclass(frozen=True)
class WeightedSum(Statement, Objective):
    """The sum of weights times objectives: a cost without a unit, each weight in one over its objective's unit.

    Weights are numbers of the statement: another choice of them compiles nothing.

    Args:
        weights: positive.
        objectives: as many, none twice.

    Raises:
        InvalidProblem: no objective, one twice, not as many weights, or a weight that is not a positive number.
    """

    numbers: ClassVar[tuple[str, ...]] = ("weights",)
    unit: ClassVar[str] = "1"

    weights: tuple[float, ...]
    objectives: tuple[Objective, ...]

    def __post_init__(self) -> None:
        names = [objective.name for objective in self.objectives]
        if not names:
            raise InvalidProblem("objective", "a weighted sum needs at least one objective")
        if len(self.weights) != len(names):
            raise InvalidProblem("objective", f"{len(names)} weights are needed, not {len(self.weights)}")
        if len(set(names)) != len(names):
            raise InvalidProblem("objective", f"the same objective twice: {', '.join(names)}")
        for name, weight in zip(names, self.weights, strict=True):
            if not (weight > 0.0 and isfinite(weight)):
                raise InvalidProblem(f"objective.{name}", f"{weight} is not a positive number")

    @property
    def terms(self) -> tuple[tuple[float, Objective], ...]:
        """The weights with their objectives."""
        return tuple(zip(self.weights, self.objectives, strict=True))

    @property
    def name(self) -> str:
        """Such as ``time + 0.02 energy``."""
        return self._written([objective.name for objective in self.objectives])

    @property
    def symbol(self) -> str:
        """The same with symbols."""
        return self._written([objective.symbol for objective in self.objectives])

    def _written(self, words: list[str]) -> str:
        each = zip(self.weights, words, strict=True)
        return " + ".join(word if weight == 1.0 else f"{weight:g} {word}" for weight, word in each)

    @property
    def timed(self) -> bool:
        """Whether any of them is."""
        return any(objective.timed for objective in self.objectives)

    @property
    def sooner_is_better(self) -> bool:
        """Whether that holds for each of them."""
        return all(objective.sooner_is_better for objective in self.objectives)

    @property
    def needs_masses(self) -> bool:
        """Whether any of them does."""
        return any(objective.needs_masses for objective in self.objectives)

    @property
    def is_integral(self) -> bool:
        """Whether any of them is."""
        return any(objective.is_integral for objective in self.objectives)

    @property
    def norm(self) -> float:
        """The least of theirs: displacements add up if they do so for any of them."""
        return min(objective.norm for objective in self.objectives)

    @property
    def program_steps(self) -> int | None:
        """The most that any of them needs."""
        steps = [objective.program_steps for objective in self.objectives]
        return None if None in steps else max(count for count in steps if count is not None)

    def check(self, robot: Robot) -> None:
        """That all of them are defined for a robot."""
        for objective in self.objectives:
            objective.check(robot)

    def terminal(self, duration: Matrix) -> Matrix:
        """Of all of them."""
        return sum((weight * objective.terminal(duration) for weight, objective in self.terms), ca.DM(0.0))

    def at(self, samples: Samples) -> Matrix | None:
        """Of those that have a contribution of each sample."""
        return _added([(weight, objective.at(samples)) for weight, objective in self.terms])

    def between(self, before: Samples, after: Samples) -> Matrix | None:
        """Of those that have a contribution of each step."""
        return _added([(weight, objective.between(before, after)) for weight, objective in self.terms])

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """As exact as each of them."""
        return sum(weight * objective.of_motion(trajectory, robot, times) for weight, objective in self.terms)

    def upper_bound(self, bounds: MotionBounds) -> float:
        """The sum of theirs."""
        return sum(weight * objective.upper_bound(bounds) for weight, objective in self.terms)

    def size(self, robot: Robot) -> float:
        """The sum of theirs."""
        return sum(weight * objective.size(robot) for weight, objective in self.terms)

    def slack_count(self, robot: Robot, steps: int) -> int:
        """Those of all."""
        return sum(objective.slack_count(robot, steps) for objective in self.objectives)

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        """The sum of their smooth forms."""
        each = zip(self.terms, self._slacks(samples, slack), strict=True)
        return sum((weight * objective.smooth(samples, own) for (weight, objective), own in each), ca.DM(0.0))

    def slack_values(self, theta: FloatArray) -> FloatArray:
        """Those of all, below each other for each joint."""
        dof = theta.shape[1]
        found = [objective.slack_values(theta).reshape(-1, dof, order="F") for objective in self.objectives]
        return np.concatenate(found).ravel(order="F")

    def slack_rows(self, samples: Samples, slack: Matrix) -> list[tuple[str, str, Matrix]]:
        """Those of all."""
        each = zip(self.objectives, self._slacks(samples, slack), strict=True)
        return [row for objective, own in each for row in objective.slack_rows(samples, own)]

    def _slacks(self, samples: Samples, slack: Matrix) -> list[Matrix]:
        """The slacks of each of them, (rows, dof)."""
        robot = samples.moving
        rows = [objective.slack_count(robot, samples.count - 1) // robot.dof for objective in self.objectives]
        return list(ca.vertsplit(slack, np.cumsum([0, *rows]).tolist()))


def _added(parts: list[tuple[float, Matrix | None]]) -> Matrix | None:
    """The sum of contributions (n, m) with their own numbers m of columns: (n, 1); None where there are none."""
    found = [weight * ca.sum2(part) for weight, part in parts if part is not None]
    return sum(found[1:], found[0]) if found else None
