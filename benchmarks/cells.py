"""Pick and place in random cells: the fastest choice of postures against the nearest one stage by stage.

Arms and their geometry are those of public URDFs (extras ``test`` and ``meshes``): a Panda with its hand, a UR5 with a
Robotiq gripper; among a table and a bin with four walls they take up a part and put it into the bin. Stage by stage
means: of the postures of the next stop that one is taken which is reached soonest, if the stages after it can be done.
Every plan is checked by Pinocchio and coal (extra ``oracles``) on the robot's own meshes, with the part where the hand
has it: that nothing touches but what may.

    python -m benchmarks.cells --cells 20
    python -m benchmarks.cells --cells 20 --changed

The second command changes the height above the part, and plans each cell anew and with what is known of it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from benchmarks.off_the_shelf import Arm
from problems.base import FloatArray
from solvers import Interruption
from tpbso_casadi.planning import BOUND, SILENT, NoMotion
from tpbso_casadi.planning import plan as plan_of
from tpbso_casadi.planning.planning import Planning
from tpbso_casadi.planning.sequence import SequencePlanner

PART = (0.04, 0.04, 0.10)  # m
BIN, WALL, HEIGHT = 0.24, 0.01, 0.10  # inner width, thickness and height of its walls, m
ABOVE = 0.15  # how far above its places the hand comes and goes, m
HIGHER = 0.17  # the same where it is changed, m
CHECKED = 2_000  # times of a plan
MASS = 0.5  # kg


@dataclass(frozen=True)
class Picker:
    """An arm with a hand.

    Attributes:
        arm: its file and keys.
        hand: names of links that may touch the part when it is grasped.
        home: posture in which it begins and ends, rad.
        reach: least and largest distance from the base of what it is to take, m.
    """

    arm: Arm
    hand: tuple[str, ...]
    home: tuple[float, ...]
    reach: tuple[float, float]


FASTER = {"max_acceleration": 12.0, "max_jerk": 500.0}
PICKERS = {
    "panda": Picker(
        Arm("panda_description/urdf/panda.urdf", {"tip_link": "panda_hand_tcp", **FASTER}),
        ("panda_hand", "panda_leftfinger", "panda_rightfinger"),
        (0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.785),
        (0.40, 0.60),
    ),
    "ur5 with gripper": Picker(
        Arm("ur_description/urdf/ur5_gripper.urdf", {"tool": {"position": [0.0, 0.0, 0.16]}, **FASTER}),
        ("tool0",),
        (0.0, -1.6, 1.4, -1.4, -1.57, 0.0),
        (0.35, 0.60),
    ),
}


def places(picker: Picker, rng: np.random.Generator) -> list[tuple[FloatArray, float]]:
    """Where the part lies, and where it is to lie: on the table, (2,), m, and how the hand is turned there, rad."""
    return [
        (rng.uniform(*picker.reach) * np.array([np.cos(angle), np.sin(angle)]), rng.uniform(-np.pi, np.pi))
        for angle in (rng.uniform(-1.3, -0.3), rng.uniform(0.4, 1.3))
    ]


def obstacles_of(part: FloatArray, turn: float, bin_at: FloatArray) -> list[dict[str, Any]]:
    """Table, part and bin."""
    quaternion = Rotation.from_euler("z", turn).as_quat().tolist()
    found = [
        {"shape": "box", "name": "table", "center": [0.6, 0.0, -0.055], "size": [0.8, 1.6, 0.1]},
        {
            "shape": "box", "name": "part", "center": [*part.tolist(), PART[2] / 2.0], "size": list(PART),
            "quaternion": quaternion,
        },
    ]  # fmt: skip
    for name, x, y in (("right", 0, -1), ("left", 0, 1), ("front", -1, 0), ("back", 1, 0)):
        center = [bin_at[0] + x * BIN / 2.0, bin_at[1] + y * BIN / 2.0, HEIGHT / 2.0]
        size = [WALL if x else BIN + WALL, BIN + WALL if x else WALL, HEIGHT]
        found.append({"shape": "box", "name": f"bin {name}", "center": center, "size": size})
    return found


def scenario_of(picker: Picker, seed: int, above: float = ABOVE) -> tp.Scenario:
    """A random cell, in which the hand comes from so far above the part, m."""
    (part, turn), (bin_at, other) = places(picker, np.random.default_rng(seed))
    grasped = [(link, "part") for link in picker.hand]

    def pose(at: FloatArray, angle: float, height: float) -> dict[str, Any]:
        quaternion = (Rotation.from_euler("z", angle) * Rotation.from_euler("x", np.pi)).as_quat().tolist()
        return {"position": [*at.tolist(), height], "quaternion": quaternion}

    height = 0.6 * PART[2]
    stages: list[Any] = [
        tp.MoveTo(pose(part, turn, height + above)),
        tp.Line(by=[0.0, 0.0, -above], may_touch=grasped),
        tp.Output("gripper", "close"),
        tp.Attach("part", mass=MASS),
        tp.Line(by=[0.0, 0.0, ABOVE], may_touch=[("part", "table")]),
        tp.MoveTo(pose(bin_at, other, height + ABOVE + 0.01)),
        tp.Line(by=[0.0, 0.0, -ABOVE]),
        tp.Output("gripper", "open"),
        tp.Detach("part"),
        tp.Line(by=[0.0, 0.0, ABOVE], may_touch=grasped),
        tp.MoveTo(list(picker.home)),
    ]
    robot = picker.arm.robot
    tables = [stage.table(robot, "stage") for stage in stages]
    task = {"kind": "sequence", "start": {"joints": list(picker.home)}, "stages": tables}
    return tp.parse_scenario(robot.tables | {"task": task, "obstacles": obstacles_of(part, turn, bin_at)})


class StageByStage(SequencePlanner):
    """Of each stop the posture that is reached soonest, from which the rest can be done."""

    def duration(self) -> float:
        """Of the whole, s; infinite where there is none."""
        chain, graph = next(self._chains([int(self._first())]), None), self.graph
        if chain is None:
            return np.inf
        return graph.waits + sum(e.durations[pair] for e, pair in zip(graph.edges, pairwise(chain), strict=True))

    def _first(self) -> int:
        return 0

    def _chains(self, chain: list[int]) -> Iterator[list[int]]:
        layer = len(chain) - 1
        if layer == len(self.graph.moving):
            yield chain
            return
        bounds = self.graph.edges[layer].bounds[chain[-1]]
        for after in np.argsort(bounds, kind="stable"):
            if not np.isfinite(bounds[after]):
                return
            pair = chain[-1], int(after)
            if pair not in self.graph.edges[layer].motions:
                rest = [0] * (len(self.graph.moving) - layer - 1)
                self._evaluate(layer, [*chain, int(after), *rest], thorough=False)
            if self.graph.edges[layer].motions[pair] is not None:
                yield from self._chains([*chain, int(after)])


def planning_of(scenario: tp.Scenario) -> Planning:
    """As a plan has it, without an end."""
    return Planning(
        scenario=scenario,
        solver=scenario.solver.build(),
        settings=scenario.solver,
        evaluation=None,
        progress=SILENT,
        interruption=Interruption(),
    )


class Meshes:
    """The robot's own meshes, and boxes, as Pinocchio and coal see them.

    Args:
        picker: the arm.
        plan: whose scene it is.
    """

    def __init__(self, picker: Picker, plan: tp.Plan) -> None:
        import coal  # noqa: PLC0415
        import pinocchio as pin  # noqa: PLC0415

        from benchmarks.off_the_shelf import ROBOTS  # noqa: PLC0415 (extra)

        self.pin, self.coal = pin, coal
        file, folder = str(ROBOTS / picker.arm.file), str(ROBOTS.parents[1])
        self.model = pin.buildModelFromUrdf(file)
        self.geometry = pin.buildGeomFromUrdf(self.model, file, pin.GeometryType.COLLISION, package_dirs=[folder])
        self.data, self.placed = self.model.createData(), self.geometry.createData()
        arm = plan.planned.criteria.robot
        self.columns = [self.model.joints[self.model.getJointId(name)].idx_q for name in arm.joints.identifiers]
        moved = set(self.model.subtrees[self.columns_joint(arm.joints.identifiers[0])])
        self.links = [n for n, one in enumerate(self.geometry.geometryObjects) if one.parentJoint in moved]

    def columns_joint(self, name: str) -> int:
        """The number of a joint."""
        return int(self.model.getJointId(name))

    def touched(self, theta: FloatArray, boxes: dict[str, tuple[FloatArray, Any]]) -> set[tuple[str, str]]:
        """Names of links' geometry and of boxes (frames (4, 4) and coal's shapes) that touch in a posture (dof,)."""
        q = self.pin.neutral(self.model)
        q[self.columns] = theta
        self.pin.updateGeometryPlacements(self.model, self.data, self.geometry, self.placed, q)
        found = set()
        for link in self.links:
            place = self.placed.oMg[link]
            at = self.coal.Transform3s(place.rotation, place.translation)
            for name, (frame, shape) in boxes.items():
                if self._touch(self.geometry.geometryObjects[link].geometry, at, shape, frame):
                    found.add((self.geometry.geometryObjects[link].name, name))
        return found

    def _touch(self, one: Any, at: Any, other: Any, frame: FloatArray) -> bool:
        request, result = self.coal.CollisionRequest(), self.coal.CollisionResult()
        there = self.coal.Transform3s(frame[:3, :3], frame[:3, 3])
        return bool(self.coal.collide(one, at, other, there, request, result))

    def unexpected(self, picker: Picker, plan: tp.Plan) -> int:
        """How many of the times of a plan see a contact that is not allowed then."""
        scenery = plan.planned.criteria.task.scenery
        boxes = {obstacle.unmoved.name: (obstacle, self.coal.Box(*obstacle.unmoved.size)) for obstacle in scenery}
        wrong, stages = 0, plan.stages
        for now in np.linspace(0.0, plan.duration, CHECKED):
            number = next(n for n, stage in enumerate(stages) if now <= stage.end)
            carried = 3 <= number < 8  # from attach to detach
            allowed = {"part"} if carried or number in (1, 9) else set()
            framed = {name: (_frame(obstacle, now), shape) for name, (obstacle, shape) in boxes.items()}
            touched = self.touched(plan.trajectory(float(now)), framed)
            frame, shape = framed.pop("part")
            at = self.coal.Transform3s(frame[:3, :3], frame[:3, 3])
            beside = {n for n, (there, other) in framed.items() if carried and self._touch(shape, at, other, there)}
            wrong += bool({name for _, name in touched} - allowed) or bool(beside - {"table"})
        return wrong


def _frame(obstacle: Any, now: float) -> FloatArray:
    """The frame (4, 4) of a box at a time in s."""
    still = obstacle.unmoved
    frame = np.eye(4)
    corners = np.vstack([np.zeros(3), np.eye(3)]) @ np.array(still.axes, dtype=float).T + np.array(still.center)
    if obstacle.moves:
        corners = obstacle.motion.placed(corners, now)
    frame[:3, 3], frame[:3, :3] = corners[0], (corners[1:] - corners[0]).T
    return frame


def row(name: str, seed: int) -> tuple[list[str], float]:
    """One cell: what came out, and how much longer stage by stage takes."""
    picker = PICKERS[name]
    scenario = scenario_of(picker, seed)
    began = time.process_time()
    try:
        plan = tp.plan(scenario)
    except (NoMotion, tp.ScenarioError) as error:
        return [name, str(seed), f"none: {str(error)[:60]}", *[""] * 5], np.nan
    seconds = time.process_time() - began
    greedy = StageByStage(scenario, planning_of(scenario), plan_of).duration()
    (bound,) = plan.motion.quantities[BOUND]
    wrong = Meshes(picker, plan).unexpected(picker, plan)
    figures = f"{plan.duration:.3f}", f"{plan.duration / bound:.3f}", f"{greedy:.3f}", f"{greedy / plan.duration:.3f}"
    return [name, str(seed), str(plan.status), *figures, f"{seconds:.1f}", str(wrong)], greedy / plan.duration


def changed_row(name: str, seed: int) -> tuple[list[str], float]:
    """One cell with another height: planned anew and with an earlier plan, and how much longer that one is."""
    picker = PICKERS[name]
    earlier, changed = tp.plan(scenario_of(picker, seed)), scenario_of(picker, seed, HIGHER)
    plans, seconds = [], []
    for warm_start in (None, earlier):
        began = time.process_time()
        plans.append(tp.plan(changed, warm_start=warm_start))
        assert plans[-1].certified
        seconds.append(f"{time.process_time() - began:.2f}")
    cold, warm = plans
    ratio = warm.duration / cold.duration
    return [name, str(seed), f"{warm.planned.kept}", f"{ratio:.4f}", *seconds], ratio


CHANGED_HEADER = ("arm", "cell", "motions kept of 7", "duration over that planned anew", "CPU s anew", "CPU s")
HEADER = ("arm", "cell", "certificate", "cycle s", "over bound", "stage by stage s", "ratio", "CPU seconds", "contacts")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, default=20, help="half of them for each arm")
    parser.add_argument(
        "--changed", action="store_true", help="plan with another height, anew and with an earlier plan"
    )
    options = parser.parse_args()
    header, row_of = (CHANGED_HEADER, changed_row) if options.changed else (HEADER, row)
    ratios = []
    for line in (header, ("---",) * len(header)):
        print("| " + " | ".join(line) + " |", flush=True)
    for number in range(options.cells):
        cells, ratio = row_of(list(PICKERS)[number % 2], number // 2)
        print("| " + " | ".join(cells) + " |", flush=True)
        ratios.append(ratio)
    known = [ratio for ratio in ratios if np.isfinite(ratio)]
    what = "with an earlier plan over anew" if options.changed else "stage by stage over the best"
    print(f"{what}: median {np.median(known):.3f}, worst {max(known):.3f}; {len(known)} cells")


if __name__ == "__main__":
    main()
