"""Arms of URDF, xacro and MJCF files: what is read, what covers cost, and a plan checked on the meshes.

Every arm moves between two random postures among a few boxes. Pinocchio and coal (extra ``oracles``), for MJCF MuJoCo
and coal, then look for contacts of the file's own meshes with the boxes, and of links that are kept apart with each
other, at 5,000 times. Links that touch at almost all postures may touch, and are named.
Covers are made anew; packages are those of ``ROS_PACKAGE_PATH``, whose entries hold a folder for each.

    python -m benchmarks.arms FOLDER...
"""

from __future__ import annotations

import argparse
import json
import os
import re
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import numpy as np

import tpbso_casadi as tp
from benchmarks.off_the_shelf import Meshes, print_rows
from problems import InvalidProblem
from problems.base import FloatArray, cache
from problems.library import needed_core
from problems.limits import touching_links
from problems.robots import LinkCover, SpatialArm, covers_text
from tpbso_casadi.facade.robots import StatedRobot
from tpbso_casadi.scenario import InputFolder, ScenarioError, SpatialRobotSection, read_table

TIMES = 5_000
BOXES, SHARE = 5, 0.08  # in a scene; their side as a share of the reach
MOST_SCENES = 40  # that are drawn until one has ends without contact
MIDDLE = 0.6  # of the joints' ranges, in which postures are drawn: near their ends, arms fold into themselves
MOST_PLANS = 3  # until one is certified
EVALUATIONS = 300
LIMITS = {"max_speed": 1.5, "max_acceleration": 4.0}  # rad/s or m/s, and a second
HEADER = ("arm", "tip", "joints", "CPU s", "coarse", "fine", "sticks out mm", "plan", "T s", "contacts")


@dataclass(frozen=True)
class CoveredArm:
    """An arm whose links are covered.

    Attributes:
        file: its URDF, xacro or MJCF.
        robot: as it is planned with.
        covers: of its links, by their names.
        seconds: CPU time of the covers.
    """

    file: Path
    robot: StatedRobot
    covers: dict[str, LinkCover]
    seconds: float

    @classmethod
    def read(cls, file: Path, keys: Mapping[str, Any]) -> CoveredArm:
        """The arm that a file describes, with keys of [robot].

        Raises:
            InvalidProblem: it cannot be covered.
            ScenarioError: it cannot be read.
        """
        folder = InputFolder(Path(), outside_allowed=True)
        table = read_table(SpatialRobotSection, "robot", {"urdf": str(file), **LIMITS, **keys}).with_texts(folder)
        description, read = table.description(), table.meshes(folder)
        for kept in Path(os.environ[cache.VARIABLE]).glob("*.cover"):
            kept.unlink()
        began = time.process_time()
        covers, _ = description.new_covers(read, ignored=keys.get("ignore_geometry", ()))
        seconds = time.process_time() - began
        stated = table.replaced(covers_text=covers_text(covers.values())) if covers else table
        return cls(file, StatedRobot(stated), covers, seconds)

    @property
    def figures(self) -> list[str]:
        """Names and numbers of the arm and its covers; sizes of what joints move."""
        table = self.robot.table
        assert isinstance(table, SpatialRobotSection)
        described = table.description()
        moved = {frame.name for frame in described.links if frame.body}
        fine = {link: cover.fine for link, cover in self.covers.items() if cover.fine is not None}
        most = max((cover.largest_overhang for link, cover in fine.items() if link in moved), default=0.0)
        counts = str(len(described.spheres)), str(sum(len(cover.balls) for cover in fine.values()))
        names = label(self.file), described.chain.tip_link, str(len(described.chain.joints))
        return [*names, f"{self.seconds:.1f}", *counts, f"{1e3 * most:.2f}"]

    def referee(self, arm: SpatialArm, places: FloatArray, side: float) -> Referee:
        """The library that looks for contacts with boxes at places (n, 3), m, and sides, m."""
        if self.file.suffix == ".xml":
            return MujocoReferee(self.file, arm, places, side)
        table = self.robot.table
        assert isinstance(table, SpatialRobotSection) and table.urdf_text is not None
        with TemporaryDirectory() as folder:
            expanded = Path(folder) / "robot.urdf"
            expanded.write_text(table.urdf_text)
            packages = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
            file = self.file if self.file.suffix == ".urdf" else expanded
            return PinocchioReferee(file, arm, places, np.full((len(places), 3), side), packages)

    def letting_touch(self) -> tuple[CoveredArm, list[tuple[str, str]]]:
        """The arm in which links may touch that do at almost all postures, and the names of these."""
        table, model = self.robot.table, self.robot.model
        assert isinstance(table, SpatialRobotSection)
        pairs = [] if model.cover is None else touching_links(replace(model, self_collision=True))
        return replace(self, robot=StatedRobot(table.replaced(disabled_pairs=pairs))), pairs


class Referee(Protocol):
    """A library that knows the file's own meshes."""

    def touches(self, posture: FloatArray) -> bool:
        """Whether, in a posture (dof,), the meshes touch a box, or links that are kept apart each other."""


