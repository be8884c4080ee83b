"""The robot as it looks: its links' triangles, lit from above and painted from back to front, and their outlines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.colors import to_hex, to_rgb
from matplotlib.path import Path

from problems.base import FloatArray
from problems.robots import LinkAppearance
from tpbso_casadi.figures.palette import NEUTRAL
from tpbso_casadi.figures.space_scene import Polyhedron, View

LIGHT = np.array([-0.35, 0.45, 0.82])  # in the axes of the view
SHADES = 16  # of a colour, from those in the shadow to those in the light
DARKEST, BRIGHTEST = 0.16, 0.88  # of what is neither lit nor in the shadow: black and white are seen on any ground


def shades_of(colour: str) -> FloatArray:
    """The shades of a stated colour, or of the neutral one where none is: (SHADES, 3), RGB from 0 to 1."""
    base = DARKEST + (BRIGHTEST - DARKEST) * np.array(to_rgb(colour or NEUTRAL))
    lit = np.linspace(0.0, 1.0, SHADES)[:, None]
    return np.asarray(np.clip(base * (0.5 + 0.55 * lit) + 0.1 * lit**4, 0.0, 1.0))


def written_shades(colour: str) -> list[str]:
    """Shades of a colour as #rrggbb."""
    return [to_hex(shade) for shade in shades_of(colour)]


def front_of(view: View, corners: FloatArray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of those triangles (n, 3, 3) that are seen from their outside, (m,), and of their shades."""
    one, two, three = corners.swapaxes(0, 1)
    normals = np.cross(two - one, three - one)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    rows = np.flatnonzero(view.sees(normals, np.einsum("ij,ij->i", normals, one)))
    light = LIGHT @ view.axes / np.linalg.norm(LIGHT)
    return rows, np.rint((SHADES - 1) * np.maximum(normals[rows] @ light, 0.0)).astype(int)


def palette_of(appearances: Sequence[LinkAppearance]) -> FloatArray:
    """The shades of every triangle of all looks, (n, SHADES, 3)."""
    each = [
        np.repeat(shades_of(appearance.colour)[None], len(appearance.triangles.faces), axis=0)
        for appearance in appearances
    ]
    return np.concatenate([np.empty((0, SHADES, 3)), *each])


def placed_corners(appearances: Sequence[LinkAppearance], frames: FloatArray) -> FloatArray:
    """Corners of the triangles of all looks, (n, 3, 3), m.

    Args:
        appearances: of links.
        frames: origin, m, and axes in rows of the bodies that carry them, (bodies, 4, 3).
    """
    bodies = (frames[appearance.body] for appearance in appearances)
    each = [
        appearance.triangles.placed(body[1:].T, body[0]).corners
        for appearance, body in zip(appearances, bodies, strict=True)
    ]
    return np.concatenate([np.empty((0, 3, 3)), *each])


def layers(
    view: View, places: FloatArray, solids: Sequence[Polyhedron], order: Sequence[int]
) -> Iterator[tuple[np.ndarray, int | None]]:
    """Parts of a picture before each solid, farthest first, with that solid; at last those before all, with None.

    Args:
        view: where they are seen from.
        places: of small things, (n, 3), m, that no solid holds.
        solids: what they are among.
        order: in which the solids are painted.
    """
    slots, depths = np.zeros(len(places), dtype=int), view.depth(places)
    for slot, number in enumerate(order, start=1):
        solid = solids[number]
        seen = view.sees(solid.normals, solid.offsets)
        slots[seen[solid.beyond(places).argmax(axis=1)]] = slot
    for slot, next_solid in enumerate((*order, None)):
        rows = np.flatnonzero(slots == slot)
        yield rows[np.argsort(depths[rows])], next_solid


def silhouette(view: View, corners: FloatArray) -> Path:
    """The outline of triangles (n, 3, 3): a path that is filled where any of them is."""
    spots = view.project(corners)
    along, across = spots[:, 1] - spots[:, 0], spots[:, 2] - spots[:, 0]
    clockwise = along[:, 0] * across[:, 1] < along[:, 1] * across[:, 0]
    spots = np.where(clockwise[:, None, None], spots[:, ::-1], spots)
    closed = np.concatenate([spots, spots[:, :1]], axis=1).reshape(-1, 2)
    codes = np.tile([Path.MOVETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], len(spots))
    return Path(closed, codes)
