"""Certified verdicts on random statements, held against kinematics and distances that are written anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from helpers.replanning import EVERY, Erratic, Simulation, scenario
from oracles.csv_checker import check_run
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from benchmarks.random_scenarios import random_scenario
from problems.robots import SpatialArm
from problems.scene import Ball, standing
from tpbso_casadi.replanning import Replanner

TIMES = 3_000
SPARE = 1e-9  # relative, or m: rounding alone
Attack = Callable[[np.random.Generator], int]  # how many certified verdicts were held; AssertionError for a false one


def check_limits(plan: tp.Plan) -> None:
    """Speeds, accelerations, jerks and ranges at many times, by finite sums of the stored polynomials."""
    robot, motion = plan.scenario.robot_table.build(), plan.trajectory
    times = np.linspace(0.0, plan.duration, TIMES)
    pieces = np.clip(np.searchsorted(motion.breakpoints, times, "right") - 1, 0, motion.breakpoints.size - 2)
    local, limits = (times - motion.breakpoints[pieces])[:, None], robot.limits
    coefficients = motion.coefficients[:, pieces]  # highest power first
    for order, most in enumerate((None, limits.speed, limits.acceleration, limits.jerk)):
        value = np.zeros((TIMES, robot.dof))
        for power, row in zip(range(len(coefficients) - 1, order - 1, -1), coefficients, strict=False):
            value = value * local + row * np.prod(np.arange(power - order + 1, power + 1))
        if order == 0 and limits.position is not None:
            low, high = np.array(limits.position).T
            assert ((value >= low - SPARE) & (value <= high + SPARE)).all(), "joint range"
        if most is not None:
            assert (np.abs(value) <= np.array(most) * (1.0 + 1e-8)).all(), f"derivative {order}"


def planar(rng: np.random.Generator) -> int:
    """Random arms, obstacles, points and paths in the plane; the run folder is read back by NumPy alone."""
    stated = random_scenario(rng)
    plan = tp.plan(
        stated, solver=str(rng.choice(["bso", "pso", "abso"])), evaluations=400, polish=bool(rng.random() < 0.5)
    )
    if not plan.certified:
        return 0
    with TemporaryDirectory() as folder:
        plan.save(Path(folder) / "run", figures=())
        check_run(Path(folder) / "run")
    return len(plan.verdicts)


@dataclass(frozen=True)
class Chain:
    """The forward kinematics of an arm in space, from its stored numbers, by SciPy's rotations."""

    arm: SpatialArm

    def frames(self, theta: np.ndarray) -> Iterator[tuple[Rotation, np.ndarray]]:
        """Rotations and origins of the base and of every link, (n,) postures at a time."""
        count = len(theta)
        turned = Rotation.from_matrix(np.broadcast_to(np.array(self.arm.base_frame.rotation), (count, 3, 3)))
        place = np.broadcast_to(np.array(self.arm.base_frame.translation), (count, 3))
        yield turned, place
        for joint, angle in zip(self.arm.chain.joints, theta.T, strict=True):
            place = place + turned.apply(np.array(joint.pose.translation))
            turned = turned * Rotation.from_matrix(np.array(joint.pose.rotation))
            axis = np.array(joint.axis, float)
            turned, place = (
                (turned * Rotation.from_rotvec(angle[:, None] * axis), place)
                if joint.turns
                else (turned, place + turned.apply(angle[:, None] * axis))
            )
            yield turned, place

    def centers(self, theta: np.ndarray) -> list[np.ndarray]:
        """Of every sphere, (n, 3), m."""
        frames = list(self.frames(theta))
        return [frames[s.link][0].apply(np.array(s.center, float)) + frames[s.link][1] for s in self.arm.spheres]

    def tool(self, theta: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Where the tool is."""
        turned, place = list(self.frames(theta))[-1]
        frame = self.arm.tool.frame
        at = np.array([float(part) for part in frame.translation])
        own = Rotation.from_matrix(np.array([[float(part) for part in row] for row in frame.rotation]))
        return turned.apply(at) + place, turned * own


def distance(obstacle: Any, points: np.ndarray) -> np.ndarray:
    """From points (n, 3) to a solid, negative inside, m."""
    turned = Rotation.from_quat(obstacle.quaternion) if obstacle.quaternion is not None else Rotation.identity()
    local = turned.inv().apply(points - np.array(obstacle.center))
    if isinstance(obstacle, tp.Box):
        beyond = np.abs(local) - np.array(obstacle.size) / 2.0
        return np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
    if isinstance(obstacle, Ball):
        return np.linalg.norm(local, axis=1) - obstacle.radius
    along = np.clip(local[:, 2], -obstacle.length / 2.0, obstacle.length / 2.0)
    return np.linalg.norm(local - along[:, None] * [0.0, 0.0, 1.0], axis=1) - obstacle.radius


def random_solid(rng: np.random.Generator) -> Any:
    """A box, a ball or a capsule within reach."""
    direction = rng.normal(size=3)
    center = tuple((rng.uniform(0.4, 0.9) * direction / np.linalg.norm(direction) + [0.0, 0.0, 0.4]).tolist())
    quaternion = tuple(Rotation.random(random_state=int(rng.integers(1 << 31))).as_quat().tolist())
    kind = rng.integers(3)
    if kind == 0:
        return tp.Box(center=center, size=tuple(rng.uniform(0.05, 0.4, 3).tolist()), quaternion=quaternion)
    if kind == 1:
        return Ball(center=center, radius=float(rng.uniform(0.03, 0.2)))
    radius, length = rng.uniform(0.03, 0.1), rng.uniform(0.05, 0.4)
    return tp.Capsule(center=center, radius=float(radius), length=float(length), quaternion=quaternion)


def in_space(rng: np.random.Generator) -> int:
    """Robots that are built in, among solids, to joints, positions and poses, through places."""
    robot = tp.robot(str(rng.choice(["panda", "ur5e", "iiwa14"])))
    arm = robot.model
    assert isinstance(arm, SpatialArm)
    low, high = np.clip(np.array(arm.position_limits).T, -2.8, 2.8)
    start, end, passed = (rng.uniform(0.8 * low + 0.2 * high, 0.2 * low + 0.8 * high) for _ in range(3))
    place, turned = Chain(arm).tool(end[None])
    kind = str(rng.choice(["joints", "position", "pose"]))
    quaternion = tuple(turned.as_quat()[0].tolist())
    goal = {
        "joints": {"joints": end.tolist()},
        "position": {"position": place[0].tolist()},
        "pose": {"position": place[0].tolist(), "quaternion": list(quaternion)},
    }[kind]
    solids = [random_solid(rng) for _ in range(rng.integers(0, 4))]
    via = {"via": [{"joints": passed.tolist()}]} if rng.random() < 0.3 else {}
    try:
        plan = tp.plan(
            robot, start={"joints": start.tolist()}, goal=goal, obstacles=solids, margin=float(rng.choice([0.0, 0.01])),
            solver="pso", evaluations=300, polish=0, seed=int(rng.integers(1000)), **via,
        )  # fmt: skip
    except tp.ScenarioError:  # a place is taken by a solid, or out of reach
        return 0
    return judged_in_space(plan, place[0], turned[0], kind) if plan.certified else 0


def judged_in_space(plan: tp.Plan, place: np.ndarray, turned: Rotation, kind: str) -> int:
    """A certified plan at many times."""
    check_limits(plan)
    times = np.linspace(0.0, plan.duration, TIMES)
    problem = plan.scenario.problem()
    arm, theta = problem.criteria.robot, plan.trajectory.at(times)
    assert isinstance(arm, SpatialArm)
    chain = Chain(arm)
    centers, radii, margin = chain.centers(theta), [sphere.radius for sphere in arm.spheres], plan.scenario.model.margin
    for number, (center, radius) in enumerate(zip(centers, radii, strict=True)):
        for solid in standing(problem.criteria.obstacles) if arm.spheres[number].link > 0 else ():
            assert (distance(solid, center) - radius >= margin - SPARE).all(), f"{arm.spheres[number].name}, {solid}"
    for one, two in (*arm.kept_pairs, *arm.proven_pairs):
        apart = np.linalg.norm(centers[one] - centers[two], axis=1) - radii[one] - radii[two]
        assert (apart >= margin - SPARE).all(), f"{arm.spheres[one].name}, {arm.spheres[two].name}"
    at, orientation = chain.tool(theta[-1:])
    if kind != "joints":
        assert np.linalg.norm(at[0] - place) <= 1e-6, "goal"
    if kind == "pose":
        assert (orientation[0].inv() * turned).magnitude() <= 1e-6, "orientation"
    return len(plan.verdicts)


def retimed(rng: np.random.Generator) -> int:
    """Random waypoints, splined or blended, with and without a limit of the jerk."""
    joints = int(rng.integers(2, 7))
    limits: dict[str, Any] = {
        "max_speed": float(rng.uniform(0.5, 4.0)),
        "max_acceleration": float(rng.uniform(2.0, 30.0)),
    }
    if rng.random() < 0.5:
        limits["max_jerk"] = float(rng.uniform(50.0, 1000.0))
    arm = tp.robot(rng.uniform(0.2, 1.0, joints).tolist(), **limits)
    waypoints = np.cumsum(rng.normal(scale=0.7, size=(int(rng.integers(2, 9)), joints)), axis=0)
    blended = bool(rng.random() < 0.5)
    tolerance = float(rng.choice([0.0, 1e-4, 0.01, 0.2])) if blended else None
    plan = tp.retime(waypoints, arm, interpolation="blend" if blended else "spline", tolerance=tolerance)
    if not plan.certified:
        return 0
    check_limits(plan)
    theta = plan.trajectory.at(np.linspace(0.0, plan.duration, TIMES))
    if tolerance is None:
        nearest = np.abs(theta[:, None] - waypoints).max(axis=2).min(axis=0)
        step = np.abs(np.diff(theta, axis=0)).max()
        assert (nearest <= step).all(), "waypoints"
    else:
        lines = np.concatenate([a + (b - a) * np.linspace(0.0, 1.0, 400)[:, None] for a, b in pairwise(waypoints)])
        step = max(np.abs(b - a).max() / 399 for a, b in pairwise(waypoints))
        away = [np.abs(lines - row).max(axis=1).min() for row in theta[:: TIMES // 200]]
        assert max(away) <= tolerance + step, "lines"
    return len(plan.verdicts)


def replanned(rng: np.random.Generator) -> int:
    """An obstacle that changes its course as much as it is allowed to, and an arm that stops in time."""
    deviation = float(rng.uniform(0.1, 0.5))
    planner = Replanner(scenario(), EVERY, fail_safe_rate=2.0 * deviation, evaluations=120, within=0.0)
    simulation = Simulation().run(planner, Erratic(np.random.default_rng(int(rng.integers(1 << 31))), deviation), 12)
    assert simulation.touched == [], f"touched at {simulation.touched[:3]}"
    return sum(step.certified and step.fail_safe for step in simulation.steps)


ATTACKS: dict[str, Attack] = {
    "planar": planar, "in space": in_space, "retimed": retimed, "replanned": replanned
}  # fmt: skip
