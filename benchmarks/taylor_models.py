"""Are proofs by Taylor models right? Expressions of arms in space, each verdict against a dense sampling.

Random splines of the built-in robots, over much or little of their reach. Of each an expression is bounded a little
below and above its largest value among all samples: the distance from a line, an arc or corners through places that the
tool passes, how it is turned there, its tilt, region and speed, and random formulas of all operations. A verdict is
false when it is certified and a sample breaks the bound, or violated and the value at its time does not. Of every tenth
case the proof by intervals of the whole expression is a second opinion, and samples and values are computed by CasADi.

    python -m benchmarks.taylor_models --cases 2000 --samples 100000
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import casadi as ca
import numpy as np

from benchmarks.torque_certificates import random_motion
from problems import CertificateStatus, Trajectory
from problems.base import FloatArray, InvalidProblem
from problems.certify import Verdict
from problems.certify.cells import prove_by_cells
from problems.certify.core_expressions import prove_in_core
from problems.limits import ExpressionLimit, StatedExpression, ToolOrientation, ToolSpeed, Upright
from problems.motions import SAMPLED_ORDERS, MotionView, traced
from problems.robots import BUILT_IN, SpatialArm, built_in
from problems.tasks import Arc, Corners, StraightLine, ToolCurve, ToolPath

FACTORS = (0.9, 0.999, 0.999_999, 1.001, 1.1)  # bounds over the largest sample
ALLOWED = 1e-9  # relative: what a verdict forgives as rounding
SECOND, CHECKED = 10, 500  # every so manyth case has a second opinion, and so many samples by CasADi
CERTIFIED, VIOLATED, UNDECIDED = CertificateStatus


@cache
def arm(name: str) -> SpatialArm:
    """A robot as it is built in."""
    return built_in(name).arm(max_acceleration=15.0)


@dataclass(frozen=True, eq=False)
class Case:
    """An expression of a motion.

    Attributes:
        limit: bounds on it, of which the first is set anew.
        motion: of its robot.
    """

    limit: ExpressionLimit
    motion: Trajectory

    def states(self, times: FloatArray) -> FloatArray:
        """Angles, three derivatives and time at times (n,), (n, 4 dof + 1)."""
        return np.column_stack([*(self.motion.at(times, order) for order in range(SAMPLED_ORDERS)), times])

    def by_core(self, times: FloatArray) -> FloatArray:
        """The values at times (n,), (n,)."""
        assert self.limit.in_core is not None
        return self.limit.in_core.values(self.states(times), self.motion.duration)[:, 0]

    def by_casadi(self, times: FloatArray) -> FloatArray:
        """The same values, computed by CasADi alone."""
        return self.limit.function.probed(self.limit.robot, self.states(times), self.motion.duration)[:, 0]

    def bounded(self, bound: float) -> ExpressionLimit:
        """The limit with another bound on the first value and none on the others."""
        others = (np.inf,) * (len(self.limit.scale) - 1)
        scale = (abs(bound), *self.limit.scale[1:])
        return replace(self.limit, lower=None, upper=(bound, *others), scale=scale)


def smaller(rng: np.random.Generator, motion: Trajectory) -> Trajectory:
    """The motion with all its ways about its start shortened, by up to a hundredth."""
    coefficients, start = motion.coefficients.copy(), motion.at(np.zeros(1))[0]
    coefficients[-1] -= start
    coefficients *= 10.0 ** rng.uniform(-2.0, 0.0)
    coefficients[-1] += start
    return Trajectory(motion.breakpoints, coefficients)


def passed(robot: SpatialArm, motion: Trajectory, shares: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3) and rotations (n, 3, 3) of the tool at shares of a motion's time."""
    return robot.tool.at(motion.at(motion.duration * np.array(shares)))


def along(kind: str, which: int, rng: np.random.Generator, robot: SpatialArm, motion: Trajectory) -> StatedExpression:
    """The distance from a way through places that the tool passes (0), or how it is turned there (1)."""
    points, rotations = passed(robot, motion, (0.0, *np.sort(rng.uniform(0.1, 0.9, 2)), 1.0))
    ways: dict[str, Callable[[], ToolCurve]] = {
        "line": lambda: StraightLine(points[0], points[-1]),
        "arc": lambda: Arc(points[0], points[1], points[-1]),
        "corners": lambda: Corners(points, 1e-3),
    }
    return ToolPath(ways[kind](), (rotations[0], rotations[-1])).constraints(robot, 1e-3, 0.01)[which]


def formula(rng: np.random.Generator, m: MotionView) -> ca.SX:
    """A random tree of operations on what a motion has, defined wherever that is."""
    parts = [m.q, m.tool, m.tool_velocity, m.rotation[:, 0], m.positions[3], m.speed, 0.1 * m.acceleration]
    values = [part[int(rng.integers(part.numel()))] for part in parts]
    operations: list[Callable[[ca.SX, ca.SX], ca.SX]] = [
        lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / (1.0 + b**2),
        ca.fmax, ca.fmin, lambda a, b: ca.sqrt(a**2 + b**2),
        lambda a, b: ca.fabs(a) - b, lambda a, b: ca.sin(a) * ca.cos(b), lambda a, b: ca.atan2(a, 1.0 + b**2),
        lambda a, b: ca.asin(ca.sin(a) / 2.0) + b, lambda a, b: ca.exp(-(a**2)) * b, lambda a, b: ca.log(2.0 + a**2),
        lambda a, b: ca.atan(a) - ca.acos(ca.cos(b) / 3.0),
    ]  # fmt: skip
    for _ in range(8):
        one, other = rng.choice(len(values), 2, replace=False)
        values.append(operations[int(rng.integers(len(operations)))](values[one], values[other]))
    return values[-1]


