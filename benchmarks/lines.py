"""Lines and arcs of the tool in random places: the share that is planned, how near the tool stays, how long it takes.

For each arm as many starts, drawn among its postures away from the ends of their ranges; from each the tool goes 0.1 to
0.5 m, straight or along an arc, turning by up to half a radian, such that at five points of the way there is a posture,
whichever. Where it cannot be led, the reason is counted. Nearness is measured at 2,000 times by kinematics of its own
in NumPy. The duration is compared with that of the joints' path that follows the way exactly, in the least time that is
found for it.

    python -m benchmarks.lines --count 100
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from problems.base import FloatArray
from problems.robots import SpatialArm
from problems.tasks import Arc, StraightLine, ToolPath
from problems.timing import retime
from tpbso_casadi.planning import NoMotion
from tpbso_casadi.planning.ways import led_along
from tpbso_casadi.scenario import Cell

ARMS = ("panda", "ur5e", "iiwa14")
TIMES = 2_000
LENGTHS, TURN = (0.1, 0.5), 0.5  # m, rad
MOST_DRAWN, LOOKS = 1_000, 5


@dataclass
class Found:
    """What came out for one arm: counts of reasons, and a number for each that was planned."""

    reasons: Counter[str] = field(default_factory=Counter)
    away: list[float] = field(default_factory=list)
    turned: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    gained: list[float] = field(default_factory=list)


def drawn(robot: SpatialArm, rng: np.random.Generator) -> tuple[FloatArray, tp.Line, FloatArray, FloatArray]:
    """A start, (dof,), a line or an arc, and three points and two rotations that it passes."""
    assert robot.limits.position is not None
    low, high = np.clip(np.array(robot.limits.position), -2.5, 2.5).T
    start = rng.uniform(0.85 * low + 0.15 * high, 0.15 * low + 0.85 * high)
    position, rotation = tool(robot, start[None])
    direction = rng.normal(size=3)
    goal = position[0] + rng.uniform(*LENGTHS) * direction / np.linalg.norm(direction)
    turn = Rotation.from_matrix(rotation[0]) * Rotation.from_rotvec(rng.uniform(-1.0, 1.0, 3) * TURN / 3.0**0.5)
    pose = tp.Pose(tuple(goal.tolist()), tuple(turn.as_quat().tolist()))
    middle = (position[0] + goal) / 2.0
    if rng.random() < 0.5:
        return start, tp.Line(pose), np.array([position[0], middle, goal]), np.array([rotation[0], turn.as_matrix()])
    aside = np.cross(direction, rng.normal(size=3))
    through = middle + 0.3 * np.linalg.norm(goal - position[0]) * aside / np.linalg.norm(aside)
    passed, turned = np.array([position[0], through, goal]), np.array([rotation[0], turn.as_matrix()])
    return start, tp.Line(pose, through=through.tolist()), passed, turned


def within_reach(robot: SpatialArm, start: FloatArray, line: tp.Line, passed: FloatArray, turned: FloatArray) -> bool:
    """Whether inverse kinematics finds a posture at each of a few points of the way, whichever."""
    way: StraightLine | Arc = StraightLine(passed[0], passed[2]) if line.through is None else Arc(*passed)
    try:
        for place in ToolPath(way, (turned[0], turned[1])).places(np.linspace(0.0, 1.0, LOOKS)):
            place.branches(robot, (), None, "goal")
    except tp.InvalidProblem:
        return False
    return True


def tool(robot: SpatialArm, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3), m, and rotations (n, 3, 3) of the tool, from link to link in NumPy."""
    positions, rotations = [], []
    base, end = _matrix(robot.base_frame), _matrix(robot.tool.frame)
    for posture in theta:
        frame = base
        for joint, angle in zip(robot.chain.joints, posture, strict=True):
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_rotvec(angle * np.array(joint.axis, dtype=float)).as_matrix()
            frame = frame @ _matrix(joint.pose) @ turn
        frame = frame @ end
        positions.append(frame[:3, 3])
        rotations.append(frame[:3, :3])
    return np.array(positions), np.array(rotations)


def _matrix(pose: object) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(pose.rotation, dtype=float)  # type: ignore[attr-defined]
    matrix[:3, 3] = np.array(pose.translation, dtype=float)  # type: ignore[attr-defined]
    return matrix


