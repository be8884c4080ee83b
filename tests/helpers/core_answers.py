"""All that a library of the core answers to questions drawn at random: the same bits, whoever has compiled it."""

from __future__ import annotations

import ctypes
from dataclasses import astuple, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from helpers.core_robots import ROBOTS, SCENE, postures, robot_of, through

from problems import Trajectory
from problems.core import (
    CoreExpression,
    Dynamics,
    Guards,
    MotionNumbers,
    SegmentMotion,
    Separation,
    SingleRows,
    Stops,
    TorqueAim,
    WholeRows,
)
from problems.core.compiled import Core, CoreWorld
from problems.core.description import described
from problems.core.interface import MovingSolids, PathSearch, ProofRequest, Schedule
from problems.core.rows import ProgramData
from problems.core.world import known_robot
from problems.geometry.cover import SETTINGS
from problems.motions import MotionView, traced
from problems.robots import SpatialArm, built_in
from problems.timing.segment_grid import SegmentGrid

POSTURES = 21  # no multiple of the lanes
KINDS = (Separation.FROM_OBSTACLES, Separation.FROM_EACH_OTHER, Separation.ALL)
Answers = dict[str, bytes]  # the bits of each


def answers(library: ctypes.CDLL, seed: int) -> Answers:
    """Of all entry points, by what was asked.

    Args:
        library: a core.
        seed: of the questions.
    """
    core, found = Core(library), Answers()
    for name in ROBOTS:
        robot, rng = robot_of(name), np.random.default_rng([seed, len(found)])
        world = core.world(*described(robot, known_robot(robot), SCENE))
        for what, part in (margins(world, robot, rng) | proofs(world, robot, rng) | ways(world, robot, rng)).items():
            found[f"{name}: {what}"] = part
        found[f"{name}: steps"] = steps(core, robot, rng)
    for number, reach in enumerate((2, 4, 5)):
        program = program_of(reach, np.random.default_rng([seed, number]))
        found[f"linear program of {reach}"] = solved(core, replace(program, squares=None))
        found[f"program of {reach}"] = solved(core, program)
    for model in ("panda", "iiwa14"):
        found[f"{model}: torques"] = torques(library, built_in(model).arm(), np.random.default_rng(seed))
        found[f"{model}: expressions"] = expressions(library, built_in(model).arm(), np.random.default_rng(seed))
    for degree, joints in ((2, 3), (3, 9)):
        found[f"through, of degree {degree}"] = passing(core, degree, joints, np.random.default_rng(seed))
    found["cover"] = covering(library, np.random.default_rng(seed))
    return found


