"""Arms straight from their public URDFs: what is read, what their covers cost, and plans checked on the meshes.

Arms are those of ``example-robot-data`` (extra ``test``). Plans are among boxes and a ring, a mesh that is not convex
(extra ``meshes``), from and to random postures; each is checked by Pinocchio and coal (extra ``oracles``), on the
meshes themselves, at 20,000 times: those are left out at which nothing can be nearer than before, as no point of the
arm is so fast. By how much the verdict and the meshes' distance differ at the ends is printed too.

    python -m benchmarks.off_the_shelf
    python -m benchmarks.off_the_shelf --plans ur5,panda,kinova
"""

from __future__ import annotations

import argparse
import sysconfig
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import trimesh

import tpbso_casadi as tp
from problems.base import FloatArray
from problems.limits import CoverClearance
from problems.robots import SpatialArm
from tpbso_casadi.scenario import ScenarioError

ROBOTS = Path(sysconfig.get_paths()["purelib"]) / "cmeel.prefix" / "share" / "example-robot-data" / "robots"
TIMES = 20_000
BOXES, SIZE = 3, 0.1  # in a scene; m
RING = 0.08, 0.12, 0.04  # inner and outer radius, height, m
MOST_SCENES = 200  # that are drawn until one has ends without contact
EVALUATIONS = 2_000


@dataclass(frozen=True)
class Arm:
    """A file and what it leaves open.

    Attributes:
        file: in the folder of all robots.
        keys: of the [robot] table.
    """

    file: str
    keys: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def robot(self) -> Any:
        """The robot, its links covered."""
        return tp.robot(ROBOTS / self.file, **{"max_speed": 2.0, "max_acceleration": 8.0} | self.keys)


ARMS = {
    "ur3": Arm("ur_description/urdf/ur3_robot.urdf"),
    "ur5": Arm("ur_description/urdf/ur5_robot.urdf"),
    "ur10": Arm("ur_description/urdf/ur10_robot.urdf"),
    "ur5_gripper": Arm("ur_description/urdf/ur5_gripper.urdf"),
    "panda": Arm("panda_description/urdf/panda.urdf"),
    "panda_collision": Arm("panda_description/urdf/panda_collision.urdf"),
    "kinova": Arm("kinova_description/robots/kinova.urdf"),
    "xarm7": Arm("xarm_description/urdf/xarm7.urdf"),
    "z1": Arm("z1_description/urdf/z1.urdf"),
    "so100": Arm("so_arm_description/urdf/so100.urdf"),
    "so101": Arm("so_arm_description/urdf/so101.urdf"),
    "talos_left_arm": Arm(  # in its file two links of the wrist always touch
        "talos_data/robots/talos_left_arm.urdf", {"disabled_pairs": [["arm_left_5_link", "arm_left_7_link"]]}
    ),
    "baxter": Arm("baxter_description/urdf/baxter.urdf", {"base_link": "left_arm_mount", "tip_link": "left_hand_link"}),
    "tiago_no_hand": Arm("tiago_description/robots/tiago_no_hand.urdf"),
}
HEADER = ("arm", "joints", "tip", "spheres", "fine", "95 % mm", "all mm", "CPU s", "again", "pairs")


def row(name: str) -> list[str]:
    """What is read of an arm, and what its cover costs, first and then, in CPU seconds."""
    seconds = []
    for arm in (ARMS[name], Arm(ARMS[name].file, ARMS[name].keys)):
        began = time.process_time()
        model = arm.robot.model
        seconds.append(f"{time.process_time() - began:.1f}")
    fine = [cover.fine for cover in ARMS[name].robot.cover.values() if cover.fine is not None]
    overhangs = [1e3 * max((getattr(cover, key) for cover in fine), default=0.0) for key in OVERHANGS]
    links, pairs = ((), ()) if model.cover is None else (model.cover.links, model.cover.pairs)
    sizes = (
        str(len(model.spheres)),
        str(sum(len(link.balls) for link in links)),
        *(f"{length:.2f}" for length in overhangs),
    )
    return [name, str(model.dof), model.chain.tip_link, *sizes, *seconds, str(len(pairs))]