def nearness(
    passed: FloatArray, turned: FloatArray, positions: FloatArray, rotations: FloatArray
) -> tuple[float, float]:
    """The largest distance from the way, m, and the largest angle from the even turn along it, rad, both densely."""
    start, through, goal = passed
    if np.linalg.norm(np.cross(through - start, goal - start)) < 1e-9:
        share = np.clip((positions - start) @ (goal - start) / ((goal - start) @ (goal - start)), 0.0, 1.0)
        away = np.linalg.norm(positions - start - share[:, None] * (goal - start), axis=1)
    else:
        share, away = _about(start, through, goal, positions)
    whole = Rotation.from_matrix(turned[0].T @ turned[1]).as_rotvec()
    wanted = Rotation.from_matrix(turned[0]) * Rotation.from_rotvec(share[:, None] * whole)
    return float(away.max()), float((wanted.inv() * Rotation.from_matrix(rotations)).magnitude().max())


def _about(
    start: FloatArray, through: FloatArray, goal: FloatArray, positions: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Shares of the angle of an arc, and distances from its circle."""
    normal = np.cross(through - start, goal - start)
    rows = np.array([2.0 * (through - start), 2.0 * (goal - start), normal])
    values = [through @ through - start @ start, goal @ goal - start @ start, normal @ start]
    center = np.linalg.solve(rows, values)
    axis = normal / np.linalg.norm(normal)
    first = start - center
    angle = np.arctan2(np.cross(first, goal - center) @ axis, first @ (goal - center)) % (2.0 * np.pi)
    flat = positions - center
    turned = np.arctan2(np.cross(first, flat) @ axis, flat @ first)
    share = np.clip(np.where(turned < angle - np.pi, turned + 2.0 * np.pi, turned) / angle, 0.0, 1.0)
    radius = np.linalg.norm(flat - np.outer(flat @ axis, axis), axis=1)
    return share, np.hypot(radius - np.linalg.norm(first), flat @ axis)


def measured(name: str, seed: int, found: Found) -> None:
    """One line or arc."""
    stated = tp.robot(name)
    robot = stated.model
    rng = np.random.default_rng(seed)
    start, line, passed, turned = next(
        one for _ in range(MOST_DRAWN) if within_reach(robot, *(one := drawn(robot, rng)))
    )
    began = time.process_time()
    try:
        plan = tp.sequence(stated, start={"joints": start.tolist()}, stages=[line])
    except (NoMotion, tp.ScenarioError) as error:
        found.reasons[_reason(str(error))] += 1
        return
    found.seconds.append(time.process_time() - began)
    found.reasons["certified" if plan.certified else "not certified"] += 1
    positions, rotations = tool(robot, plan.trajectory.at(np.linspace(0.0, plan.duration, TIMES)))
    away, angle = nearness(passed, turned, positions, rotations)
    found.away.append(away)
    found.turned.append(angle)
    stage = plan.scenario.task.stages[0]
    way = stage.tool_path(Cell.at_first(plan.scenario).robot, start)
    path = led_along(way, robot, start, stage)
    exactly = retime(path, robot.limits, chain=robot.rigid_chain)
    found.gained.append(plan.duration / exactly.duration)


def _reason(said: str) -> str:
    """The kind of a refusal."""
    kinds = {
        "from the base, of": "out of reach",
        "at the end of the range": "a joint's range ends",
        "jump": "joints would jump",
        "no posture next": "no posture next to the last",
        "start": "the start is in contact with itself",
        "clearance": "in contact with itself on the way",
    }
    return next((kind for part, kind in kinds.items() if part in said), said[:60])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100, help="for each arm")
    options = parser.parse_args()
    print(
        "| arm | certified | others | farthest um | most turned mrad | CPU seconds: median / worst | "
        "over the exact path's: least / median / most |\n" + "|---" * 7 + "|"
    )
    for name in ARMS:
        found = Found()
        for seed in range(options.count):
            measured(name, seed, found)
        others = ", ".join(f"{n} {reason}" for reason, n in found.reasons.most_common() if reason != "certified")
        spread = " / ".join(f"{value:.2f}" for value in np.quantile(found.seconds, [0.5, 1.0]))
        gained = " / ".join(f"{value:.3f}" for value in np.quantile(found.gained, [0.0, 0.5, 1.0]))
        figures = f"{1e6 * max(found.away):.0f}", f"{1e3 * max(found.turned):.2f}", spread, gained
        print(f"| {name} | {found.reasons['certified']} | {others} | {' | '.join(figures)} |", flush=True)


if __name__ == "__main__":
    main()
