"""Covers and looks of the built-in robots, made anew from the makers' meshes, none of which is in this repository.

Those of the Panda are in example-robot-data. It has none of a UR5e (a UR5 is another arm) and none of an iiwa: their
meshes are looked for in ``ur_description`` (Universal_Robots_ROS2_Description) and ``iiwa_description`` (iiwa_stack) in
the folders of ``ROS_PACKAGE_PATH``. Covers are those of the collision meshes, enlarged by less than a millimetre until
they hold the visual meshes too: covers of both at once would have up to four times as many balls. Looks are surfaces of
the fine covers, in few triangles.

    ROS_PACKAGE_PATH=FOLDER-OF-PACKAGES python -m benchmarks.built_in_covers
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import problems.robots
from benchmarks.off_the_shelf import ROBOTS
from problems.base import FloatArray
from problems.geometry import Balls, Cover, cover_of, read_mesh, unheld
from problems.robots import LinkCover, MeshShape, appearance_text, covers_text
from problems.robots.appearance import Visual, new_appearances

MODELS = Path(problems.robots.__file__).with_name("models")
COARSE, FINE = 0.02, 0.002  # m, as of a URDF
GROWTH = 2.0**-13  # m, by which balls are enlarged at a time
OPENING = 0.04  # m, of each finger of the Panda
CELL, SPARE = 0.004, 0.001  # m: of the lattice on which a look is found; how deep it lies in the cover
WHITE, GREY, BLUE, ORANGE = "#e9ecef", "#4a4f57", "#8fb8d6", "#f0883e"
PANDA = [f"link{number}" for number in range(8)]
UR5E = {
    "base": ("base_link", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "shoulder": ("shoulder_link", (0.0, 0.0, 0.0), (0.0, 0.0, 180.0)),
    "upperarm": ("upper_arm_link", (0.0, 0.0, 0.138), (90.0, 0.0, -90.0)),
    "forearm": ("forearm_link", (0.0, 0.0, 0.007), (90.0, 0.0, -90.0)),
    "wrist1": ("wrist_1_link", (0.0, 0.0, -0.127), (90.0, 0.0, 0.0)),
    "wrist2": ("wrist_2_link", (0.0, 0.0, -0.0997), (0.0, 0.0, 0.0)),
    "wrist3": ("wrist_3_link", (0.0, 0.0, -0.0989), (90.0, 0.0, 0.0)),
}
SPANNING = ("upperarm", "forearm")  # whose collision meshes are not the arm: they span the gaps beside its tubes
OPEN_ENDS = {  # where a visual mesh is open: centers and radii of discs that close it, and their axes
    "forearm": [((0, 0, 0.063), 0.0478, 2), ((0, 0, 0.076), 0.0478, 2), ((0, 0.053, 0.3925), 0.0372, 1),
                ((0, 0.053, 0), 0.058, 1)]
}  # fmt: skip


class NoMeshes(Exception):
    """The meshes of a maker are not on this machine."""


def corners_of(path: Path) -> FloatArray:
    """The triangles of a mesh, (n, 3, 3), m."""
    return read_mesh(path.name, path.read_bytes()).corners


@dataclass(frozen=True, eq=False)
class Meshes:
    """The triangles of a link, (n, 3, 3), m: of its collision geometry, and of what is seen of it besides."""

    collision: FloatArray
    visual: FloatArray


def panda() -> dict[str, Meshes]:
    """The meshes of the Panda's links, the hand with its fingers at all openings."""
    folder = ROBOTS / "panda_description" / "meshes"
    if not folder.is_dir():
        raise NoMeshes("example-robot-data is not installed")

    def meshes(name: str) -> Meshes:
        return Meshes(corners_of(folder / "collision" / f"{name}.stl"), corners_of(folder / "visual" / f"{name}.dae"))

    hand, finger = meshes("hand"), meshes("finger")
    with_fingers = [
        np.concatenate([one, left, left * np.array([-1.0, -1.0, 1.0])])
        for one, other in ((hand.collision, finger.collision), (hand.visual, finger.visual))
        for left in [swept(other + np.array([0.0, 0.0, 0.0584]), np.array([0.0, OPENING, 0.0]))]
    ]
    return {f"panda_{name}": meshes(name) for name in PANDA} | {"panda_hand": Meshes(*with_fingers)}


