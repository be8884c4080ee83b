"""A motion at samples, and what an expression of one instant may speak of."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, Matrix, as_array
from problems.robots import Robot, SpatialArm

SAMPLED_ORDERS = 4  # angles, speeds, accelerations, jerks


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """The motion of a robot at n times; symbolic in a model, numeric when a trajectory is verified.

    One row or many: an evaluated candidate is written with one row at a time, a nonlinear program with all of them.

    Attributes:
        robot: that moves; None where only joint angles are needed.
        derivatives: joint angles and their derivatives with respect to time, each (n, dof); rad, rad/s, rad/s^2, ...;
            None for those that are not needed.
        duration: of the whole motion, scalar, s.
        times: of the rows, (n, 1), s.
        weights: of a quadrature rule over time, (n, 1), s: an integral is the sum of weights times values.
        known_positions: those of the robot's frames where they are known already; computed where None.
        quadrature: the same motion at the points of a better rule for integrals, where there is one.
        before_jumps: the same motion just before accelerations jump, where they may.
    """

    robot: Robot | None
    derivatives: tuple[Matrix | None, ...]
    duration: Matrix
    times: Matrix | None = None
    weights: Matrix | None = None
    known_positions: tuple[Matrix, ...] | None = None
    quadrature: Samples | None = None
    before_jumps: Samples | None = None

    @classmethod
    def symbolic(cls, robot: Robot, orders: int) -> Samples:
        """One sample in which angles, so many orders of derivatives, duration, time and weight are symbols."""
        return cls(
            robot=robot,
            derivatives=tuple(ca.SX.sym(f"derivative_{n}", 1, robot.dof) for n in range(orders)),
            duration=ca.SX.sym("duration"),
            times=ca.SX.sym("time"),
            weights=ca.SX.sym("weight"),
        )

    def derivative(self, order: int) -> Matrix:
        """The joint angles (order 0) or one of their derivatives, (n, dof).

        Raises:
            ValueError: these samples were made without it.
        """
        found = self.derivatives[order]
        if found is None:
            raise ValueError(f"these samples were made without derivative {order} of the joint angles")
        return found

    def derivative_or_zero(self, order: int) -> Matrix:
        """The derivative, or zeros where samples were made without it: for torques, which may not need angles.

        They do not where there is no gravity, nor those of an arm whose joints only slide.
        """
        found = self.derivatives[order]
        return ca.DM.zeros(self.count, self.moving.dof) if found is None else found

    @property
    def theta(self) -> Matrix:
        """Joint angles, (n, dof), rad."""
        return self.derivative(0)

    @property
    def speed(self) -> Matrix:
        """Joint speeds, (n, dof), rad/s."""
        return self.derivative(1)

    @property
    def acceleration(self) -> Matrix:
        """Joint accelerations, (n, dof), rad/s^2."""
        return self.derivative(2)

    @property
    def moving(self) -> Robot:
        """The robot, which has to be known.

        Raises:
            ValueError: these samples have none.
        """
        if self.robot is None:
            raise ValueError("these samples are of joints alone, without a robot")
        return self.robot

    @cached_property
    def positions(self) -> tuple[Matrix, ...]:
        """Positions of the robot's frames, base first and tool last, each (n, dim), m."""
        if self.known_positions is not None:
            return self.known_positions
        return self.moving.positions(self.theta)

    @cached_property
    def torque(self) -> Matrix:
        """Torques of the joints' motors, (n, dof), N m; only of a robot whose masses are known."""
        return self.moving.dynamics.torques(*(self.derivative_or_zero(order) for order in range(3)))

    @property
    def tool(self) -> Matrix:
        """Positions of the tool, (n, dim), m."""
        return self.positions[-1]

    @property
    def count(self) -> int:
        """The number n of samples."""
        return next((int(matrix.shape[0]) for matrix in self.derivatives if matrix is not None), 1)

    def rows(self, chosen: slice) -> Samples:
        """Some of the samples."""
        return Samples(
            robot=self.robot,
            derivatives=tuple(None if matrix is None else matrix[chosen, :] for matrix in self.derivatives),
            duration=self.duration,
            times=None if self.times is None else self.times[chosen, :],
            weights=None if self.weights is None else self.weights[chosen, :],
            known_positions=None if self.robot is None else tuple(matrix[chosen, :] for matrix in self.positions),
        )

    @property
    def for_integrals(self) -> Samples:
        """The points at which integrals over time are taken: those of the better rule, where there is one."""
        return self if self.quadrature is None else self.quadrature

    @property
    def is_finished(self) -> bool:
        """Whether these are numbers of a motion of which everything is known."""
        known = (*self.derivatives, self.duration, self.times)
        return len(self.derivatives) == SAMPLED_ORDERS and all(isinstance(part, ca.DM) for part in known)

    @property
    def states(self) -> FloatArray:
        """Angles, three derivatives and time of a finished motion, (n, 4 dof + 1)."""
        assert self.times is not None
        return as_array(ca.horzcat(*map(self.derivative, range(SAMPLED_ORDERS)), self.times))

    @property
    def both_sides(self) -> Samples:
        """The samples followed by the rows before jumps, for what depends on accelerations; (n + m, dof)."""
        jumps = self.before_jumps
        if jumps is None:
            return self
        rows = (ca.vertcat(self.derivative(n), jumps.derivative(n)) for n in range(len(self.derivatives)))
        return Samples(robot=self.robot, derivatives=tuple(rows), duration=self.duration)

    @cached_property
    def steps(self) -> tuple[Samples, Samples]:
        """The samples before and after each step: all but the last, all but the first."""
        return self.rows(slice(None, -1)), self.rows(slice(1, None))


