"""Cells of two arms by OMPL, roboplan and direct planning, side by side in one run.

OMPL's RRT-Connect asks our compiled check of the same covers; roboplan checks the arms' own collision meshes in a scene
of its own, with the pairs of links that we keep apart. Their paths are shortened and timed by TOPP-RA, which knows no
jerk and here no torques; ours keep both, and are certified. Each search has the same time, in a process of its own.

    python -m benchmarks.two_arm_peers CELLS.json --seconds 20
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import numpy as np

import tpbso_casadi as tp
from benchmarks.off_the_shelf import ROBOTS, print_rows
from benchmarks.two_arms import SIDES, Cell, cells_of
from problems.base import FloatArray
from problems.core import CompiledWorld
from problems.robots import JointLimits, SpatialArm

PADDING = 0.002  # m that OMPL's paths leave, so that splines along them have room
FAR = 0.01  # m: more room than that is not told apart
HEADER = ("arms", "planner", "problems", "solved", "CPU s: median / most", "duration s: median")


@dataclass(frozen=True)
class Answer:
    """What a planner found: the duration, infinite where it found nothing, and the CPU time, both in s."""

    duration: float
    seconds: float


@dataclass(frozen=True)
class Room:
    """What is free of two arms among boxes.

    Attributes:
        world: of the arms.
        kept: room that is left, m.
    """

    world: CompiledWorld
    kept: float = 0.0

    def all_free(self, postures: FloatArray) -> bool:
        """Whether all postures (n, dof) are free."""
        if not self.kept:
            return bool(self.world.clear(postures).all())
        return bool((self.world.clearance_margins(postures, FAR) >= self.kept).all())


def arm_among(cell: Cell) -> tuple[SpatialArm, CompiledWorld]:
    """The arms, and what is clear of them among the boxes of a cell."""
    built = tp.scenario_of(cell.robot, start=cell.start, goal=cell.goal, obstacles=cell.boxes).built()
    assert isinstance(built.robot, SpatialArm)
    world = CompiledWorld.of(built.model.kept_by(built.robot), built.obstacles)
    assert world is not None
    return built.robot, world


def by_ompl(cell: Cell, seconds: float) -> Answer:
    """RRT-Connect, simplification, smoothing, a spline, and its timing by TOPP-RA."""
    from benchmarks.peers.space.ompl_paths import find_paths  # noqa: PLC0415 (an extra)
    from benchmarks.peers.space.timed_paths import fastest  # noqa: PLC0415

    arm, world = arm_among(cell)
    ends: Any = SimpleNamespace(start=tuple(cell.start), goal=tuple(cell.goal))
    room: Any = Room(world)
    began = time.process_time()
    padded: Any = Room(world, PADDING)
    if not padded.all_free(np.array([cell.start, cell.goal])):
        padded = room
    paths = find_paths(ends, padded, arm.limits, 1, seconds)
    found = None if paths is None else fastest(paths.paths, room, arm.limits)
    spent = time.process_time() - began
    return Answer(np.inf if found is None else found.trajectory.duration, spent)


def by_roboplan(cell: Cell, seconds: float) -> Answer:
    """RRT-Connect, shortcuts and TOPP-RA, all of roboplan."""
    from roboplan.core import Box, Scene, loadUrdfSceneDescription  # noqa: PLC0415 (an extra)

    from benchmarks.peers.space.roboplan_trajectory import CAREFUL, GREY, GROUP, WORLD, _path, _timed  # noqa: PLC0415

    arm, _ = arm_among(cell)
    text = cell.urdf.read_text()
    for side in SIDES:  # no joint may be called as a link is
        text = text.replace(f'name="{side}_base" type="fixed"', f'name="{side}_mount" type="fixed"')
    with TemporaryDirectory() as folder:
        file = Path(folder, "cell.urdf")
        file.write_text(text)
        scene = Scene("cell", loadUrdfSceneDescription(file, [str(ROBOTS.parents[1]), str(ROBOTS.parent)]))
    scene.addGroup(GROUP, list(arm.joints.names))
    limit_accelerations(scene, arm.joints.names, arm.limits)
    assert arm.cover is not None
    names = [link.name for link in arm.cover.links]
    kept = {frozenset((names[one], names[two])) for one, two in arm.cover.pairs}
    pairs = [(one, two) for k, one in enumerate(names) for two in names[:k] if frozenset((one, two)) not in kept]
    scene.setCollisions(pairs, False)
    for number, box in enumerate(cell.boxes):
        pose = np.asfortranarray(np.eye(4))
        pose[:3, 3] = box["center"]
        scene.addBoxGeometry(f"box{number}", WORLD, Box(*box["size"]), pose, GREY)
    boxes, standing = [f"box{k}" for k in range(len(cell.boxes))], [x.name for x in arm.cover.links if x.body == 0]
    unmoved = [(one, two) for k, one in enumerate(boxes) for two in (*boxes[:k], *standing)]
    scene.setCollisions(unmoved, False)
    ends: Any = SimpleNamespace(start=tuple(cell.start), goal=tuple(cell.goal))
    began = time.process_time()
    try:
        path = _path(scene, tuple(arm.joints.names), ends, 1, seconds, CAREFUL)
        motion = _timed(scene, path, CAREFUL)
    except RuntimeError as error:
        print(f"roboplan: {error}", flush=True)
        return Answer(np.inf, time.process_time() - began)
    return Answer(float(motion.times[-1]), time.process_time() - began)


def limit_accelerations(scene: Any, names: tuple[str, ...], limits: JointLimits) -> None:
    """A URDF has none; roboplan reads them from a file of its own."""
    from roboplan.core import loadJointLimitsConfig  # noqa: PLC0415 (an extra)

    each = zip(names, limits.acceleration, strict=True)
    lines = ["joint_limits:", *(f"  {name}: {{max_acceleration: [{value!r}]}}" for name, value in each)]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "limits.yaml"
        file.write_text("\n".join(lines) + "\n")
        scene.importJointLimitsFromConfig(loadJointLimitsConfig(file))


def by_direct(cell: Cell, seconds: float) -> Answer:
    """Ours, certified; the way back is planned before, so that code is loaded, as that of the others is."""
    tp.plan(cell.robot, start=cell.goal, goal=cell.start, obstacles=cell.boxes, within=seconds)
    began = time.process_time()
    plan = tp.plan(cell.robot, start=cell.start, goal=cell.goal, obstacles=cell.boxes, within=seconds)
    return Answer(plan.duration if plan.certified else np.inf, time.process_time() - began)


PLANNERS: dict[str, Callable[[Cell, float], Answer]] = {"ompl": by_ompl, "roboplan": by_roboplan, "direct": by_direct}


def answer(task: tuple[str, int], file: Path, seconds: float) -> tuple[str, Answer]:
    """What a planner found of the problem of a number."""
    planner, number = task
    with TemporaryDirectory() as folder:
        cell = next(islice(cells_of(file, Path(folder)), number, None))
        return cell.name, PLANNERS[planner](cell, seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problems", type=Path)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    tasks = [(planner, number) for number in range(options.count) for planner in PLANNERS]
    with ProcessPoolExecutor(options.workers, max_tasks_per_child=1) as pool:
        found = list(pool.map(partial(answer, file=options.problems, seconds=options.seconds), tasks))
    rows = []
    for arms in dict.fromkeys(name for name, _ in found):
        every = {
            planner: [one for (by, _), (name, one) in zip(tasks, found, strict=True) if (by, name) == (planner, arms)]
            for planner in PLANNERS
        }
        for planner, own in every.items():
            both = [k for k in range(len(own)) if all(np.isfinite(each[k].duration) for each in every.values())]
            durations, seconds = [own[k].duration for k in both], [each.seconds for each in own]
            solved = sum(np.isfinite(each.duration) for each in own)
            cost = f"{np.median(seconds):.2f} / {max(seconds):.2f}"
            middle = f"{np.median(durations):.3f} (of {len(both)} that all solve)" if both else ""
            rows.append([f"two {arms}", planner, str(len(own)), str(solved), cost, middle])
    print_rows(HEADER, rows)


if __name__ == "__main__":
    main()
