"""STL files, binary and ASCII.

Source: 3D Systems, Stereolithography Interface Specification, October 1989.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.geometry.mesh_files.faces import Content, Part, refused

HEAD = 84  # bytes: a text, and the number of facets
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
VERTEX = [b"vertex", b"", b"", b""]  # words that a facet is made of; numbers stand where they are empty
WORDS = [b"facet", b"normal", b"", b"", b"", b"outer", b"loop", *VERTEX * 3, b"endloop", b"endfacet"]
NUMBERS = [place for start in (7, 11, 15) for place in (start + 1, start + 2, start + 3)]
LONGEST = 40  # bytes of a word


def read_stl(content: bytes) -> Content:
    """The facets of an STL file, of all its solids; normals and attributes are left out.

    Raises:
        InvalidProblem: ``mesh`` is none, or not whole.
    """
    corners = _of_binary(content) if _is_binary(content) else _of_text(content)
    return Content((Part(corners, np.empty((0, 3, 3))),))


def _is_binary(content: bytes) -> bool:
    """Whether the size of a file is what its head says; the head may begin as a text does.

    Raises:
        InvalidProblem: ``mesh`` is neither so nor a text.
    """
    if len(content) >= HEAD:
        counted = int.from_bytes(content[HEAD - 4 : HEAD], "little")
        size = HEAD + FACET.itemsize * counted
        if len(content) == size:
            return True
        if b"\0" in content:
            raise refused(f"its head counts {counted} facets, {size} bytes; it has {len(content)}")
    if content.strip() and content.split(None, 1)[0].lower() != b"solid":
        raise refused("it begins neither with 'solid' nor with the head of a binary file")
    return False


def _of_binary(content: bytes) -> FloatArray:
    return np.frombuffer(content, FACET, offset=HEAD)["corners"].astype(np.float64)


def _of_text(content: bytes) -> FloatArray:
    """Corners of the facets of all solids, (n, 3, 3)."""
    solids: list[FloatArray] = [np.empty((0, 3, 3))]
    words: list[bytes] = []
    start = 0  # the line where a solid begins; outside it is 0
    for number, line in enumerate(content.lower().splitlines(), 1):
        first, *rest = line.split() or [b""]
        opens, closes = first == b"solid", first == b"endsolid"
        if (opens or closes) and b"facet normal" in b" ".join(rest):
            raise refused(f"line {number}: a facet stands in the line of its solid")
        if first and opens == bool(start):
            raise refused(f"line {number}: a solid begins in another" if opens else f"line {number}: it is in no solid")
        if closes:
            solids.append(_facets(start, words))
            start = 0
        elif opens:
            start, words = number, []
        else:
            words += line.split()
    if start:
        raise refused(f"the solid in line {start} does not end: the file is cut off")
    return np.concatenate(solids)


def _facets(start: int, words: list[bytes]) -> FloatArray:
    """Corners (n, 3, 3) of the facets of a solid, all words of which must be in their places."""
    whole = len(words) // len(WORDS)
    if max(map(len, words), default=0) > LONGEST:
        raise refused(f"the solid in line {start}: a word of more than {LONGEST} characters")
    table: NDArray[np.bytes_] = np.array(words[: whole * len(WORDS)], dtype=bytes).reshape(whole, len(WORDS))
    fixed = [place for place, word in enumerate(WORDS) if word]
    right = (table[:, fixed] == np.array(WORDS)[fixed]).all(axis=1)
    bad = int(np.argmin(right)) if not right.all() else whole
    if bad < whole or len(words) % len(WORDS):
        raise refused(f"the solid in line {start}: its facet {bad + 1} is not read: three corners are needed")
    try:
        numbers = [float(word.replace(b"d", b"e")) for word in table[:, NUMBERS].ravel().tolist() if b"_" not in word]
        return np.array(numbers).reshape(whole, 3, 3)
    except ValueError as error:
        raise refused(f"the solid in line {start}: a coordinate is no number") from error
