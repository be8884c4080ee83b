"""A function of one instant of a motion, of which everything derives: rows of samples, proofs, formulas."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix
from problems.evaluation.tape import Symbolic, rebuilt
from problems.motions.expressions.quantities import quantity_named
from problems.motions.expressions.text import Entry, read
from problems.motions.expressions.view import MISSING
from problems.motions.samples import Samples
from problems.motions.trajectory import SAMPLED_ORDERS
from problems.robots.robot import Robot

LONGEST_FORMULA = 60  # operations that are written out for a reader
ROOT_OFFSET = 1e-20  # added under roots while searching: keeps the gradient of a length finite where it is 0


@dataclass(frozen=True)
class SampleFunction:
    """A function of one instant, the same for every robot that has what it depends on.

    Args:
        text: as in :mod:`problems.motions.expressions.text`; must be valid.
    """

    text: str

    @cached_property
    def _read(self) -> tuple[tuple[Entry, ...], ca.Function]:
        return read(self.text)

    @cached_property
    def _smooth(self) -> ca.Function:
        """The same with gradients that are finite where a length is zero."""
        return rebuilt(self._read[1], _SmoothRoots())

    @property
    def entries(self) -> tuple[Entry, ...]:
        """What it depends on: names of quantities, and which of their numbers."""
        return self._read[0]

    @property
    def width(self) -> int:
        """How many values it has."""
        return int(self._read[1].size1_out(0))

    @property
    def operations(self) -> int:
        """How many it takes."""
        return self.text.count("(")

    def uses(self, *names: str) -> bool:
        """Whether it depends on any of some quantities."""
        return any(name in names for name, _ in self.entries)

    @cached_property
    def is_root(self) -> bool:
        """Whether every value is a square root."""
        function = self._read[1]
        symbols = ca.SX.sym("x", len(self.entries))
        return all(value.is_op(ca.OP_SQRT) for value in ca.vertsplit(function(symbols)))

    @cached_property
    def formula(self) -> str:
        """What it says, for a reader."""
        if self.operations > LONGEST_FORMULA:
            names = sorted({name for name, _ in self.entries})
            return f"({self.operations} operations on {', '.join(names)})"
        symbols = [ca.SX.sym(f"{name}_{index}") for name, index in self.entries]
        values = self._read[1](ca.vertcat(*symbols) if symbols else ca.SX(0, 1))
        return ", ".join(str(value) for value in ca.vertsplit(values))

    def check(self, robot: Robot, field: str, name: str) -> None:
        """That a robot has what it depends on.

        Raises:
            InvalidProblem: of the field, naming whose expression it is.
        """
        for quantity, index in self.entries:
            width = quantity_named(quantity).width(robot)
            if width == 0:
                raise InvalidProblem(field, f"{name!r}: {MISSING.get(quantity, f'this robot has no {quantity}')}")
            if index >= width:
                raise InvalidProblem(field, f"{name!r}: {quantity}[{index}] of {width}")

    def at(self, samples: Samples, smooth: bool = False) -> Matrix:
        """Its values at n samples, (n, width).

        Args:
            samples: of a motion.
            smooth: with gradients that are finite where a length is zero; other values by 1e-10 at most.
        """
        function, count = self._smooth if smooth else self._read[1], samples.count
        if not self.entries:
            return ca.repmat(function(ca.DM(0, 1)).T, count, 1)
        known = {name: quantity_named(name).of(samples) for name, _ in self.entries}
        numbers = [known[name][:, index] for name, index in self.entries]
        columns = ca.horzcat(*(part if part.shape[0] == count else ca.repmat(part, count, 1) for part in numbers))
        return function(columns.T).T

    def of_state(self, robot: Robot, duration: float) -> ca.Function:
        """Its values (width,) as a function of angles and three derivatives (4 dof,) and, last, the time in s."""
        state = ca.SX.sym("state", SAMPLED_ORDERS * robot.dof + 1)
        *derivatives, time = ca.vertsplit(state, [*range(0, SAMPLED_ORDERS * robot.dof + 1, robot.dof), state.numel()])
        rows = tuple(part.T for part in derivatives)
        now = Samples(robot=robot, derivatives=rows, duration=ca.SX(duration), times=time)
        return ca.Function("value", [state], [ca.densify(self.at(now).T)], {"cse": True})

    def probed(self, robot: Robot, states: FloatArray, duration: float = 1.0) -> FloatArray:
        """Its values (n, width) in states (n, 4 dof + 1): angles, three derivatives, time in s."""
        return np.asarray(self.of_state(robot, duration)(states.T)).T


class _SmoothRoots(Symbolic):
    """Symbols in which every root has something under it."""

    def unary(self, name: str, a: ca.SX) -> ca.SX:
        return ca.sqrt(a + ROOT_OFFSET) if name == "sqrt" else super().unary(name, a)
