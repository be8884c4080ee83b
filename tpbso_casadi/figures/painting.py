"""Bodies in space, painted from back to front.

Of two things that a plane parts, the one on the eye's side of it is never covered by the other.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from problems.base import FloatArray
from tpbso_casadi.figures.palette import OBSTACLE
from tpbso_casadi.figures.space_scene import Polyhedron, Scene, View


def painting_order(
    view: View,
    centers: FloatArray,
    radii: FloatArray,
    solids: Sequence[Polyhedron],
    planes: dict[tuple[int, int], int],
) -> list[int]:
    """Numbers of things, the first to be painted first: balls 0, 1, ..., then solids.

    Args:
        view: where they are seen from.
        centers: of the balls, (n, 3), m.
        radii: of the balls, (n,), m.
        solids: that no ball is in.
        planes: that part the solids, of :func:`separating_planes`.
    """
    boxes = np.array([*_ball_boxes(view, centers, radii), *(_solid_box(view, solid) for solid in solids)])
    lower, upper = boxes.reshape(-1, 2, 2).transpose(1, 0, 2)
    overlap = ((lower[:, None] < upper) & (lower < upper[:, None])).all(axis=2)
    depths = view.depth(np.vstack([centers, *(solid.center[None] for solid in solids)]))
    before = overlap & _behind(view, centers, solids, planes, depths)
    return _sorted(before, np.argsort(depths).tolist())


def _behind(
    view: View,
    centers: FloatArray,
    solids: Sequence[Polyhedron],
    planes: dict[tuple[int, int], int],
    depths: FloatArray,
) -> np.ndarray:
    """Whether a thing (row) is behind another (column)."""
    balls = len(centers)
    behind = depths[:, None] < depths
    seen = [view.sees(solid.normals, solid.offsets) for solid in solids]
    for number, solid in enumerate(solids, start=balls):
        if balls:
            in_front = seen[number - balls][solid.beyond(centers).argmax(axis=1)]
            behind[number, :balls], behind[:balls, number] = in_front, ~in_front
    for (a, b), face in planes.items():
        behind[balls + a, balls + b] = seen[a][face]
        behind[balls + b, balls + a] = not seen[a][face]
    return behind


def _ball_boxes(view: View, centers: FloatArray, radii: FloatArray) -> FloatArray:
    middles = view.project(centers)
    seen = (radii * view.magnification(centers))[:, None]
    return np.stack([middles - seen, middles + seen], axis=1)


def _solid_box(view: View, solid: Polyhedron) -> FloatArray:
    seen = view.project(solid.vertices)
    return np.array([seen.min(axis=0), seen.max(axis=0)])


def _sorted(before: np.ndarray, numbers: list[int]) -> list[int]:
    """The numbers so that each comes after all that must be before it, unless these go round in a circle."""
    needed = [np.flatnonzero(column).tolist() for column in before.T]
    placed: dict[int, None] = {}
    visited = np.zeros(len(numbers), dtype=bool)
    for first in numbers:
        stack = [first]
        while stack:
            number = stack[-1]
            if not visited[number]:
                visited[number] = True
                stack += [other for other in needed[number] if not visited[other]]
            else:
                placed.setdefault(stack.pop())
    return list(placed)


LIGHT = np.array([-0.35, 0.45, 0.82])  # in the axes of the view
ROUND = np.linspace(0.0, 2.0 * np.pi, 28, endpoint=False)
LAYERS = ((1.0, 0.0), (0.8, 0.22), (0.55, 0.42), (0.28, 0.62))  # of a ball: size, and how far it is lit
FACE_ALPHA, BACK_ALPHA, EDGE_ALPHA = 0.30, 0.12, 0.55

Painted = tuple[FloatArray, tuple[float, ...], tuple[float, ...]]  # corners (n, 2), colours of face and edge with alpha


class Painting:
    """Balls and solids in a picture.

    Args:
        axes: of the picture.
        view: from where.
        scene: robot and obstacles.
        colour: of the balls.
    """

    def __init__(self, axes: Axes, view: View, scene: Scene, colour: str) -> None:
        self._view, self._scene, self._colour = view, scene, colour
        self._painted = [list(solid(view, polyhedron)) for polyhedron in scene.solids]
        self._collection = PolyCollection([], linewidths=0.7, zorder=2)
        axes.add_collection(self._collection, autolim=False)

    def show(self, centers: FloatArray, time: float = 0.0) -> None:
        """Show a posture by its balls' centres (balls, 3), m, and the obstacles at a time in s."""
        radii, scene = self._scene.radii, self._scene
        solids = scene.solids_at(time)
        for number in scene.moving:
            self._painted[number] = list(solid(self._view, solids[number]))
        painted: list[Painted] = []
        for number in painting_order(self._view, centers, radii, solids, scene.planes_of(solids)):
            if number < len(centers):
                painted += ball(self._view, centers[number], float(radii[number]), self._colour)
            else:
                painted += self._painted[number - len(centers)]
        polygons, faces, edges = zip(*painted, strict=True) if painted else ((), (), ())
        self._collection.set_verts(polygons)
        self._collection.set_facecolor(list(faces))
        self._collection.set_edgecolor(list(edges))


def ball(view: View, center: FloatArray, radius: float, colour: str) -> Iterator[Painted]:
    """A ball, lit from above."""
    middle, size = view.project(center), radius * float(view.magnification(center))
    circle, base = np.column_stack([np.cos(ROUND), np.sin(ROUND)]), np.array(to_rgb(colour))
    for share, lit in LAYERS:
        shown = (*(base + (1.0 - base) * lit), 1.0)
        edge = (*(0.75 * base), 0.5) if share == 1.0 else (0.0, 0.0, 0.0, 0.0)
        yield middle + size * (share * circle + 0.6 * (1.0 - share) * LIGHT[:2]), shown, edge


def solid(view: View, polyhedron: Polyhedron, opacity: float = 1.0) -> Iterator[Painted]:
    """An obstacle that can be seen through: the faces behind, then those before, each with its edges."""
    seen = view.sees(polyhedron.normals, polyhedron.offsets)
    corners, base = view.project(polyhedron.vertices), np.array(to_rgb(OBSTACLE))
    shades = 0.72 + 0.28 * np.minimum(np.abs(polyhedron.normals @ view.axes.T @ LIGHT), 1.0)
    for front, alpha in ((False, BACK_ALPHA), (True, FACE_ALPHA)):
        for number, face in enumerate(polyhedron.faces):
            if seen[number] == front:
                yield corners[list(face)], (*(base * shades[number]), opacity * alpha), (0.0, 0.0, 0.0, 0.0)
        for edge in polyhedron.edges:
            visible = seen[list(edge.faces)]
            if visible.any() == front and (edge.sharp or (not visible.all() and visible.any())):
                share = EDGE_ALPHA if front else 0.4 * EDGE_ALPHA
                yield corners[list(edge.ends)], (0.0, 0.0, 0.0, 0.0), (*(0.7 * base), share)