class PinocchioReferee:
    """The meshes of a URDF, as Pinocchio and coal see them."""

    def __init__(
        self, file: Path, arm: SpatialArm, places: FloatArray, sizes: FloatArray, packages: Sequence[str]
    ) -> None:
        self.meshes = meshes = Meshes(file, arm, places, sizes, packages=packages)
        owners: dict[str, list[int]] = {}
        for number, body in enumerate(meshes.geometry.geometryObjects):
            if body.parentFrame < meshes.model.nframes:  # a box has none
                owners.setdefault(meshes.model.frames[body.parentFrame].name, []).append(number)
        ignored = {number for link in arm.left_out.links for number in owners.get(link, ())}
        beside = [(pair.first, pair.second) for pair in meshes.geometry.collisionPairs]
        meshes.geometry.removeAllCollisionPairs()
        for first, second in (*(pair for pair in beside if not {*pair} & ignored), *_apart(arm, owners)):
            meshes.geometry.addCollisionPair(meshes.pin.CollisionPair(first, second))
        self.data = meshes.geometry.createData()

    def touches(self, posture: FloatArray) -> bool:
        meshes = self.meshes
        values = meshes.configuration(posture)
        return bool(meshes.pin.computeCollisions(meshes.model, meshes.data, meshes.geometry, self.data, values, True))


class MujocoReferee:
    """The meshes of an MJCF, where MuJoCo reads and places them, as coal sees them: MuJoCo itself takes their hulls."""

    def __init__(self, file: Path, arm: SpatialArm, places: FloatArray, side: float) -> None:
        import coal  # noqa: PLC0415 (extra)
        import mujoco  # noqa: PLC0415 (of nobody's extra)

        self.coal, self.mujoco = coal, mujoco
        self.model = model = mujoco.MjModel.from_xml_path(str(file))
        self.data, self.posture = mujoco.MjData(model), model.qpos0.copy()
        for name, value in arm.locked:
            self.posture[model.joint(name).qposadr[0]] = value
        self.columns = [model.joint(joint.name).qposadr[0] for joint in arm.chain.joints]
        self.boxes = [(coal.Box(side, side, side), coal.Transform3s(np.eye(3), place)) for place in places]
        self.box_radius, self.places = np.sqrt(3.0) * side / 2.0, places
        colliding = np.flatnonzero((model.geom_contype != 0) | (model.geom_conaffinity != 0)).tolist()
        self.bodies = {geom: self._body(geom) for geom in colliding}
        owners: dict[str, list[int]] = {}
        for geom in colliding:
            owners.setdefault(model.body(model.geom_bodyid[geom]).name or "world", []).append(geom)
        self.pairs = np.array(_apart(arm, owners), dtype=int).reshape(-1, 2)
        first = model.joint(arm.chain.joints[0].name).bodyid[0]
        self.moved = [geom for geom in colliding if first in self._carriers(model.geom_bodyid[geom])]

    def _carriers(self, body: int) -> set[int]:
        carriers = {int(body)}
        while body:
            body = self.model.body_parentid[body]
            carriers.add(int(body))
        return carriers

    def _body(self, geom: int) -> Any:
        coal, model, size = self.coal, self.model, self.model.geom_size[geom]
        kind = self.mujoco.mjtGeom(model.geom_type[geom]).name
        if kind != "mjGEOM_MESH":
            radius, half = float(size[0]), 2.0 * float(size[1])
            makers = {
                "mjGEOM_SPHERE": lambda: coal.Sphere(radius),
                "mjGEOM_CAPSULE": lambda: coal.Capsule(radius, half),
                "mjGEOM_CYLINDER": lambda: coal.Cylinder(radius, half),
                "mjGEOM_BOX": lambda: coal.Box(*(2.0 * size)),
                "mjGEOM_ELLIPSOID": lambda: coal.Ellipsoid(*size),
            }
            return makers[kind]()
        mesh = model.geom_dataid[geom]
        corner, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
        found = coal.BVHModelOBBRSS()
        found.beginModel(int(model.mesh_facenum[mesh]), int(model.mesh_vertnum[mesh]))
        found.addVertices(model.mesh_vert[corner : corner + model.mesh_vertnum[mesh]].astype(float))
        found.addTriangles(model.mesh_face[face : face + model.mesh_facenum[mesh]].astype(np.int64))
        found.endModel()
        return found

    def touches(self, posture: FloatArray) -> bool:
        self.posture[self.columns] = posture
        self.data.qpos[:] = self.posture
        self.mujoco.mj_kinematics(self.model, self.data)
        centers, radii = self.data.geom_xpos, self.model.geom_rbound
        one, two = self.pairs.T
        near = np.linalg.norm(centers[one] - centers[two], axis=1) <= radii[one] + radii[two]
        own = ((self._placed(a), self._placed(b)) for a, b in self.pairs[near].tolist())
        beside = (
            (self._placed(geom), self.boxes[box])
            for geom in self.moved
            for box in np.flatnonzero(
                np.linalg.norm(self.places - centers[geom], axis=1) <= self.box_radius + radii[geom]
            ).tolist()
        )
        request = self.coal.CollisionRequest()
        return any(
            self.coal.collide(*first, *second, request, self.coal.CollisionResult())
            for first, second in (*own, *beside)
        )

    def _placed(self, geom: int) -> tuple[Any, Any]:
        pose = self.coal.Transform3s(self.data.geom_xmat[geom].reshape(3, 3), self.data.geom_xpos[geom])
        return self.bodies[geom], pose