def covering(library: ctypes.CDLL, rng: np.random.Generator) -> bytes:
    """A cover of random triangles, which enclose something, what its larger half leaves bare, overlaps of halves."""
    corners, settings = rng.uniform(-0.1, 0.1, (24, 3, 3)), np.array(astuple(SETTINGS), dtype=float)
    balls, figures, missed = np.zeros((int(SETTINGS.most_balls), 4)), np.zeros(3), np.zeros((1_000, 3))
    triangles = len(corners), corners.ctypes.data
    count = library.core_cover(*triangles, 0.02, settings.ctypes.data, balls.ctypes.data, figures.ctypes.data)
    lost = library.core_not_held(*triangles, count // 2, balls.ctypes.data, 0.01, 1_000, missed.ctypes.data)
    others, depths = balls[count // 2 : count].copy(), np.zeros(count - count // 2)
    library.core_overlaps(count // 2, balls.ctypes.data, len(others), others.ctypes.data, depths.ctypes.data)
    return bits(np.array([count, lost]), balls, figures, missed, depths)


def passing(core: Core, degree: int, joints: int, rng: np.random.Generator) -> bytes:
    """The motion of least time through four postures, of which the last moves."""
    grid, places = SegmentGrid.even(3, 8, degree), rng.uniform(-1.0, 1.0, (4, joints))
    limits, ends = rng.uniform(1.0, 3.0, (degree + 1, joints)), np.zeros((2, degree - 1, joints))
    limits[0], ends[1, 0] = np.abs(places).max(axis=0) + 0.1, 0.1
    between = np.linspace(0.0, 1.0, grid.points)[degree:-degree, None]
    inner = places[:-1, None] + between * np.diff(places, axis=0)[:, None]
    start = SegmentMotion(np.zeros((2, degree - 1, joints)), inner, np.full(3, 5.0))
    cells = grid.limited((0.0, 0.5), np.stack([np.zeros(joints), limits[0]]))
    slopes = rng.uniform(-1.0, 1.0, (2, degree + 1, joints))
    guards = Guards(np.array([0, 2]), np.array([3, 5]), slopes, np.array([0.1, -0.1]), np.full(2, -1.0))
    return bits(
        *core.pass_through(Stops(places, limits[1:], ends, np.zeros_like(places), 50.0), cells, guards, start)[0]
    )


def bits(*parts: np.ndarray) -> bytes:
    return b"".join(np.ascontiguousarray(part).tobytes() for part in parts)


class Around(NamedTuple):
    """What may be true of postures: how solids move, how far joints are off."""

    moving: MovingSolids | None
    errors: np.ndarray | None


def drifting(rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(-0.2, 0.2, (len(SCENE), 6 + 1)) * [*6 * [1.0], rng.choice([0.0, 0.2])]


def margins(world: CoreWorld, robot: SpatialArm, rng: np.random.Generator) -> Answers:
    """The least room, and what comes near."""
    theta, errors = postures(robot, rng, POSTURES), rng.uniform(0.0, 0.04, (POSTURES, robot.dof))
    moving, found = MovingSolids(drifting(rng), rng.uniform(0.0, 3.0, POSTURES)), Answers()
    for around in (Around(None, None), Around(moving, None), Around(None, errors), Around(moving, errors)):
        moves, off = around.moving is not None, around.errors is not None
        for which in KINDS:
            for most in (np.inf, 0.1):
                least = np.full(POSTURES, most)
                world.lower_to_clearance_margins(theta, least, which, most < 1.0, *around)
                found[f"room below {most}, {which!r}, moving {moves}, off {off}"] = bits(least)
            near = world.nearest(theta, 0.15, which, *around)
            found[f"what is near, {which!r}, moving {moves}, off {off}"] = bits(*astuple(near))
    return found


def proofs(world: CoreWorld, robot: SpatialArm, rng: np.random.Generator) -> Answers:
    """Of motions that mostly keep clear, and of some that do not."""
    theta, found = postures(robot, rng, 60), Answers()
    least = np.full(len(theta), np.inf)
    world.lower_to_clearance_margins(theta, least, Separation.ALL, False)
    clear = theta[np.argsort(least)[-6:]]
    for number, share in enumerate((0.02, 0.1, 0.5)):
        stops = clear[:1] + share * (clear[: int(rng.choice([2, 6]))] - clear[:1])
        motion = through(stops, int(rng.choice([1, 3, 5])), rng)
        parts = (np.ascontiguousarray(part) for part in (motion.breakpoints, motion.coefficients))
        asked = ProofRequest(*parts, Separation.ALL, 0.1, 8, 100_000, None, 0.0)
        tracking = rng.uniform(0.0, 0.01, (3, robot.dof))
        for also in (asked, asked._replace(drifts=drifting(rng), rounding=1e-9), asked._replace(tracking=tracking)):
            moves, off = also.drifts is not None, also.tracking is not None
            found[f"proof {number}, moving {moves}, off {off}"] = bits(np.array(world.prove(also)))
    return found


def ways(world: CoreWorld, robot: SpatialArm, rng: np.random.Generator) -> Answers:
    """Between the postures with the most room."""
    theta, box, found = postures(robot, rng, 60), np.array(robot.position_limits).T, Answers()
    least = np.full(len(theta), np.inf)
    world.lower_to_clearance_margins(theta, least, Separation.ALL, False)
    start, goal = theta[np.argsort(least)[-2:]]
    search = PathSearch(box, 0.05, 0.0, 1.0, 60, 30, int(rng.integers(1_000)))
    schedule, errors = Schedule(start, goal, 0.5, 2.5), np.full(robot.dof, 0.002)
    passing = replace(search, drifts=drifting(rng), schedule=schedule)
    for what, also in {"way": search, "among what moves": passing, "off": replace(search, errors=errors)}.items():
        found[what] = bits(world.connect(start, goal, also))
    return found


def steps(core: Core, robot: SpatialArm, rng: np.random.Generator) -> bytes:
    """Inverse kinematics, of points and of poses."""
    reach, (place, rotation) = core.steps(robot.geometry), robot.tool.at(postures(robot, rng, 1))
    starts, limits = postures(robot, rng, POSTURES), np.array(robot.position_limits).T
    bounds = (np.ascontiguousarray(limits[0]), np.ascontiguousarray(limits[1]))
    return b"".join(bits(*reach(starts, place[0], turn, bounds, 40)) for turn in (None, rotation[0]))


def program_of(reach: int, rng: np.random.Generator) -> ProgramData:
    """Rows that hold at zero; some unknowns are constants, some rows have no price."""
    k, n, m = int(rng.integers(1, 5)), int(rng.integers(1, 20)), int(rng.integers(1, 40))

    def whole(rows: int) -> WholeRows:
        weights = rng.normal(size=(rows, reach, k))
        by_time, bound = rng.normal(size=rows), rng.random(rows)
        price = np.where(rng.random(rows) < 0.3, np.inf, 10.0 ** rng.uniform(-1.0, 1.0, rows))
        return WholeRows(rng.integers(-reach, n, rows), weights, by_time, bound, price)

    single = SingleRows(
        rng.integers(0, k, 3 * m), rng.integers(-reach, n, 3 * m), rng.normal(size=(3 * m, reach)),
        -rng.random(3 * m), rng.random(3 * m),
    )  # fmt: skip
    box = np.where(rng.random((n, k)) < 0.1, 0.0, 1.0)
    squares = replace(whole(m), price=rng.random(m))
    cost = rng.normal(size=(n, k)) / (n * k)
    return ProgramData(single, whole(m), -box, box, (-0.2, 0.4), cost, 1.0, squares)


def solved(core: Core, program: ProgramData) -> bytes:
    found = core.solve_program(program)
    return b"none" if found is None else bits(found[0], np.array(found[1]))


def torques(library: ctypes.CDLL, arm: SpatialArm, rng: np.random.Generator) -> bytes:
    chain = arm.rigid_chain
    assert chain is not None
    dynamics, states = Dynamics(library, chain), rng.normal(0.0, 2.0, (POSTURES, 3 * arm.dof))
    aim, limits = TorqueAim(1.0, 1e-3, 1e-3, 12, 200, 0.01), rng.uniform(50.0, 150.0, arm.dof)
    answer = dynamics.settle(moving(arm, rng), limits, np.full(arm.dof, 1e-9), aim)
    return bits(*dynamics.torques(states), dynamics.slopes(states)) + repr(answer).encode()


def moving(arm: SpatialArm, rng: np.random.Generator) -> MotionNumbers:
    """A motion of three pieces that need not join, and where they begin."""
    pieces = Trajectory(np.array([0.0, 0.3, 0.5, 1.0]), rng.normal(size=(6, 3, arm.dof)))
    return MotionNumbers.of(pieces, np.arange(3), np.zeros(3))


def expressions(library: ctypes.CDLL, arm: SpatialArm, rng: np.random.Generator) -> bytes:
    """Values, and a proof, of operations that round as IEEE 754 says."""

    def stated(m: MotionView) -> ca.SX:
        away = ca.norm_2(m.tool - m.positions[3]) + ca.fabs(m.rotation[0, 2] / (2.0 + m.q[1] ** 2))
        return ca.fmax(away, ca.norm_2(m.tool_velocity) - m.time)

    expression = CoreExpression(library, arm, traced(stated, arm, "c"))
    values = expression.values(rng.normal(size=(POSTURES, 4 * arm.dof + 1)), 1.0)
    bounds = np.array([-np.inf]), np.array([values.max()]), np.ones(1)
    return bits(values) + repr(expression.settle(moving(arm, rng), bounds, 1e-9, (12, 200), 0.01)).encode()
