"""The interface of objectives: the value over samples, and a smooth form of it for nonlinear programs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, total
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

UNKNOWN_UPPER_BOUND = 1e12  # for objectives that state none; no motion within limits comes near it


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
        """As in a scenario file."""

    @property
    @abstractmethod
    def symbol(self) -> str:
        """As in the paper."""

    @property
    def equation(self) -> str:
        """Where the paper states it; a dash where it does not."""
        return "-"

    @property
    @abstractmethod
    def unit(self) -> str:
        """Of its value."""

    @property
    def timed(self) -> bool:
        """Whether it depends on how long a motion takes; if not, a nonlinear program leaves time out."""
        return True

    @property
    def sooner_is_better(self) -> bool:
        """Whether less time is never worse: a finished motion is then run as fast as its limits allow."""
        return False

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
        """How joints that turn far weigh against joints that turn little, where structured starts choose postures.

        The p of a p-norm, infinite where the farthest alone counts.
        """
        return np.inf

    @property
    def program_steps(self) -> int | None:
        """Time steps a segment with which a nonlinear program gets by; None for those of the search."""
        return None

    @property
    def terms(self) -> tuple[tuple[float, Objective], ...]:
        """What it is a sum of: weights and objectives; itself alone by default."""
        return ((1.0, self),)

    @property
    def chooses_duration(self) -> bool:
        """Whether a motion may have to be run more slowly than it could: its duration is then one more variable."""
        return self.timed and not self.sooner_is_better

    def check(self, robot: Robot) -> None:
        """That it is defined for a robot.

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
        value = self.terminal(samples.duration)
        for part in (self.at(samples), self.between(*samples.steps) if samples.count > 1 else None):
            value = value if part is None else value + total(part)
        return value

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """The value of a finished motion: exact where a subclass knows how, else over samples at times (n,) in s."""
        return float(self.value(trajectory.samples(times, robot)))

    def upper_bound(self, bounds: MotionBounds) -> float:
        """An upper bound over all motions within the bounds; a huge number where none is known."""
        return UNKNOWN_UPPER_BOUND

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
