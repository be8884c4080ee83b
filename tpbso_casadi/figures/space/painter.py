"""Pictures of balls and solids as coloured polygons, those behind first.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.space.order import painting_order
from tpbso_casadi.figures.space.polyhedron import Polyhedron
from tpbso_casadi.figures.space.scene import Scene
from tpbso_casadi.figures.space.view import View
from tpbso_casadi.figures.style.colours import OBSTACLE

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
