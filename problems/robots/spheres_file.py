"""The spheres file: balls and capsules that hold a robot's bodies, link by link, as TOML."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any

from problems.base import InvalidProblem, shown, toml_tables
from problems.robots.chain import LinkFrame
from problems.robots.spheres import Ball, Sphere, covered_capsule
from problems.robots.transform import Point3

MOST_CHARACTERS = 1_000_000
MOST_SPHERES = 1_000
FARTHEST = 1e4  # m
KEYS = {"spheres": {"link", "center", "radius"}, "capsules": {"link", "start", "end", "radius"}}


def read_spheres(text: str, links: Sequence[LinkFrame]) -> tuple[Sphere, ...]:
    """The spheres that a file states, on the bodies that carry their links.

    Args:
        text: of the file. Centers and ends are in the frames of their links, m.
        links: that the robot has.

    Returns:
        Spheres in the order of the file; those that hold its capsules follow.

    Raises:
        InvalidProblem: ``spheres`` is impossible, with the reason in one line.
    """
    frames = {frame.name: frame for frame in links}
    spheres: list[Sphere] = []
    for kind, entry, owner in _entries(_tables(text)):
        frame = frames.get(entry["link"]) if isinstance(entry["link"], str) else None
        if frame is None:
            raise _wrong(f"{owner}: no link {entry['link']!r} in the chain; there are {', '.join(frames)}")
        radius = _length(entry["radius"], f"{owner}: radius")
        if kind == "spheres":
            balls: Sequence[Ball] = (Ball(_point(entry["center"], f"{owner}: center"), radius),)
        else:
            start, end = (_point(entry[key], f"{owner}: {key}") for key in ("start", "end"))
            balls = covered_capsule(start, end, radius)
        moved = (ball.seen_from(frame.pose) for ball in balls)
        spheres += [Sphere(frame.body, ball.center, ball.radius, frame.name) for ball in moved]
        if len(spheres) > MOST_SPHERES:
            raise _wrong(f"more than {MOST_SPHERES}")
    return tuple(spheres)


def _tables(text: str) -> dict[str, Any]:
    if len(text) > MOST_CHARACTERS:
        raise _wrong(f"{len(text)} characters, of at most {MOST_CHARACTERS}")
    try:
        tables = toml_tables(text)
    except ValueError as error:
        raise _wrong(str(error)) from error
    unknown = next((key for key in tables if key not in KEYS), None)
    if unknown is not None:
        raise _wrong(f"unknown key {unknown!r}; there are {', '.join(KEYS)}")
    if not any(tables.values()):
        raise _wrong("neither [[spheres]] nor [[capsules]]")
    return tables


def _entries(tables: dict[str, Any]) -> Sequence[tuple[str, dict[str, Any], str]]:
    """Kind, table and name of every entry, spheres first."""
    entries = []
    for kind, keys in KEYS.items():
        listed = tables.get(kind, [])
        if not isinstance(listed, list):
            raise _wrong(f"[[{kind}]] is a list of tables")
        for number, entry in enumerate(listed, start=1):
            owner = f"{kind[:-1]} {number}"
            if not isinstance(entry, dict) or set(entry) != keys:
                raise _wrong(f"{owner}: needs {', '.join(sorted(keys))} and nothing else")
            entries.append((kind, entry, owner))
    return entries


def _wrong(reason: str) -> InvalidProblem:
    return InvalidProblem("spheres", reason)


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _wrong(f"{what}: a number is needed, not {str(value)[:40]!r}")
    if not abs(value) <= FARTHEST:
        raise _wrong(f"{what}: {shown(value)} is not within {FARTHEST:g} m")
    return float(value)


def _length(value: Any, what: str) -> float:
    length = _number(value, what)
    if not length > 0.0:
        raise _wrong(f"{what}: {length:g} m is not above 0")
    return length


def _point(value: Any, what: str) -> Point3:
    if not isinstance(value, list) or len(value) != 3:
        raise _wrong(f"{what}: three coordinates are needed")
    x, y, z = (_number(part, what) for part in value)
    return x, y, z


def written_spheres(balls: Iterable[tuple[str, Ball]]) -> str:
    """The text of a file that states balls, each in the frame of the link that is named with it."""
    entries = []
    for link, ball in balls:
        center = ", ".join(repr(float(part)) for part in ball.center)
        entries.append(f"[[spheres]]\nlink = {json.dumps(link)}\ncenter = [{center}]\nradius = {ball.radius!r}\n")
    return "\n".join(entries)
