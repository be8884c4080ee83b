"""What links look like: few coloured triangles, made of what a URDF shows; decoration, on which nothing depends."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache as remembered
from hashlib import sha256
from itertools import groupby
from math import sqrt
from typing import TypeAlias

import numpy as np

from problems.base import FloatArray, InvalidProblem, cache
from problems.geometry import Triangles, read_parts, simplified
from problems.robots.chain import LinkFrame
from problems.robots.link_covers import MeshNote, ReadFile
from problems.robots.shapes import Shape

VERSION = "2"  # of how appearances are made: another finds none of those kept before
MOST_TRIANGLES, FEWEST = 3_000, 12  # of a robot, about; of a part
Colour: TypeAlias = str  # as #rrggbb; empty where none is stated
Parts: TypeAlias = tuple[tuple[Colour, Triangles], ...]  # of a link, in its frame


@dataclass(frozen=True)
class Visual:
    """A part of a link as it is shown.

    Attributes:
        shape: of it.
        colour: as #rrggbb; empty where none is stated.
    """

    shape: Shape
    colour: Colour = ""


@dataclass(frozen=True, eq=False)
class LinkAppearance:
    """Triangles that show a link in one colour.

    Attributes:
        link: its name.
        body: number of the body that carries it: 0 for the base, then that of the joint that moves it.
        colour: as #rrggbb; empty where none is stated.
        triangles: in the body's frame.
    """

    link: str
    body: int
    colour: Colour
    triangles: Triangles


def colour_of(rgba: Sequence[float]) -> Colour:
    """The colour of red, green, blue (and alpha, which is ignored), from 0 to 1."""
    return "#" + "".join(f"{round(255.0 * min(max(part, 0.0), 1.0)):02x}" for part in rgba[:3])


def new_appearances(
    shown: Mapping[str, Sequence[Visual]], others: Mapping[str, Sequence[Shape]], read: ReadFile
) -> tuple[dict[str, Parts], list[MeshNote]]:
    """Appearances of links by name, in about ``MOST_TRIANGLES`` triangles; notes on what cannot be shown.

    Args:
        shown: what a description shows of links; none of those of which it shows nothing.
        others: their collision geometry, which is shown instead.
        read: the content of a mesh's file.
    """
    read = remembered(read)
    key = _key(shown, others, read)
    kept = cache.find_text(key, "look")
    if kept is not None:
        with suppress(InvalidProblem):
            return read_appearances(kept), []
    full: dict[str, list[tuple[Colour, FloatArray]]] = {}
    notes: list[MeshNote] = []
    for link in dict.fromkeys((*shown, *others)):
        given = (shown.get(link, ()), tuple(map(Visual, others.get(link, ()))))
        full[link], own = _first_shown(link, [visuals for visuals in given if visuals], read)
        notes += own
    appearances = _simplified(full)
    if not notes:
        with suppress(OSError):  # a cache that cannot be written costs the next process its time, nothing else
            cache.store(key, appearance_text(appearances).encode(), "look")
    return appearances, notes


def _key(shown: Mapping[str, Sequence[Visual]], others: Mapping[str, Sequence[Shape]], read: ReadFile) -> str:
    """The key of appearances in the cache, made of shapes, and the content of files."""
    shapes = [visual.shape for visuals in shown.values() for visual in visuals]
    shapes += [shape for link, own in others.items() if link not in shown for shape in own]
    files = []
    for shape in shapes:
        with suppress(InvalidProblem):
            files += [] if shape.mesh is None else [sha256(read(shape.mesh)).hexdigest()]
    return cache.key_of("look", VERSION, repr(MOST_TRIANGLES), repr(dict(shown)), repr(dict(others)), *files)


def _first_shown(
    link: str, choices: Sequence[Sequence[Visual]], read: ReadFile
) -> tuple[list[tuple[Colour, FloatArray]], list[MeshNote]]:
    """Colours and corners (n, 3, 3), m, of the first choice that can be read; notes on those that cannot."""
    notes: list[MeshNote] = []
    for visuals in choices:
        file = ""
        try:
            parts = []
            for visual in visuals:
                file = "" if visual.shape.mesh is None else visual.shape.mesh.file
                parts += list(_parts(visual, read))
            return parts, notes
        except InvalidProblem as error:
            notes.append(MeshNote(link, file, error.reason))
    return [], notes


def _parts(visual: Visual, read: ReadFile) -> Iterator[tuple[Colour, FloatArray]]:
    mesh = visual.shape.mesh
    if mesh is None:
        yield visual.colour, visual.shape.placed(visual.shape.surface)
        return
    for part in read_parts(mesh.file, read(mesh), mesh.scale):
        yield visual.colour or part.colour, mesh.placed(part.corners)


def _simplified(full: Mapping[str, list[tuple[Colour, FloatArray]]]) -> dict[str, Parts]:
    """Appearances whose triangles are shared out by size, the square root of the area, over links and colours."""
    each = []
    for link, parts in full.items():
        for colour, group in groupby(sorted(parts, key=_colour), key=_colour):
            corners = [Triangles.of(corners).outward.corners for _, corners in group]
            triangles = Triangles.of(np.concatenate(corners))
            if len(triangles.faces):
                each.append((link, colour, triangles))
    total = sum(sqrt(triangles.area) for *_, triangles in each) or 1.0
    few = [
        (link, (colour, simplified(triangles, max(FEWEST, int(MOST_TRIANGLES * sqrt(triangles.area) / total)))))
        for link, colour, triangles in each
    ]
    return {link: tuple(part for _, part in group) for link, group in groupby(few, key=lambda one: one[0])}


def _colour(part: tuple[Colour, FloatArray]) -> Colour:
    return part[0]


def placed_appearances(frames: Sequence[LinkFrame], appearances: Mapping[str, Parts]) -> tuple[LinkAppearance, ...]:
    """Appearances by the links' names, on the bodies that carry the links."""
    return tuple(
        LinkAppearance(
            frame.name, frame.body, colour, part.placed(np.array(frame.pose.rotation), np.array(frame.pose.translation))
        )
        for frame in frames
        for colour, part in appearances.get(frame.name, ())
    )


def appearance_text(appearances: Mapping[str, Parts]) -> str:
    """Appearances as a text, to be stored."""
    return json.dumps(
        {link: [[colour, triangles.text] for colour, triangles in parts] for link, parts in appearances.items()}
    )


def read_appearances(text: str) -> dict[str, Parts]:
    """Appearances that a text states, by the links' names.

    Raises:
        InvalidProblem: ``appearances`` is no such text.
    """
    try:
        stated = json.loads(text)
        return {
            link: tuple((_checked(colour), Triangles.from_text(triangles)) for colour, triangles in parts)
            for link, parts in stated.items()
        }
    except (ValueError, TypeError, AttributeError) as error:
        raise InvalidProblem("looks", f"no looks of links: {error}") from error


def _checked(colour: Colour) -> Colour:
    if colour and not (len(colour) == 7 and colour[0] == "#" and int(colour[1:], 16) >= 0):
        raise ValueError("a colour")
    return colour
