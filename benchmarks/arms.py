"""Arms of URDF files, as many as there are: what is read, what covers cost, and a plan checked on the meshes.

Every arm moves between two random postures among a few boxes. Pinocchio and coal (extra ``oracles``) then look for
contacts of the file's own meshes with the boxes, and of links that are kept apart with each other, at 5,000 times.
Links that touch at almost all postures may touch, and are named.
Covers are made anew; packages are those of ``ROS_PACKAGE_PATH``, whose entries hold a folder for each.

    python -m benchmarks.arms FOLDER...
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

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
BOXES, SHARE = 3, 0.06  # in a scene; their side as a share of the reach
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
        file: its URDF.
        robot: as it is planned with.
        covers: of its links, by their names.
        seconds: CPU time of the covers.
    """

    file: Path
    robot: StatedRobot
    covers: dict[str, LinkCover]
    seconds: float

    @classmethod
    def read(cls, file: Path) -> CoveredArm:
        """The arm that a URDF describes.

        Raises:
            InvalidProblem: it cannot be covered.
            ScenarioError: it cannot be read.
        """
        folder = InputFolder(Path(), outside_allowed=True)
        table = read_table(SpatialRobotSection, "robot", {"urdf": str(file)} | LIMITS).with_texts(folder)
        description, read = table.description(), table.meshes(folder)
        began = time.process_time()
        covers, _ = description.new_covers(read)
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
        names = self.file.stem, described.chain.tip_link, str(len(described.chain.joints))
        return [*names, f"{self.seconds:.1f}", *counts, f"{1e3 * most:.2f}"]

    def letting_touch(self) -> tuple[CoveredArm, list[tuple[str, str]]]:
        """The arm in which links may touch that do at almost all postures, and the names of these."""
        table, model = self.robot.table, self.robot.model
        assert isinstance(table, SpatialRobotSection)
        pairs = touching_links(replace(model, self_collision=True))
        return replace(self, robot=StatedRobot(table.replaced(disabled_pairs=pairs))), pairs


def contacts(arm: SpatialArm, meshes: Meshes, trajectory: tp.Trajectory) -> int:
    """At how many times the meshes touch a box, or links that are kept apart each other."""
    geometry, pin, cover = meshes.geometry, meshes.pin, arm.cover
    assert cover is not None
    owners: dict[str, list[int]] = {}
    for number, body in enumerate(geometry.geometryObjects):
        if body.parentFrame < meshes.model.nframes:  # a box has none
            owners.setdefault(meshes.model.frames[body.parentFrame].name, []).append(number)
    for one, two in cover.pairs:
        for first in owners.get(cover.links[one].name, []):
            for second in owners.get(cover.links[two].name, []):
                geometry.addCollisionPair(pin.CollisionPair(first, second))
    data, found = geometry.createData(), 0
    for posture in trajectory.at(np.linspace(0.0, trajectory.duration, TIMES)):
        found += pin.computeCollisions(meshes.model, meshes.data, geometry, data, meshes.configuration(posture), True)
    return found


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
        packages = os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)
        trajectory = plan.motion.trajectory
        tried += 1
        if not plan.certified and tried < MOST_PLANS:
            continue
        if not plan.certified:
            return [f"none of {tried} certified", "", ""]
        meshes = Meshes(covered.file, arm, places, (side,) * 3, packages=packages)
        found = contacts(arm, meshes, trajectory)
        return [f"certified, of {tried}", f"{trajectory.duration:.2f}", f"{found} of {TIMES}"]
    return [f"none of {MOST_SCENES} scenes: {reason}", "", ""]


def row(file: Path) -> list[str]:
    """What is known of a file in the end."""
    try:
        covered = CoveredArm.read(file)
    except (InvalidProblem, ScenarioError) as error:
        return [file.stem, f"refused: {error}", *[""] * (len(HEADER) - 2)]
    try:
        planning, pairs = covered.letting_touch()
        verdict, *rest = planned(planning)
    except (InvalidProblem, ScenarioError) as error:
        return [*covered.figures, f"refused: {error}", "", ""]
    except ValueError as error:  # Pinocchio reads no such file
        return [*covered.figures, "certified", "", f"not looked for: {error}"]
    touching = ", ".join(f"{one} and {two}" for one, two in pairs)
    return [*covered.figures, verdict + (f"; may touch: {touching}" if pairs else ""), *rest]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+", type=Path, metavar="FOLDER", help="URDF files, or folders of them")
    paths = parser.parse_args().paths
    files = [file for path in paths for file in ([path] if path.is_file() else sorted(path.rglob("*.urdf")))]
    needed_core()
    with TemporaryDirectory() as folder:
        os.environ[cache.VARIABLE] = folder
        print_rows(HEADER, map(row, files))


if __name__ == "__main__":
    main()