def swept(corners: FloatArray, way: FloatArray) -> FloatArray:
    """The surfaces of the prisms that triangles pass over on a straight way."""
    ends = corners + way
    sides = [
        [corners[:, one], corners[:, two], ends[:, two], corners[:, one], ends[:, two], ends[:, one]]
        for one, two in ((0, 1), (1, 2), (2, 0))
    ]
    return np.concatenate([corners, ends, *(np.stack(side, axis=1).reshape(-1, 3, 3) for side in sides)])


def ur5e() -> dict[str, Meshes]:
    """The meshes of the UR5e's links; of those that are named ``SPANNING`` the visual ones alone."""
    folder, meshes = package("ur_description") / "meshes" / "ur5e", {}
    for name, (link, place, angles) in UR5E.items():
        turn = Rotation.from_euler("xyz", angles, degrees=True).as_matrix().T
        visual = corners_of(folder / "visual" / f"{name}.dae") @ turn + place
        if name in SPANNING:
            ends = [disc(*end) @ turn + place for end in OPEN_ENDS.get(name, ())]
            meshes[link] = Meshes(np.concatenate([visual, *ends]), visual)
        else:
            meshes[link] = Meshes(corners_of(folder / "collision" / f"{name}.stl") @ turn + place, visual)
    return meshes


def disc(center: tuple[float, ...], radius: float, axis: int, corners: int = 48) -> FloatArray:
    """The triangles of a disc across an axis of the frame."""
    angles = np.linspace(0.0, 2.0 * np.pi, corners + 1)
    rim = center + radius * (
        np.outer(np.cos(angles), np.eye(3)[(axis + 1) % 3]) + np.outer(np.sin(angles), np.eye(3)[(axis + 2) % 3])
    )
    return np.stack([np.broadcast_to(center, (corners, 3)), rim[:-1], rim[1:]], axis=1)


def iiwa14() -> dict[str, Meshes]:
    """The meshes of the iiwa's links."""
    folder = package("iiwa_description") / "meshes" / "iiwa14"
    return {
        f"iiwa_link_{n}": Meshes(*(corners_of(folder / kind / f"link_{n}.stl") for kind in ("collision", "visual")))
        for n in range(8)
    }


def package(name: str) -> Path:
    """The folder of a ROS package, where it is."""
    folders = [Path(folder) / name for folder in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if folder]
    found = next((folder for folder in folders if (folder / "meshes").is_dir()), None)
    if found is None:
        raise NoMeshes(f"{name} is not in ROS_PACKAGE_PATH")
    return found


MESHES = {"panda": panda, "ur5e": ur5e, "iiwa14": iiwa14}
COLOURS = {
    "panda": {"panda_hand": GREY},
    "ur5e": {f"wrist_{number}_link": BLUE for number in (1, 2)} | {"shoulder_link": BLUE, "base_link": GREY},
    "iiwa14": {f"iiwa_link_{number}": GREY for number in (0, 7)} | {"iiwa_link_6": ORANGE},
}


