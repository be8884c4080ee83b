"""In which order a painter has to paint balls and convex solids, so that what is nearer the eye covers what is behind.

Of two things that a plane parts, the one on the eye's side of it is never covered by the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.space.polyhedron import Polyhedron
from tpbso_casadi.figures.space.view import View


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