def own(rng: np.random.Generator, robot: SpatialArm, motion: Trajectory) -> StatedExpression:
    """A random formula."""
    return StatedExpression("own", "1", traced(partial(formula, rng), robot, "own", differentiates=False), None, (1.0,))


def turned(rng: np.random.Generator, robot: SpatialArm, motion: Trajectory) -> StatedExpression:
    """The angle from an orientation."""
    quaternion = rng.normal(size=4)
    return ToolOrientation(quaternion=tuple((quaternion / np.linalg.norm(quaternion)).tolist()), tolerance=1.0).stated(
        robot
    )


KINDS: dict[str, Callable[[np.random.Generator, SpatialArm, Trajectory], StatedExpression]] = {
    "line": partial(along, "line", 0),
    "line, turned": partial(along, "line", 1),
    "arc": partial(along, "arc", 0),
    "arc, turned": partial(along, "arc", 1),
    "corners": partial(along, "corners", 0),
    "upright": lambda rng, robot, motion: Upright(toward=tuple(rng.normal(size=3)), tolerance=1.0).stated(robot),
    "orientation": turned,
    "tool speed": lambda rng, robot, motion: ToolSpeed(max=1.0).stated(robot),
    "random formulas": own,
}


def random_case(kind: str, seed: int) -> Case:
    """The case of a seed; another motion where a way through its places is none."""
    rng = np.random.default_rng(seed)
    robot = arm(str(rng.choice(list(BUILT_IN))))
    while True:
        motion = smaller(rng, random_motion(rng, robot.dof))
        with suppress(InvalidProblem):
            return Case(KINDS[kind](rng, robot, motion).for_robot(robot, ()), motion)


@dataclass(frozen=True)
class Checked:
    """One verdict.

    Attributes:
        kind: of the expression.
        status: the verdict's.
        is_false: whether samples, or the value at its time, say otherwise.
        between: whether it is broken between samples alone.
        milliseconds: of CPU.
        second: status of the second opinion, and its milliseconds; None without one.
    """

    kind: str
    status: CertificateStatus
    is_false: bool
    between: bool
    milliseconds: float
    second: tuple[CertificateStatus, float] | None


def timed(prove: Callable[[], Any]) -> tuple[Any, float]:
    """A result, and the milliseconds of CPU that it took."""
    began = time.process_time()
    result = prove()
    return result, (time.process_time() - began) * 1e3


def judged(kind: str, case: Case, peak: float, factor: float, second: bool) -> Checked:
    """The verdict on one bound."""
    bound = peak * factor if peak > 0.0 else peak / factor
    limit, allowed = case.bounded(bound), bound + ALLOWED * abs(bound)
    assert limit.in_core is not None
    outcome, milliseconds = timed(partial(prove_in_core, limit, case.motion))
    assert isinstance(outcome, Verdict)
    broken = outcome.status is VIOLATED and np.isfinite(outcome.worst)
    values = case.by_casadi if second else case.by_core
    wrongly = broken and float(values(np.array([outcome.time]))[0]) <= bound
    other = None
    if second:
        (opinion,), seconds = timed(partial(prove_by_cells, limit, case.motion))
        other = opinion.status, seconds
    is_false = wrongly or (outcome.status is CERTIFIED and peak > allowed)
    return Checked(kind, outcome.status, bool(is_false), broken and peak <= allowed, milliseconds, other)


def checked(seed: int, samples: int) -> Iterator[Checked]:
    """The verdicts on all bounds of one case; none where its expression jumps with the motion's derivatives."""
    kind = list(KINDS)[seed % len(KINDS)]
    case = random_case(kind, seed)
    assert case.limit.in_core is not None
    if case.motion.jumps_below(case.limit.in_core.order) is not None:
        return
    times = np.concatenate(
        [np.linspace(0.0, case.motion.duration, samples), np.nextafter(case.motion.breakpoints, 0.0)]
    )
    values = case.by_core(times)
    second = seed // len(KINDS) % SECOND == 0
    if second:
        some = np.random.default_rng(seed).integers(times.size, size=CHECKED)
        np.testing.assert_allclose(case.by_casadi(times[some]), values[some], rtol=1e-7, atol=1e-7)
    for factor in FACTORS:
        yield judged(kind, case, float(values.max()), factor, second)


def report(found: list[Checked]) -> str:
    """A table by kinds of expressions."""
    lines = [
        "| expression | certified | violated | undecided | false | broken only between samples | CPU ms, median / worst"
        " | second opinion: as ours / undecided / other | its CPU ms, median / worst |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for kind in (*KINDS, "all"):
        some = [one for one in found if kind in (one.kind, "all")]
        counts = [sum(one.status is status for one in some) for status in CertificateStatus]
        others = [(one.status, *one.second) for one in some if one.second is not None]
        agree = sum(ours is theirs for ours, theirs, _ in others)
        open_ = sum(ours is not theirs and theirs is UNDECIDED for ours, theirs, _ in others)
        ours, theirs = (np.array(part) for part in ([one.milliseconds for one in some], [each[2] for each in others]))
        cells = [
            *map(str, counts), str(sum(one.is_false for one in some)), str(sum(one.between for one in some)),
            f"{np.median(ours):.2f} / {ours.max():.1f}", f"{agree} / {open_} / {len(others) - agree - open_}",
            f"{np.median(theirs):.0f} / {theirs.max():.0f}",
        ]  # fmt: skip
        lines.append(f"| {kind} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=2_000)
    parser.add_argument("--samples", type=int, default=100_000)
    options = parser.parse_args()
    print(report([one for seed in range(options.cases) for one in checked(seed, options.samples)]))


if __name__ == "__main__":
    main()