def increasing_choice(costs: FloatArray) -> list[int]:
    """Indices i_1 <= i_2 <= ... with the smallest sum of ``costs[n, i_n]``, by dynamic programming.

    Args:
        costs: of each thing at each time, (things, times).
    """
    index = np.arange(costs.shape[1])
    best, origins = costs[0], []
    for cost in costs[1:]:
        least = np.minimum.accumulate(best)
        origins.append(np.maximum.accumulate(np.where(best == least, index, 0)))
        best = least + cost
    chosen = [int(np.argmin(best))]
    for origin in reversed(origins):
        chosen.append(int(origin[chosen[-1]]))
    return chosen[::-1]


FRAME = re.compile(r"frame_(\d{1,4})")
ROTATION_ENTRIES = 9


@dataclass(frozen=True)
class Quantity:
    """A quantity that an expression may use.

    Attributes:
        width: how many numbers it is for a robot.
        of: its values, (n, width), or (1, width) where it is the same at all times.
    """

    width: Callable[[Robot], int]
    of: Callable[[Samples], Matrix]


def quantity_named(name: str) -> Quantity:
    """The quantity of a name.

    Raises:
        KeyError: there is none.
    """
    frame = FRAME.fullmatch(name)
    return QUANTITIES[name] if frame is None else _frame(int(frame[1]))


def _derivative(order: int) -> Quantity:
    def of(samples: Samples) -> Matrix:
        if order >= len(samples.derivatives):
            raise InvalidProblem("constraints", f"this family of motions has no derivative {order} to sample")
        return samples.derivative(order)

    return Quantity(lambda robot: robot.dof, of)


def _frame(number: int) -> Quantity:
    return Quantity(
        lambda robot: robot.dim if number < robot.position_count else 0, lambda samples: samples.positions[number]
    )


def _tool_velocity(samples: Samples) -> Matrix:
    """The velocity of the tool, (n, dim), m/s."""
    robot = samples.moving
    theta, speed = ca.SX.sym("theta", robot.dof), ca.SX.sym("speed", robot.dof)
    velocity = ca.jtimes(robot.tool.position(theta.T).T, theta, speed)
    of_state = ca.Function("tool_velocity", [theta, speed], [velocity], {"allow_free": True, "cse": True})
    return of_state(samples.theta.T, samples.speed.T).T


