"""Wavefront OBJ: vertices and polygons.

Source: Wavefront Technologies, Advanced Visualizer Manual, appendix B1 (Object Files, .obj), version 3.0.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from problems.base import FloatArray
from problems.geometry.mesh_files.faces import Content, part_of, refused

MARK = b"\xef\xbb\xbf"  # of UTF-8
CORNER = re.compile(rb"([+-]?\d{1,18})(/[+-]?\d*){0,2}")  # a vertex, its texture's and its normal's number
NUMBERED = {b"v", b"vt", b"vn", b"vp", b"f", b"l", b"p"}  # elements with numbers, which may go on in another line
WITHOUT_SURFACE = {b"l", b"p"}
DECORATION = {
    *(b"vt", b"vn", b"vp", b"o", b"g", b"s", b"mg", b"usemtl", b"mtllib", b"usemap", b"maplib"),
    *(b"bevel", b"c_interp", b"d_interp", b"lod", b"shadow_obj", b"trace_obj"),
}


def read_obj(content: bytes) -> Content:
    """The polygons of an OBJ file; lines, points and colours are left out.

    Raises:
        InvalidProblem: ``mesh`` has an element that is not read, or one that is broken, with its line.
    """
    places: list[float] = []
    corners: list[int] = []
    counts: list[int] = []
    lines: list[int] = []
    notes: tuple[str, ...] = ()
    for line, (kind, *words) in _statements(content):
        if kind == b"v":
            places += _place(line, words)
        elif kind == b"f":
            corners += _corners(line, words, len(places) // 3)
            counts.append(len(words))
            lines.append(line)
        elif kind in WITHOUT_SURFACE:
            notes = ("has lines or points, which have no surface and are left out",)
        elif kind not in DECORATION:
            raise refused(f"line {line}: the element {_shown(kind)} is not read")
    numbers = np.array(corners, dtype=np.int64), np.array(counts, dtype=np.int64)
    return Content((part_of(_places(places), *numbers, lambda number: f"line {lines[number]}"),), notes)


def _places(numbers: list[float]) -> FloatArray:
    return np.array(numbers, dtype=np.float64).reshape(-1, 3)


def _statements(content: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Lines that are not empty, by number from 1, without comments, continuation lines joined."""
    begun: list[bytes] = []
    start = 0
    for number, text in enumerate(content.removeprefix(MARK).splitlines(), 1):
        line, sign, _ = text.partition(b"#")
        if begun and not begun[-1][-1:].isspace() and line and not line[:1].isspace():
            raise refused(f"line {number - 1}: its last word may end at the backslash, or go on after it")
        start = start if begun else number
        if line.endswith(b"\\") and not sign:
            begun.append(line[:-1] or b" ")
            continue
        words = b"".join([*begun, line]).split()
        if begun and words and words[0] not in NUMBERED:
            raise refused(f"line {start}: {_shown(words[0])} goes on after a backslash, which is not read")
        begun = []
        if words:
            yield start, words
    if b"".join(begun).strip():
        raise refused(f"line {start}: the file ends after a backslash")


def _place(line: int, words: list[bytes]) -> list[float]:
    """Three coordinates; a weight of 1, or a colour, may come after them."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 4, 6) or b"_" in b"".join(words) or (len(numbers) == 4 and numbers[3] != 1.0):
        raise refused(f"line {line}: v needs three numbers, and may have a weight of 1 or a colour")
    return numbers[:3]


def _corners(line: int, words: list[bytes], known: int) -> list[int]:
    """Numbers of vertices from 0; negative ones in the file count back from the last that is known."""
    found = []
    for word in words:
        match = CORNER.fullmatch(word)
        number = int(match[1]) if match else 0
        if number == 0 or number < -known:
            raise refused(f"line {line}: {_shown(word)} is no corner of f")
        found.append(number - 1 if number > 0 else known + number)
    if len(found) < 3:
        raise refused(f"line {line}: f needs three corners")
    return found


def _shown(word: bytes) -> str:
    return repr(word[:20].decode("ascii", "replace"))
