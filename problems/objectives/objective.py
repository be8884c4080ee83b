"""Objectives: contributions of the duration, of samples and of steps; their bounds; weighted sums."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from math import isfinite
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, Matrix, Parametric, as_array, total
from problems.motions import Samples, Trajectory
from problems.objectives.integrals import Integrand
from problems.robots import Robot

UNKNOWN_UPPER_BOUND = 1e12  # for objectives that state none; no motion within limits comes near it


@dataclass(frozen=True, eq=False, kw_only=True)
class DirectMoves:
    """Moves from a posture to each of several others, and bounds of all motions between them.

    Attributes:
        robot: that moves.
        start: (dof,), rad.
        goals: (n, dof), rad.
        durations: that no motion takes less than, (n,), s.
    """

    robot: Robot
    start: FloatArray
    goals: FloatArray
    durations: FloatArray

    @property
    def rotations(self) -> FloatArray:
        """The least rotation of all joints together, (n,), rad."""
        return np.asarray(np.abs(self.goals - self.start).sum(axis=1))

    @property
    def distances(self) -> FloatArray:
        """The least distance that the tool moves, (n,), m."""
        tool = as_array(self.robot.tool.position(ca.DM(np.vstack([self.start, self.goals]))))
        return np.asarray(np.linalg.norm(tool[1:] - tool[0], axis=1))


@dataclass(frozen=True, kw_only=True)
class MotionBounds:
    """Upper bounds over all motions of a search.

    Attributes:
        duration: s.
        rotation: sum over the joints of how far each turns in all, rad.
        radius: the farthest that the tool can be from the base, m.
    """

    duration: float
    rotation: float
    radius: float


class Objective(ABC):
    """A function to minimise: ``terminal(T) + sum over samples of at + sum over steps of between``.

    A subclass defines at least one of the three. The value is the same whether samples are evaluated one by one, as
    compiled code does, or all at once. What a plan reports is :meth:`of_motion`.

    What is a property here may be a plain attribute of a subclass.
    """

    @property
    @abstractmethod
    def name(self) -> str:
        """The name in a scenario file."""

    @property
    @abstractmethod
    def symbol(self) -> str:
        """The symbol in the paper."""

    @property
    def equation(self) -> str:
        """The equation in the paper; a dash where it has none."""
        return "-"

    @property
    @abstractmethod
    def unit(self) -> str:
        """The unit of its value."""

    @property
    def is_time_dependent(self) -> bool:
        """Whether it depends on the duration of a motion; if not, a nonlinear program leaves time out."""
        return True

    @property
    def sooner_is_better(self) -> bool:
        """Whether less time is never worse: a finished motion is then run as fast as its limits allow."""
        return False

    @property
    def asks_for_least_time(self) -> bool:
        """Whether it depends on the time along a path, and the least that the limits allow is the best."""
        return self.is_time_dependent and self.sooner_is_better

    @property
    def is_duration(self) -> bool:
        """Whether it is the duration itself, so that a bound of the duration is one of the objective."""
        return False

    @property
    def needs_masses(self) -> bool:
        """Whether it is defined only for robots whose masses are known."""
        return False

    @property
    def is_integral(self) -> bool:
        """Whether it weighs samples by time, so that nonlinear programs take Gauss's points in each piece."""
        return False

    @property
    def norm(self) -> float:
        """The exponent that weighs joints that turn far against others where structured starts choose postures.

        The p of a p-norm, infinite where the farthest alone counts.
        """
        return np.inf

    @property
    def program_steps(self) -> int | None:
        """The number of time steps a segment that a nonlinear program needs; None for those of the search."""
        return None

    @property
    def terms(self) -> tuple[tuple[float, Objective], ...]:
        """The weights and objectives of which it is a sum; itself alone by default."""
        return ((1.0, self),)

    @property
    def chooses_duration(self) -> bool:
        """Whether a motion may have to be run more slowly than it could: its duration is then one more variable."""
        return self.is_time_dependent and not self.sooner_is_better

    def check(self, robot: Robot) -> None:
        """Check that it is defined for a robot.

        Raises:
            InvalidProblem: it needs masses, and they are not known.
        """
        if self.needs_masses and robot.rigid_chain is None:
            raise InvalidProblem("objective", f"{self.name!r} needs masses, and those of this robot are not known")

    def terminal(self, duration: Matrix) -> Matrix:
        """The part that depends on the duration in s alone; scalar."""
        return ca.DM(0.0)

    def at(self, samples: Samples) -> Matrix | None:
        """The contribution of each sample, (n, m); integrals multiply by ``samples.weights``."""
        return None

    def between(self, before: Samples, after: Samples) -> Matrix | None:
        """The contribution of each step from one sample to the next, (n - 1, m); 0 where nothing moves."""
        return None

    def value(self, samples: Samples) -> Matrix:
        """The objective of a motion, scalar, in ``unit``."""
        value, part = self.terminal(samples.duration), self.of_samples(samples)
        value = value if part is None else value + part
        steps = self.between(*samples.steps) if samples.count > 1 else None
        return value if steps is None else value + total(steps)

    def of_samples(self, samples: Samples) -> Matrix | None:
        """The contribution of all samples together, scalar: of an integral at the points of the better rule."""
        part = self.at(samples.for_integrals if self.is_integral else samples)
        return None if part is None else total(part)

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """The value of a finished motion: exact where a subclass knows how, else over samples at times (n,) in s."""
        return float(self.value(trajectory.samples(times, robot)))

    def upper_bound(self, bounds: MotionBounds) -> float:
        """An upper bound over all motions within the bounds; a huge number where none is known."""
        return UNKNOWN_UPPER_BOUND

    @property
    def direct_is_least(self) -> bool:
        """Whether no motion beats one in the least duration in which no joint turns back."""
        return False

    @property
    def polish_suffices(self) -> bool:
        """Whether convex programs from a few paths end as near the best motion as a search of a population does."""
        return True

    def lower_bound(self, moves: DirectMoves) -> FloatArray:
        """A lower bound over all motions of each of several moves, (n,); minus infinity where none is known."""
        return np.full_like(moves.durations, -np.inf)

    def integrand(self, samples: Samples) -> Integrand | None:
        """The integrand: a motion's value is ``terminal(T)`` and the integral of this over time.

        None where that is not known to say all, as by default where :attr:`is_integral` is not set.

        Args:
            samples: with everything that is known of an instant.
        """
        if not self.is_integral or self.between(samples, samples) is not None:
            return None
        return Integrand(rest=self.at(replace(samples, weights=ca.DM.ones(samples.count, 1))))

    def size(self, robot: Robot) -> float:
        """A value of the usual size, by which a nonlinear program divides; 1 by default."""
        return 1.0

    def slack_count(self, robot: Robot, steps: int) -> int:
        """The number of slack variables of its smooth form over so many steps."""
        return 0

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        """The objective without kinks, for a nonlinear program; slack (steps, dof) or empty."""
        return self.value(samples)

    def slack_values(self, theta: FloatArray) -> FloatArray:
        """The slacks of a motion with angles (n, dof), in the order of the columns of ``slack``."""
        return np.empty(0)

    def slack_rows(self, samples: Samples, slack: Matrix) -> list[tuple[str, str, Matrix]]:
        """Expressions that must not be negative, which define the slacks: name, formula, (steps, dof)."""
        return []