OVERHANGS = ("usual_overhang", "largest_overhang")


def print_rows(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """As they come."""
    for line in (header, ("---",) * len(header)):
        print("| " + " | ".join(line) + " |", flush=True)
    for line in rows:
        print("| " + " | ".join(line) + " |", flush=True)


class Meshes:
    """An arm and bodies as Pinocchio and coal see them.

    Args:
        file: the URDF.
        arm: the same, as planned.
        boxes: places of their middles, (n, 3), m.
        size: of each, or of all, m.
        mesh: a file and its place, (3,), m; None for none.
        packages: folders in which the folders of packages are.
    """

    def __init__(
        self,
        file: Path,
        arm: SpatialArm,
        boxes: FloatArray,
        size: FloatArray | tuple[float, float, float] = (SIZE,) * 3,
        mesh: tuple[Path, FloatArray] | None = None,
        packages: Sequence[str] = (str(ROBOTS.parents[1]),),
    ) -> None:
        import coal  # noqa: PLC0415 (extra)
        import pinocchio as pin  # noqa: PLC0415

        self.model, kind = pin.buildModelFromUrdf(str(file)), pin.GeometryType.COLLISION
        self.geometry = pin.buildGeomFromUrdf(self.model, str(file), kind, package_dirs=list(packages))
        self.data, own = self.model.createData(), len(self.geometry.geometryObjects)
        columns = [self.model.joints[self.model.getJointId(joint.name)] for joint in arm.chain.joints]
        self.columns = [(joint.idx_q, joint.nq) for joint in columns]
        base = self.model.getFrameId(arm.chain.base_link)
        self.base = pin.updateFramePlacement(self.model, self.data, base) if base else pin.SE3.Identity()
        pin.forwardKinematics(self.model, self.data, pin.neutral(self.model))
        self.base = pin.updateFramePlacement(self.model, self.data, base)
        sizes = np.broadcast_to(size, np.shape(boxes))
        bodies = [(coal.Box(*each), place) for each, place in zip(sizes, boxes, strict=True)]
        bodies += [] if mesh is None else [(coal.MeshLoader().load(str(mesh[0]), np.ones(3)), mesh[1])]
        for number, (body, place) in enumerate(bodies):
            pose = self.base * pin.SE3(np.eye(3), place)
            added = self.geometry.addGeometryObject(pin.GeometryObject(f"body {number}", 0, pose, body))
            for link in range(own):
                if self.geometry.geometryObjects[link].parentJoint in self._moved(arm):
                    self.geometry.addCollisionPair(pin.CollisionPair(link, added))
        self.geometry_data, self.pin = self.geometry.createData(), pin

    def _moved(self, arm: SpatialArm) -> set[int]:
        """Numbers of the joints of the arm, and of those that they carry."""
        own = (self.model.subtrees[self.model.getJointId(joint.name)] for joint in arm.chain.joints)
        return {int(number) for each in own for number in each}

    def configuration(self, theta: FloatArray) -> FloatArray:
        """Pinocchio's values of a posture (dof,): cosine and sine of joints that turn without end."""
        values = self.pin.neutral(self.model)
        for (column, size), angle in zip(self.columns, theta, strict=True):
            values[column : column + size] = angle if size == 1 else (np.cos(angle), np.sin(angle))
        return np.asarray(values)

    def distance(self, theta: FloatArray) -> float:
        """Of the arm's meshes from the bodies, m; 0 or less in contact."""
        self.pin.updateGeometryPlacements(
            self.model, self.data, self.geometry, self.geometry_data, self.configuration(theta)
        )
        self.pin.computeDistances(self.geometry, self.geometry_data)
        return float(min(found.min_distance for found in self.geometry_data.distanceResults))

    def least(self, arm: SpatialArm, trajectory: tp.Trajectory) -> float:
        """The smallest distance at all of ``TIMES``, m."""
        times = np.linspace(0.0, trajectory.duration, TIMES)
        postures, speeds = trajectory.at(times), np.abs(trajectory.at(trajectory.extreme_times(1), 1)).max(axis=0)
        assert arm.cover is not None
        levers = np.concatenate([arm.chain.levers(link.body, link.balls.centers) for link in arm.cover.links])
        fastest = float((levers @ speeds).max()) * times[1]  # m, from one to the next
        row, least = 0, np.inf
        while row < TIMES:
            distance = self.distance(postures[row])
            least = min(least, distance)
            row += max(1, int((distance - least) / fastest))
        return least


def ring(folder: Path) -> Path:
    """A mesh in a folder."""
    inner, outer, height = RING
    trimesh.creation.annulus(inner, outer, height).export(folder / "ring.stl")
    return folder / "ring.stl"


def scenes(arm: SpatialArm) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Starts, goals and places of boxes, and of a ring last, the same ones for the same arm."""
    low, high = np.clip(np.array(arm.position_limits), -np.pi, np.pi).T
    reach = 0.5 * arm.reach()[1]
    for seed in range(MOST_SCENES):
        rng = np.random.default_rng(seed)
        start, goal = rng.uniform(low, high, (2, arm.dof))
        yield start, goal, rng.uniform(-reach, reach, (BOXES + 1, 3)) + np.array([0.0, 0.0, reach / 2.0])


def planned(name: str) -> list[str]:
    """A certified plan among bodies, and what the meshes say of it."""
    with TemporaryDirectory() as folder:
        return _planned(name, ring(Path(folder)))


def _planned(name: str, file: Path) -> list[str]:
    arm, ends, plan = ARMS[name].robot.model, [], None
    for start, goal, places in scenes(arm):
        obstacles = [{"shape": "box", "center": list(place), "size": [SIZE] * 3} for place in places[:-1].tolist()]
        obstacles += [{"shape": "mesh", "file": str(file), "center": places[-1].tolist(), "name": "ring"}]
        keys = {"start": {"joints": list(start)}, "goal": {"joints": list(goal)}, "evaluations": EVALUATIONS}
        meshes, began = Meshes(ROBOTS / ARMS[name].file, arm, places[:-1], mesh=(file, places[-1])), time.perf_counter()
        try:
            plan = tp.plan(ARMS[name].robot, obstacles=obstacles, seed=1, **keys)
        except ScenarioError:
            continue
        (limit,) = (one for one in plan.motion.criteria.judged_limits if isinstance(one, CoverClearance))
        for posture in (start, goal):
            ends.append(meshes.distance(posture) - limit.clearances(posture[None], np.zeros(1))[0])
        if plan.certified:
            break
    if plan is None:
        return [name, f"none of {MOST_SCENES} scenes has ends without contact", *[""] * (len(PLANS) - 2)]
    seconds, trajectory = time.perf_counter() - began, plan.motion.trajectory
    least = meshes.least(arm, trajectory)
    proven = next(verdict.worst for verdict in plan.motion.verdicts if verdict.name == "clearance")
    figures = (f"{1e3 * length:.1f}" for length in (proven, least))
    differs = f"{1e3 * min(ends):.2f} to {1e3 * max(ends):.2f} ({len(ends)})"
    return [name, plan.motion.status.value, f"{trajectory.duration:.3f}", f"{seconds:.1f}", *figures, differs]


PLANS = ("arm", "plan", "T s", "seconds", "proven mm", "meshes mm", "ends: meshes less verdict, mm")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arms", default=",".join(ARMS), help="names, with commas between them")
    parser.add_argument("--plans", default="", help="names of arms for which to plan")
    options = parser.parse_args()
    if options.plans:
        print_rows(PLANS, map(planned, options.plans.split(",")))
    else:
        print_rows(HEADER, map(row, options.arms.split(",")))


if __name__ == "__main__":
    main()