def _rotation(samples: Samples) -> Matrix:
    """The rotation matrix of the tool row by row, (n, 9)."""
    robot = samples.moving
    assert isinstance(robot, SpatialArm)
    return robot.tool.pose(samples.theta)[1]


def _times(samples: Samples) -> Matrix:
    if samples.times is None:
        raise InvalidProblem("constraints", "this family of motions does not say the time of its samples")
    return samples.times


QUANTITIES: dict[str, Quantity] = {
    "q": _derivative(0),
    "speed": _derivative(1),
    "acceleration": _derivative(2),
    "jerk": _derivative(3),
    "torque": Quantity(lambda robot: 0 if robot.rigid_chain is None else robot.dof, lambda samples: samples.torque),
    "tool": Quantity(lambda robot: robot.dim, lambda samples: samples.tool),
    "tool_velocity": Quantity(lambda robot: robot.dim, _tool_velocity),
    "rotation": Quantity(lambda robot: ROTATION_ENTRIES if isinstance(robot, SpatialArm) else 0, _rotation),
    "time": Quantity(lambda robot: 1, _times),
    "duration": Quantity(lambda robot: 1, lambda samples: ca.vec(samples.duration)),
}


MISSING = {  # why a robot has none of it
    "torque": "torques need masses, and those of this robot are not known",
    "rotation": "the rotation of the tool is known of robots in space only",
}


@dataclass(frozen=True, eq=False)
class MotionView:
    """One instant of a motion, as CasADi's symbols: columns that are indexed from 0.

    ``m.tool[1]`` is the height y of the tool of an arm in the plane; ``ca.sumsqr(m.speed)`` the sum of the squares of
    all joint speeds.

    Args:
        robot: that moves.
        value: the column (width, 1) of a quantity by its name.
    """

    robot: Robot
    value: Callable[[str], ca.SX] = field(repr=False)

    @property
    def q(self) -> ca.SX:
        """Joint positions, (dof, 1), rad (m where a joint slides)."""
        return self._of("q")

    @property
    def theta(self) -> ca.SX:
        """Joint positions by the paper's name, (dof, 1), rad."""
        return self.q

    @property
    def speed(self) -> ca.SX:
        """Joint speeds, (dof, 1), rad/s."""
        return self._of("speed")

    @property
    def acceleration(self) -> ca.SX:
        """Joint accelerations, (dof, 1), rad/s^2."""
        return self._of("acceleration")

    @property
    def jerk(self) -> ca.SX:
        """Joint jerks, (dof, 1), rad/s^3."""
        return self._of("jerk")

    @property
    def torque(self) -> ca.SX:
        """Torques of the motors, (dof, 1), N m; of robots whose masses are known."""
        return self._of("torque")

    @property
    def tool(self) -> ca.SX:
        """Position of the tool, (2, 1) or (3, 1), m."""
        return self._of("tool")

    @property
    def tool_velocity(self) -> ca.SX:
        """Velocity of the tool, (2, 1) or (3, 1), m/s."""
        return self._of("tool_velocity")

    @property
    def rotation(self) -> ca.SX:
        """Rotation matrix (3, 3) of the tool of a robot in space; ``m.rotation[:, 2]`` is its z axis."""
        return ca.reshape(self._of("rotation"), 3, 3).T

    @property
    def positions(self) -> tuple[ca.SX, ...]:
        """Positions of the frames, base first and tool last, each (2, 1) or (3, 1), m."""
        return tuple(self._of(f"frame_{number}") for number in range(self.robot.position_count))

    @property
    def time(self) -> ca.SX:
        """The time since the start, s."""
        return self._of("time")

    @property
    def duration(self) -> ca.SX:
        """The duration of the whole motion, s."""
        return self._of("duration")

    def _of(self, name: str) -> ca.SX:
        if not quantity_named(name).width(self.robot):
            raise InvalidProblem(name, MISSING.get(name, "the robot has none"))
        return self.value(name)
