"""Clouds of points, as cameras see them: read from files, and few boxes that hold balls around all points."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem

KINDS = ("ply", "xyz", "npy")
MOST_POINTS = 5_000_000
MOST_CELLS = 20_000_000  # of the grid that holds them
LARGEST = 100.0  # m
ELEMENT = re.compile(rb"^\s*element\s+(\w+)\s+(\d+)", re.MULTILINE)  # of the head of a PLY file
AMBIGUOUS = re.compile(r"^(?=[^\n#]*,)[^\n#]*[^,\s#][ \t]+[^,\s#]|^[^\n#]*,[ \t]*,|^[ \t]*,", re.MULTILINE)
FORMAT = re.compile(rb"^\s*format\s+ascii", re.MULTILINE)


def read_cloud(name: str, content: bytes) -> FloatArray:
    """The points of a file, (n, 3), m, without those that are no finite numbers, as cameras have them.

    Args:
        name: of the file, whose ending says of which kind it is.
        content: of the file: PLY; in XYZ a point a line, three numbers first; of NPY an array (n, 3) or (h, w, 3).

    Raises:
        InvalidProblem: ``file`` is of no kind that is read, broken, without points, or too large.
    """
    kind = PurePosixPath(name).suffix[1:].lower()
    if kind not in KINDS:
        raise _refused(f"it ends with {kind!r}; {', '.join(KINDS)} are read")
    try:
        points = _READERS[kind](content)
        if points.dtype.kind not in "fiu":
            raise ValueError(f"numbers are needed, not an array of {points.dtype}")
    except Exception as error:
        raise _refused(f"it cannot be read: {type(error).__name__}: {' '.join(str(error).split())[:120]}") from error
    if points.ndim < 2 or points.shape[-1] != 3:
        raise _refused(f"points of three numbers are needed, not an array {points.shape}")
    with np.errstate(over="ignore"):
        points = points.reshape(-1, 3).astype(np.float64)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        raise _refused("it has no points")
    if len(points) > MOST_POINTS:
        raise _refused(f"{len(points)} points, of at most {MOST_POINTS}")
    with np.errstate(over="ignore"):
        size = float(np.ptp(points, axis=0).max())
    if size > LARGEST:
        raise _refused(f"it is {size:.4g} m large, of at most {LARGEST:g}: is it in mm?")
    return points


def _of_ply(content: bytes) -> FloatArray:
    import trimesh  # noqa: PLC0415 (half a second)

    points = np.asarray(trimesh.load(io.BytesIO(content), file_type="ply", process=False).vertices)
    head, _, body = content.partition(b"end_header")
    counts = {name: int(count) for name, count in ELEMENT.findall(head)}
    lines = sum(bool(line.strip()) for line in body.splitlines()) if FORMAT.search(head) else sum(counts.values())
    if len(points) != counts.get(b"vertex") or lines != sum(counts.values()):
        raise ValueError("its head counts other points and faces than are in it")
    return points


def _of_xyz(content: bytes) -> FloatArray:
    text = content.decode("utf-8-sig")
    if AMBIGUOUS.search(text):
        raise ValueError("commas and blanks are mixed in a line, or a number is missing between commas")
    text = text.replace(",", " ")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # there is nothing in it, which is said where points are counted
        return np.loadtxt(io.StringIO(text), usecols=(0, 1, 2), ndmin=2)


def _of_npy(content: bytes) -> FloatArray:
    return np.asarray(np.load(io.BytesIO(content), allow_pickle=False))


_READERS = {"ply": _of_ply, "xyz": _of_xyz, "npy": _of_npy}


def _refused(reason: str) -> InvalidProblem:
    return InvalidProblem("file", reason)


def boxes_around(points: FloatArray, radius: float, most: int) -> tuple[FloatArray, float]:
    """Boxes with sides along the axes that hold the balls around points.

    Points in cells of a grid that are next to each other are joined while all cells in between have points, so that no
    box reaches farther than a cell's diagonal beyond the balls. The cells are twice the radius, or larger where that
    takes too many boxes.

    Args:
        points: (n, 3), m.
        radius: of the balls, m.
        most: boxes.

    Returns:
        Lower and upper corners, (m, 2, 3), m; and the side of the cells, m.
    """
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    cell = 2.0 * radius
    while np.log(np.floor(size / cell) + 1.0).sum() > np.log(MOST_CELLS):
        cell *= 2.0
    while True:
        places = np.floor((points - low) / cell).astype(np.intp)
        blocks = _joined(places, most)
        if blocks is not None:
            break
        cell *= 2.0
    return _shrunk(points, places, blocks, radius), cell


def _joined(places: NDArray[np.intp], most: int) -> NDArray[np.intp] | None:
    """Blocks of occupied cells, each grown along z, then y, then x: first and last cell, (m, 2, 3).

    None where there are more than so many.
    """
    free = np.zeros(places.max(axis=0) + 1, dtype=bool)
    free[tuple(places.T)] = True
    blocks: list[list[list[int]]] = []
    for x, y, z in map(np.ndarray.tolist, np.argwhere(free)):
        if not free[x, y, z]:
            continue
        if len(blocks) == most:
            return None
        last_z = z + _run(free[x, y, z:])
        last_y = y + _run(np.all(free[x, y:, z : last_z + 1], axis=1))
        last_x = x + _run(np.all(free[x:, y : last_y + 1, z : last_z + 1], axis=(1, 2)))
        free[x : last_x + 1, y : last_y + 1, z : last_z + 1] = False
        blocks.append([[x, y, z], [last_x, last_y, last_z]])
    return np.array(blocks, dtype=np.intp)


def _run(free: Any) -> int:
    """The number of leading entries of (n,) that are true, minus one; the first is."""
    return int(np.argmin(free)) - 1 if not free.all() else len(free) - 1


def _shrunk(points: FloatArray, places: NDArray[np.intp], blocks: NDArray[np.intp], radius: float) -> FloatArray:
    """The smallest boxes around the balls of the points in each block."""
    owner = np.empty(places.max(axis=0) + 1, dtype=np.intp)
    for number, (first, last) in enumerate(blocks):
        owner[tuple(slice(one, two + 1) for one, two in zip(first, last, strict=True))] = number
    of_point = owner[tuple(places.T)]
    low, high = (np.full((len(blocks), 3), limit) for limit in (np.inf, -np.inf))
    np.minimum.at(low, of_point, points)
    np.maximum.at(high, of_point, points)
    return np.stack([low - radius, high + radius], axis=1)
