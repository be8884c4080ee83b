"""Expressions of one instant in the compiled core: their values, and proofs of bounds on them for every time."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import cos, sin
from typing import Literal, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Operand
from problems.core.motion_numbers import STATUS, MotionNumbers
from problems.evaluation import UnsupportedOperation
from problems.library import loaded_core
from problems.motions import SampleFunction
from problems.robots import PlanarArm, Robot, SpatialArm, Transform

OPERATIONS = (  # in the order of the core
    *("add", "sub", "mul", "div", "fmin", "fmax", "atan2", "neg", "sq", "twice", "inv", "sqrt", "fabs"),
    *("sin", "cos", "asin", "acos", "atan", "exp", "log"),
)  # fmt: skip
Entry: TypeAlias = tuple[str, int]  # a quantity's name and which of its numbers
Point: TypeAlias = tuple[int, tuple[Operand, Operand, Operand]]  # how many joints move it; where on the last, m
KnownArm: TypeAlias = SpatialArm | PlanarArm
Register: TypeAlias = tuple[Literal["constant", "source", "result"], int]
JOINTS, TIME, DURATION, PLACE, VELOCITY, ROTATION = range(6)  # quantities of the core
BY_ORDER = ("q", "speed", "acceleration", "jerk")
ORIGIN, UP = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
ORDER_OF = {"speed": 1, "tool_velocity": 1, "acceleration": 2, "jerk": 3}


class Settled(NamedTuple):
    """The answer to whether bounds are kept at every time.

    Attributes:
        kept: whether they are; None where that is not known.
        time: s, of the value that is nearest to its bound, or farthest beyond, of all that were seen.
        cell: start and end, s, of a cell of time in which it is not known; None where there is none.
    """

    kept: bool | None
    time: float
    cell: tuple[float, float] | None


@dataclass
class _Tape:
    """An interpreter that writes down operations, for registers that hold constants, what is known, and results."""

    constants: list[float] = field(default_factory=list)
    instructions: list[tuple[int, Register, Register]] = field(default_factory=list)

    def constant(self, value: float) -> Register:
        self.constants.append(float(value))
        return "constant", len(self.constants) - 1

    def unary(self, name: str, a: Register) -> Register:
        return self.binary(name, a, a)

    def binary(self, name: str, a: Register, b: Register) -> Register:
        if name not in OPERATIONS:
            raise UnsupportedOperation(name)
        self.instructions.append((OPERATIONS.index(name), a, b))
        return "result", len(self.instructions) - 1


@dataclass(frozen=True, eq=False)
class _Arm:
    """The places of an arm.

    Attributes:
        base: pose of the first joint's frame, unmoved, but for its own offset.
        joints: of each, its pose on the body that it is on, axis, whether it turns, and the number of that body.
        carrier: number of the body that carries the tool.
        tool: its pose on that.
        frames: those of ``positions`` but the tool.
    """

    base: Transform
    joints: Sequence[tuple[Transform, Sequence[float], bool, int]]
    carrier: int
    tool: Transform
    frames: Sequence[Point]

    @classmethod
    def of(cls, robot: KnownArm) -> _Arm:
        """The places of a robot."""
        return cls._in_space(robot) if isinstance(robot, SpatialArm) else cls._in_plane(robot)

    @classmethod
    def _in_space(cls, robot: SpatialArm) -> _Arm:
        chain = robot.chain
        each = zip(chain.joints, chain.parents, strict=True)
        joints = [(joint.pose, joint.axis, joint.turns, parent) for joint, parent in each]
        spheres = [(sphere.link, sphere.center) for sphere in robot.spheres]
        tips = [(tip.body, point) for tip in chain.tips for point in tip.points]
        frames = [*((n, ORIGIN) for n in range(robot.dof + 1)), *spheres, *tips]
        return cls(robot.base_frame, joints, chain.carrier, robot.tool.frame, frames)

    @classmethod
    def _in_plane(cls, robot: PlanarArm) -> _Arm:
        lengths, (along, left) = robot.link_lengths, robot.tool_offset
        (x, y), cosine, sine = robot.base, cos(robot.base_angle), sin(robot.base_angle)
        base = Transform(((cosine, -sine, 0.0), (sine, cosine, 0.0), UP), (x, y, 0.0))
        offsets = enumerate((0.0, *lengths[:-1]))
        joints = [(Transform(translation=(length, 0.0, 0.0)), UP, True, before) for before, length in offsets]
        tool = Transform(translation=(lengths[-1] + along, left, 0.0))
        ends: list[Point] = [(number, (length, 0.0, 0.0)) for number, length in enumerate(lengths, start=1)]
        return cls(base, joints, len(joints), tool, [(0, ORIGIN), *ends])


class CoreExpression:
    """An expression of an arm, in the core.

    Args:
        library: the compiled core.
        robot: that moves.
        function: the expression.

    Raises:
        UnsupportedOperation: it holds an operation that the core does not have.
    """

    def __init__(self, library: ctypes.CDLL, robot: KnownArm, function: SampleFunction) -> None:
        self._library, self._robot, self._function = library, robot, function
        counts, numbers = _described(_Arm.of(robot), function)
        self._expression = ctypes.c_void_p(library.core_expression(counts.ctypes.data, numbers.ctypes.data))
        weakref.finalize(self, library.core_forget_expression, self._expression)

    @classmethod
    def of(cls, robot: Robot, function: SampleFunction) -> CoreExpression | None:
        """The expression of a robot, where the core is there and knows both."""
        library, is_known = loaded_core().library, type(robot) in (SpatialArm, PlanarArm)
        if library is None or not is_known or function.uses("torque"):
            return None
        try:
            return cls(library, cast(KnownArm, robot), function)
        except UnsupportedOperation:
            return None

    def __reduce__(self) -> tuple[object, ...]:
        return CoreExpression.of, (self._robot, self._function)

    @property
    def order(self) -> int:
        """The highest derivative of the joints that it depends on."""
        return max((ORDER_OF.get(name, 0) for name, _ in self._function.entries), default=0)

    def values(self, states: FloatArray, duration: float) -> FloatArray:
        """The values (n, m) in states (n, 4 dof + 1): angles, three derivatives, time in s; of a motion so long."""
        states = np.ascontiguousarray(states, dtype=np.float64)
        found = np.empty((len(states), self._function.width))
        self._library.core_expression_values(
            self._expression, len(states), states.ctypes.data, duration, found.ctypes.data
        )
        return found

    def slopes(self, states: FloatArray, duration: float) -> FloatArray:
        """Derivatives of the values by angles, velocities and accelerations: (n, m, 3, dof)."""
        states = np.ascontiguousarray(states, dtype=np.float64)
        found = np.zeros((len(states), self._function.width, 3, self._robot.dof))
        self._library.core_expression_slopes(
            self._expression, len(states), states.ctypes.data, duration, found.ctypes.data
        )
        return found

    def settle(
        self,
        motion: MotionNumbers,
        bounds: tuple[FloatArray, FloatArray, FloatArray],
        tolerance: float,
        cells: tuple[int, int],
        step: float,
    ) -> Settled:
        """Whether bounds are kept at every time of a motion.

        Args:
            motion: with moments that are looked at first.
            bounds: lower and upper ones, infinite where there is none, and the usual sizes of values, (m,) each.
            tolerance: of the usual sizes, by which a bound may be exceeded.
            cells: of time, at least and at most.
            step: s, before and behind the value nearest to its bound within which that is followed to its peak.
        """
        lower, upper, scale = (np.ascontiguousarray(part, dtype=np.float64) for part in bounds)
        found = np.empty(4)
        status = self._library.core_prove_expression(
            self._expression, *motion.of_motion, lower.ctypes.data, upper.ctypes.data, scale.ctypes.data,
            1.0 + tolerance, *cells, step, *motion.of_moments, found.ctypes.data,
        )  # fmt: skip
        _, time, start, end = found.tolist()
        return Settled(STATUS[status], time, (start, end) if status < 0 else None)


def _described(arm: _Arm, function: SampleFunction) -> tuple[NDArray[np.int64], FloatArray]:
    """Counts and numbers, in the order in which the core reads them."""
    tape, places = _Tape(), _Places(arm)
    outputs = function.interpreted([("source", number) for number in range(len(function.entries))], tape)
    sources = [places.source(entry) for entry in function.entries]
    offsets = {"constant": 0, "source": len(tape.constants), "result": len(tape.constants) + len(sources)}

    def place(register: Register) -> int:
        return offsets[register[0]] + register[1]

    dof = len(arm.joints)
    orders = 1 + max([number // dof for quantity, number in sources if quantity == JOINTS], default=0)
    moves = any(quantity == VELOCITY for quantity, _ in sources)
    has_hand = any(quantity in (PLACE, VELOCITY, ROTATION) for quantity, _ in sources)
    kinds = [int(part) for _, _, turns, parent in arm.joints for part in (turns, parent)]
    counts = [
        *(dof, max(orders, 2 if moves else 1), moves, has_hand, *kinds),
        *(len(places.known), *(body for body, _ in places.known), len(tape.constants)),
        *(len(sources), *(part for source in sources for part in source), len(tape.instructions)),
        *(part for code, one, two in tape.instructions for part in (code, place(one), place(two))),
        *(len(outputs), *map(place, outputs)),
    ]
    poses = [part for pose, axis, *_ in arm.joints for part in (*_of_pose(pose), *axis)]
    points = [part for _, point in places.known for part in point]
    numbers = [*_of_pose(arm.base), *poses, *_of_pose(arm.tool)[:9], *map(float, points), *tape.constants]
    return np.array(counts, dtype=np.int64), np.array(numbers, dtype=np.float64)


def _of_pose(pose: Transform) -> list[float]:
    return [float(part) for part in (*(part for row in pose.rotation for part in row), *pose.translation)]


class _Places:
    """The points of an arm that an expression speaks of, that of the tool first: bodies, and where they are on them."""

    def __init__(self, arm: _Arm) -> None:
        self._arm = arm
        self.known: list[Point] = [(arm.carrier, arm.tool.translation)]

    def source(self, entry: Entry) -> tuple[int, int]:
        """A quantity of the core, and which of its numbers."""
        name, number = entry
        if name in BY_ORDER:
            return JOINTS, BY_ORDER.index(name) * len(self._arm.joints) + number
        if name.startswith("frame_"):
            return PLACE, 3 * self._number(int(name.removeprefix("frame_"))) + number
        kinds = {"time": TIME, "duration": DURATION, "tool": PLACE, "tool_velocity": VELOCITY, "rotation": ROTATION}
        return kinds[name], number

    def _number(self, frame: int) -> int:
        """The number of a frame of the arm among the points; the tool's beyond the others."""
        if frame >= len(self._arm.frames):
            return 0
        place = self._arm.frames[frame]
        if place not in self.known:
            self.known.append(place)
        return self.known.index(place)
