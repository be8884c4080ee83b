"""From a Python function of one instant to an expression: it is called with symbols, once for each form of it.

Where the function only computes with what it is given, tool position and torques stay symbols of their own: short, and
readable. Where it differentiates them with respect to joint angles, they have to be written out in these; that is so
where the short form, with what its symbols stand for put in, is another one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.evaluation.tape import UnsupportedOperation
from problems.motions.expressions.quantities import quantity_named
from problems.motions.expressions.sample_function import SampleFunction
from problems.motions.expressions.text import written
from problems.motions.expressions.view import MotionView
from problems.motions.samples import Samples
from problems.robots.robot import Robot

BASIC = ("q", "speed", "acceleration", "jerk", "time", "duration")
MISUSED = "truth value"  # what CasADi says of ``if`` on symbols
OUTSIDE, LENGTH = "out of bounds", re.compile(r"supplied length of (\d+)")  # what it says of an index
NO_NUMBER = "nan"  # what Python's own functions make of symbols
OF_SYMBOLS = "say ca.sin in place of math.sin, and so on: only CasADi's functions take symbols"
PLACE = re.compile(r"^\.\.\./\S+:\d+: ")  # in CasADi's own source
KNOWN = [name for name, part in vars(MotionView).items() if isinstance(part, property)]

Stated = Callable[[MotionView], Any]


def traced(stated: Stated, robot: Robot, called: str) -> SampleFunction:
    """The function of one instant that a Python function states.

    Args:
        stated: a function of a :class:`MotionView`.
        robot: that moves.
        called: what messages call it, such as ``constraint 'table'``.

    Raises:
        InvalidProblem: it raises, or what it gives is no scalar or vector of CasADi's symbols.
    """
    short, long = _Symbols(robot), _WrittenOut(robot)
    expressions = [_column(_called(stated, MotionView(robot, each), called), called) for each in (short, long)]
    brief, full = _text(expressions[0], short.known, called), _text(expressions[1], long.known, called)
    return SampleFunction(brief if _inserted(expressions[0], short.known, long, called) == full else full)


@dataclass
class _Symbols:
    """A symbol for every quantity that is asked for."""

    robot: Robot
    known: dict[str, ca.SX] = field(default_factory=dict)

    def __call__(self, name: str) -> ca.SX:
        if name not in self.known:
            self.known[name] = ca.SX.sym(name, quantity_named(name).width(self.robot))
        return self.known[name]


class _WrittenOut:
    """Every quantity as an expression of angles, derivatives and times."""

    def __init__(self, robot: Robot) -> None:
        self.known = {name: ca.SX.sym(name, quantity_named(name).width(robot)) for name in BASIC}
        derivatives = tuple(self.known[name].T for name in BASIC[:4])
        times, duration = self.known["time"], self.known["duration"]
        self._samples = Samples(robot=robot, derivatives=derivatives, duration=duration, times=times)

    def __call__(self, name: str) -> ca.SX:
        return self.known[name] if name in self.known else ca.SX(quantity_named(name).of(self._samples).T)


def _called(stated: Stated, view: MotionView, called: str) -> Any:
    try:
        return stated(view)
    except InvalidProblem as error:
        raise InvalidProblem(called, f"{error.field}: {error.reason}") from error
    except Exception as error:
        reason = PLACE.sub("", " ".join(str(error).split()))
        if OUTSIDE in reason:
            raise InvalidProblem(called, _outside(reason, view.robot)) from error
        advice = "say ca.if_else(condition, a, b) in place of if" if MISUSED in reason else f"m has {', '.join(KNOWN)}"
        raise InvalidProblem(called, f"raised {type(error).__name__}: {reason[:150]}; {advice}") from error


def _outside(reason: str, robot: Robot) -> str:
    """What is said of an index that is too large or too small."""
    length = LENGTH.search(reason)
    known = f"{robot.dof} joints, {robot.dim} coordinates of a point" if length is None else f"{length[1]} in all"
    return f"an index is out of range: {known}, counted from 0"


def _column(value: Any, called: str) -> ca.SX:
    """What a function gave as a dense column."""
    try:
        expression = ca.vertcat(*value) if isinstance(value, list | tuple) else value
        expression = ca.SX(expression if isinstance(expression, ca.SX) else ca.DM(expression))
    except Exception as error:
        raise InvalidProblem(
            called, f"gives {type(value).__name__}, where a number or vector of CasADi's SX is needed"
        ) from error
    if not expression.is_vector() or expression.numel() == 0:
        rows, columns = expression.shape
        raise InvalidProblem(called, f"gives a matrix of {rows} x {columns}, where a number or vector is needed")
    return ca.densify(ca.vec(expression))


def _text(expression: ca.SX, symbols: Mapping[str, ca.SX], called: str) -> str:
    own = {symbol.element_hash() for part in symbols.values() for symbol in ca.vertsplit(part)}
    foreign = [symbol for symbol in ca.symvar(expression) if symbol.element_hash() not in own]
    if foreign:
        raise InvalidProblem(called, f"depends on {foreign[0]}, which is nothing of the motion")
    try:
        return written(expression, symbols)
    except UnsupportedOperation as error:
        advice = f"; {OF_SYMBOLS}" if str(error).endswith(NO_NUMBER) else ""
        raise InvalidProblem(called, f"{error}{advice}") from error


def _inserted(expression: ca.SX, symbols: Mapping[str, ca.SX], long: _WrittenOut, called: str) -> str:
    """The short form with what its symbols stand for put in: the long form, unless something was differentiated."""
    function = ca.Function("short", list(symbols.values()), [expression])
    inserted = function.call([long(name) for name in symbols])[0]
    return _text(ca.densify(ca.SX(inserted)), long.known, called)


def random_states(robot: Robot, count: int) -> FloatArray:
    """States (count, 4 dof + 1) to look at an expression in: angles, three derivatives, and a time; always the same."""
    rng, shape = np.random.default_rng(0), (count, 4 * robot.dof + 1)
    return np.asarray(rng.uniform(0.1, 1.5, shape) * rng.choice([-1.0, 1.0], shape))
