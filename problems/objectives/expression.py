"""Objectives that are expressions of the user's."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, Matrix, Parametric, as_array
from problems.motions import SAMPLED_ORDERS, SampleFunction, Samples, Trajectory
from problems.objectives.integrals import Integrand, integral
from problems.objectives.objective import Objective, usual_state
from problems.robots import Robot

FLOOR = 1e-15  # in the unit of the integral: what nobody notices
NAMED_SYMBOL = "J"


@dataclass(frozen=True)
class ExpressionObjective(Parametric, Objective):
    """The objective ``integral of rate dt from 0 to T + terminal(T)``.

    Args:
        stated_name: as in a scenario file.
        stated_unit: of its value.
        rate: scalar function of one instant; None where nothing is integrated.
        of_duration: scalar function of the duration T alone; None where there is none.

    Raises:
        InvalidProblem: neither is stated, one is no scalar, or the second depends on more than the duration.
    """

    stated_name: str
    stated_unit: str
    rate: SampleFunction | None
    of_duration: SampleFunction | None = None

    def __post_init__(self) -> None:
        parts = [part for part in (self.rate, self.of_duration) if part is not None]
        if not parts:
            raise InvalidProblem("objectives", f"{self.name!r}: nothing is minimised")
        if any(part.width != 1 for part in parts):
            raise InvalidProblem("objectives", f"{self.name!r}: one number is needed; say ca.sumsqr(...) of a vector")
        if self.of_duration is not None and any(name != "duration" for name, _ in self.of_duration.entries):
            raise InvalidProblem("objectives", f"{self.name!r}: terminal may depend on m.duration alone")

    @property
    def name(self) -> str:
        return self.stated_name

    @property
    def symbol(self) -> str:
        return NAMED_SYMBOL

    @property
    def unit(self) -> str:
        return self.stated_unit

    @property
    def needs_masses(self) -> bool:
        return self.rate is not None and self.rate.uses("torque")

    @property
    def is_integral(self) -> bool:
        return self.rate is not None

    def check(self, robot: Robot) -> None:
        super().check(robot)
        if self.rate is None:
            return
        self.rate.check(robot, "objectives", self.name)
        if self.rate.uses("jerk") and robot.limits.jerk is None:
            reason = "jerk is infinite where accelerations jump; state the max_jerk of the robot"
            raise InvalidProblem("objectives", f"{self.name!r}: {reason}")

    def terminal(self, duration: Matrix) -> Matrix:
        if self.of_duration is None:
            return ca.DM(0.0)
        return self.of_duration.at(Samples(robot=None, derivatives=(), duration=duration))

    def at(self, samples: Samples) -> Matrix | None:
        if self.rate is None:
            return None
        assert samples.weights is not None
        return samples.weights * self.rate.at(samples, smooth=isinstance(samples.weights, ca.SX))

    def integrand(self, samples: Samples) -> Integrand:
        return Integrand(rest=None if self.rate is None else self.rate.at(samples, smooth=True))

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        part = self.of_samples(samples)
        return self.terminal(samples.duration) + (ca.DM(0.0) if part is None else part)

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """The value, to 1e-9 of its size, kinks included."""
        ends = float(self.terminal(ca.DM(trajectory.duration)))
        if self.rate is None:
            return ends
        rate = self.rate.of_state(robot)

        def at(moments: FloatArray) -> FloatArray:
            state = [trajectory.at(moments, order).T for order in range(SAMPLED_ORDERS)]
            return as_array(rate(np.vstack([*state, moments]), trajectory.duration)).ravel()

        return ends + integral(at, trajectory.extreme_times(0), FLOOR)

    def size(self, robot: Robot) -> float:
        """The value over a second at a tenth of the limits, amid the joint ranges; 1 where that is 0."""
        state = np.concatenate([*usual_state(robot), np.zeros(robot.dof), [0.5]])[None]
        size = abs(float(self.terminal(ca.DM(1.0))))
        if self.rate is not None:
            size += abs(float(self.rate.probed(robot, state)[0, 0]))
        return size if np.isfinite(size) and size > 0.0 else 1.0