USUAL_SHARE = 0.1  # of the limits of each derivative, in a motion of the usual size


def usual_state(robot: Robot) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The middle of the joint ranges, and a tenth of speed and acceleration limits: (dof,) each."""
    speed, acceleration, *_ = robot.limits.by_order
    middle = [sum(bounds) / 2.0 for bounds in robot.limits.position or ((0.0, 0.0),) * robot.dof]
    return np.array(middle), USUAL_SHARE * speed, USUAL_SHARE * acceleration


@dataclass(frozen=True)
class WeightedSum(Parametric, Objective):
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
        return tuple(zip(self.weights, self.objectives, strict=True))

    @property
    def name(self) -> str:
        """The name, such as ``time + 0.02 energy``."""
        return self._written([objective.name for objective in self.objectives])

    @property
    def symbol(self) -> str:
        return self._written([objective.symbol for objective in self.objectives])

    def _written(self, words: list[str]) -> str:
        each = zip(self.weights, words, strict=True)
        return " + ".join(word if weight == 1.0 else f"{weight:g} {word}" for weight, word in each)

    @property
    def is_time_dependent(self) -> bool:
        return any(objective.is_time_dependent for objective in self.objectives)

    @property
    def sooner_is_better(self) -> bool:
        return all(objective.sooner_is_better for objective in self.objectives)

    @property
    def needs_masses(self) -> bool:
        return any(objective.needs_masses for objective in self.objectives)

    @property
    def is_integral(self) -> bool:
        return any(objective.is_integral for objective in self.objectives)

    @property
    def norm(self) -> float:
        """The least of the terms' exponents: displacements add up if they do so for any of them."""
        return min(objective.norm for objective in self.objectives)

    @property
    def program_steps(self) -> int | None:
        steps = [objective.program_steps for objective in self.objectives]
        return None if None in steps else max(count for count in steps if count is not None)

    def check(self, robot: Robot) -> None:
        for objective in self.objectives:
            objective.check(robot)

    def terminal(self, duration: Matrix) -> Matrix:
        return sum((weight * objective.terminal(duration) for weight, objective in self.terms), ca.DM(0.0))

    def at(self, samples: Samples) -> Matrix | None:
        return _added([(weight, objective.at(samples)) for weight, objective in self.terms])

    def of_samples(self, samples: Samples) -> Matrix | None:
        """The sum of the terms' contributions of samples, each at the points that suit it."""
        return _added([(weight, objective.of_samples(samples)) for weight, objective in self.terms])

    def between(self, before: Samples, after: Samples) -> Matrix | None:
        return _added([(weight, objective.between(before, after)) for weight, objective in self.terms])

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        return sum(weight * objective.of_motion(trajectory, robot, times) for weight, objective in self.terms)

    def upper_bound(self, bounds: MotionBounds) -> float:
        return sum(weight * objective.upper_bound(bounds) for weight, objective in self.terms)

    @property
    def direct_is_least(self) -> bool:
        return all(objective.direct_is_least for objective in self.objectives)

    @property
    def polish_suffices(self) -> bool:
        return all(objective.polish_suffices for objective in self.objectives)

    def lower_bound(self, moves: DirectMoves) -> FloatArray:
        return np.asarray(np.sum([weight * objective.lower_bound(moves) for weight, objective in self.terms], axis=0))

    def integrand(self, samples: Samples) -> Integrand | None:
        parts = [(weight, objective.integrand(samples)) for weight, objective in self.terms]
        return None if any(part is None for _, part in parts) else Integrand.sum_of(
            [part.weighted(weight) for weight, part in parts if part is not None]
        )  # fmt: skip

    def size(self, robot: Robot) -> float:
        return sum(weight * objective.size(robot) for weight, objective in self.terms)

    def slack_count(self, robot: Robot, steps: int) -> int:
        return sum(objective.slack_count(robot, steps) for objective in self.objectives)

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        each = zip(self.terms, self._slacks(samples, slack), strict=True)
        return sum((weight * objective.smooth(samples, own) for (weight, objective), own in each), ca.DM(0.0))

    def slack_values(self, theta: FloatArray) -> FloatArray:
        dof = theta.shape[1]
        found = [objective.slack_values(theta).reshape(-1, dof, order="F") for objective in self.objectives]
        return np.concatenate(found).ravel(order="F")

    def slack_rows(self, samples: Samples, slack: Matrix) -> list[tuple[str, str, Matrix]]:
        each = zip(self.objectives, self._slacks(samples, slack), strict=True)
        return [row for objective, own in each for row in objective.slack_rows(samples, own)]

    def _slacks(self, samples: Samples, slack: Matrix) -> list[Matrix]:
        """The slacks of each of the terms, (rows, dof)."""
        robot = samples.moving
        rows = [objective.slack_count(robot, samples.count - 1) // robot.dof for objective in self.objectives]
        return list(ca.vertsplit(slack, np.cumsum([0, *rows]).tolist()))


def _added(parts: list[tuple[float, Matrix | None]]) -> Matrix | None:
    """The sum of contributions (n, m) with their own numbers m of columns: (n, 1); None where there are none."""
    found = [weight * ca.sum2(part) for weight, part in parts if part is not None]
    return sum(found[1:], found[0]) if found else None