def surface(balls: Balls) -> FloatArray:
    """The triangles of a surface ``SPARE`` deep in balls, by the middles of the cells of a lattice that it cuts."""
    low = (balls.centers - balls.radii[:, None]).min(axis=0) - 2.0 * CELL
    high = (balls.centers + balls.radii[:, None]).max(axis=0) + 2.0 * CELL
    depths = np.full(tuple(ceil(side / CELL) + 1 for side in high - low), -CELL)
    for center, radius in zip(balls.centers, balls.radii.tolist(), strict=True):
        first = np.maximum(((center - low - radius) / CELL).astype(int) - 1, 0)
        last = ((center - low + radius) / CELL).astype(int) + 3
        part = tuple(slice(one, two) for one, two in zip(first, last, strict=True))
        axes = [low[axis] + CELL * np.arange(depths.shape[axis])[part[axis]] - center[axis] for axis in range(3)]
        away = np.sqrt(sum(square for square in np.ix_(*(axis**2 for axis in axes))))
        depths[part] = np.maximum(depths[part], radius - away)
    return low + CELL * np.concatenate(list(_quads(depths - SPARE)))


def _quads(depths: FloatArray) -> Iterator[FloatArray]:
    """Triangles (n, 3, 3) in cells, around each edge of the lattice that leaves the body."""
    sums, counts = np.zeros((*depths.shape, 3)), np.zeros(depths.shape)
    crossings = []
    for axis in range(3):
        near, far = (np.delete(depths, end, axis) for end in (-1, 0))
        edges = np.argwhere((near > 0.0) != (far > 0.0))
        share = near[tuple(edges.T)] / (near[tuple(edges.T)] - far[tuple(edges.T)])
        points = edges + np.outer(share, np.eye(3)[axis])
        one, two = (np.eye(3, dtype=int)[(axis + step) % 3] for step in (1, 2))
        cells = [edges - shift for shift in (0 * one, one, one + two, two)]
        for each in cells:
            np.add.at(sums, tuple(each.T), points)
            np.add.at(counts, tuple(each.T), 1.0)
        crossings.append((cells, near[tuple(edges.T)] > 0.0))
    for cells, leaves in crossings:
        corners = np.stack([sums[tuple(each.T)] / counts[tuple(each.T)][:, None] for each in cells], axis=1)
        corners[~leaves] = corners[~leaves, ::-1]
        yield corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3, 3)


def stl(corners: FloatArray) -> bytes:
    """The binary STL file of triangles."""
    rows = np.zeros(len(corners), dtype=[("normal", "<3f4"), ("corners", "<9f4"), ("more", "<u2")])
    rows["corners"] = corners.reshape(-1, 9)
    return bytes(80) + struct.pack("<I", len(corners)) + rows.tobytes()


def cover_of_both(meshes: Meshes, overhang: float) -> Cover:
    """The cover of collision meshes, its balls enlarged until they hold the visual ones; the volume is that before."""
    cover, more = cover_of(meshes.collision, overhang), 0.0
    while len(unheld(meshes.visual, cover.balls.shrunk(-more))):
        more += GROWTH
    return replace(
        cover,
        balls=cover.balls.shrunk(-more),
        usual_overhang=cover.usual_overhang + more,
        largest_overhang=cover.largest_overhang + more,
    )


def main() -> None:
    for name, meshes in MESHES.items():
        both = {link: [cover_of_both(own, overhang) for overhang in (COARSE, FINE)] for link, own in meshes().items()}
        visuals = {link: [Visual(MeshShape(file=link + ".stl"), COLOURS[name].get(link, WHITE))] for link in both}
        files = {link + ".stl": stl(surface(fine.balls)) for link, (_, fine) in both.items()}
        looks, notes = new_appearances(visuals, {}, lambda shape, files=files: files[shape.file])
        assert not notes
        covers = [LinkCover(link, COARSE, *own) for link, own in both.items()]
        for kind, text in (("covers", covers_text(covers)), ("looks", appearance_text(looks))):
            (MODELS / f"{name}-{kind}.json").write_text(text + "\n")
        coarse, fine = (sum(len(own[number].balls) for own in both.values()) for number in (0, 1))
        most = 1e3 * max(fine.largest_overhang for _, fine in both.values())
        print(f"{name}: {coarse} coarse and {fine} fine balls, which stick out by {most:.2f} mm")


if __name__ == "__main__":
    main()