def _apart(arm: SpatialArm, owners: Mapping[str, Sequence[int]]) -> list[tuple[int, int]]:
    """Numbers of the bodies of links that are kept apart."""
    if arm.cover is None:
        balls = (*arm.kept_pairs, *arm.proven_pairs)
        names = {(arm.spheres[one].name, arm.spheres[two].name) for one, two in balls}
    else:
        names = {(arm.cover.links[one].name, arm.cover.links[two].name) for one, two in arm.cover.pairs}
    return [(a, b) for one, two in names for a in owners.get(one, ()) for b in owners.get(two, ())]


def contacts(referee: Referee, trajectory: tp.Trajectory, count: int = TIMES) -> int:
    """At how many of so many times the meshes touch a box, or links that are kept apart each other."""
    return sum(map(referee.touches, trajectory.at(np.linspace(0.0, trajectory.duration, count))))


def scenes(arm: SpatialArm) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Starts, goals and places of boxes, the same ones for the same arm."""
    low, high = np.clip(np.array(arm.position_limits), -np.pi, np.pi).T
    low, high = (low + high) / 2.0 + MIDDLE * np.outer((-0.5, 0.5), high - low)
    reach = 0.5 * arm.reach()[1]
    for seed in range(MOST_SCENES):
        rng = np.random.default_rng(seed)
        start, goal = rng.uniform(low, high, (2, arm.dof))
        yield start, goal, rng.uniform(-reach, reach, (BOXES, 3)) + np.array([0.0, 0.0, reach / 2.0])


def planned(covered: CoveredArm) -> list[str]:
    """Of how many plans among boxes the first was certified, its duration, and contacts of the meshes."""
    arm: Any = covered.robot.model
    side, reason, tried = SHARE * arm.reach()[1], "no scene was drawn", 0
    for start, goal, places in scenes(arm):
        obstacles = [{"shape": "box", "center": place, "size": [side] * 3} for place in places.tolist()]
        keys = {"start": {"joints": list(start)}, "goal": {"joints": list(goal)}, "evaluations": EVALUATIONS}
        try:
            plan = tp.plan(covered.robot, obstacles=obstacles, seed=1, **keys)
        except ScenarioError as error:
            reason = str(error)
            continue
        trajectory = plan.motion.trajectory
        tried += 1
        if not plan.certified and tried < MOST_PLANS:
            continue
        if not plan.certified:
            return [f"none of {tried} certified", "", ""]
        found = contacts(covered.referee(arm, places, side), trajectory)
        return [f"certified, of {tried}", f"{trajectory.duration:.2f}", f"{found} of {TIMES}"]
    return [f"none of {MOST_SCENES} scenes: {reason}", "", ""]


def label(file: Path) -> str:
    """What a file is called: by its folder, or that of its package, and its name."""
    folder = next(parent.name for parent in file.absolute().parents if parent.name not in ("urdf", "robots"))
    return f"{folder}/{file.name.removesuffix('.urdf')}"


def advised(error: Exception, keys: Mapping[str, Any]) -> dict[str, Any]:
    """The keys that a refusal advises besides some: the first of several arms, or links that follow joints left out."""
    tip, links = (re.search(pattern, str(error)) for pattern in (r"chains end at '([^']+)'", r'geometry = (\[".*"\])'))
    ignored = keys.get("ignore_geometry", [])
    return {"tip_link": tip[1]} if tip else {"ignore_geometry": [*ignored, *json.loads(links[1])]} if links else {}


def row(file: Path, **keys: Any) -> list[str]:
    """What is known of a file in the end; where it is refused with advice, of the robot as it is advised."""
    try:
        covered = CoveredArm.read(file, keys)
        planning, pairs = covered.letting_touch()
    except (InvalidProblem, ScenarioError) as error:
        advice = advised(error, keys)
        return (
            row(file, **{**keys, **advice}) if advice else [label(file), f"refused: {error}", *[""] * (len(HEADER) - 2)]
        )
    try:
        verdict, *rest = planned(planning)
    except ValueError as error:  # Pinocchio reads no such file
        return [*covered.figures, "certified", "", f"not looked for: {error}"]
    touching = ", ".join(f"{one} and {two}" for one, two in pairs)
    verdict += "".join(f"; {key} = {json.dumps(value)}" for key, value in keys.items())
    return [*covered.figures, verdict + (f"; may touch: {touching}" if pairs else ""), *rest]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", type=Path, metavar="FOLDER", help="files, or folders of URDF files")
    paths = parser.parse_args().paths
    files = [file for path in paths for file in ([path] if path.is_file() else sorted(path.rglob("*.urdf")))]
    needed_core()
    with TemporaryDirectory() as folder:
        os.environ[cache.VARIABLE] = folder
        print_rows(HEADER, map(row, files))


if __name__ == "__main__":
    main()
