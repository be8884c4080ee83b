"""Problems of MotionBenchMaker as one JSON object a line: start, goal, and boxes and cylinders in between."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from problems.base import FloatArray

UNIT = 1e-3  # by which the length of a quaternion may differ from 1


class InvalidFile(ValueError):
    """A file that cannot be used; the message is one line that names file, place and reason."""


@dataclass(frozen=True)
class Obstacle:
    """A box or an upright cylinder, somewhere.

    Attributes:
        shape: "box" or "cylinder".
        position: of its centre, m.
        quaternion: x, y, z, w of its axes.
        size: of the box along its axes, m; of the cylinder diameter, diameter and length.
    """

    shape: str
    position: tuple[float, ...]
    quaternion: tuple[float, ...]
    size: tuple[float, ...]

    @cached_property
    def rotation(self) -> FloatArray:
        """Its axes as the columns of a matrix."""
        x, y, z, w = np.array(self.quaternion) / np.linalg.norm(self.quaternion)
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )


@dataclass(frozen=True)
class MotionProblem:
    """From joint angles to joint angles among obstacles.

    Attributes:
        name: as ``cage_panda-0001``.
        start: joint angles, rad.
        goal: joint angles, rad.
        obstacles: what must not be touched.
    """

    name: str
    start: tuple[float, ...]
    goal: tuple[float, ...]
    obstacles: tuple[Obstacle, ...]


def kind_of(name: str) -> str:
    """The class of scenes that a problem belongs to by its name, as ``cage`` of ``cage_panda-0001``."""
    return name.rpartition("-")[0].rpartition("_")[0]


def read_problems(path: Path) -> list[MotionProblem]:
    """Read a file of problems.

    Raises:
        InvalidFile: it cannot be read, or something in it is missing or no number.
    """
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeError) as error:
        raise InvalidFile(f"{path}: cannot be read: {error}") from error
    problems = [_problem(f"{path}: line {number}", line) for number, line in enumerate(lines, start=1) if line.strip()]
    names = [problem.name for problem in problems]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None or not problems:
        raise InvalidFile(f"{path}: {'no problems' if twice is None else f'{twice} is there twice'}")
    return problems


def chosen(problems: list[MotionProblem], first: int | None, names: str | None) -> list[MotionProblem]:
    """The first so many of each class, of those whose name contains a text."""
    counts: dict[str, int] = {}
    kept = []
    for problem in problems:
        kind = kind_of(problem.name)
        counts[kind] = counts.get(kind, 0) + 1
        if (first is None or counts[kind] <= first) and (names or "") in problem.name:
            kept.append(problem)
    return kept


def _problem(place: str, line: str) -> MotionProblem:
    try:
        content = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise InvalidFile(f"{place}: is not JSON: {error}") from error
    name = _value(place, content, "name")
    if not isinstance(name, str) or not name:
        raise InvalidFile(f"{place}: name: is not a name")
    start, goal = (_numbers(place, content, key) for key in ("start", "goal"))
    if len(start) != len(goal):
        raise InvalidFile(f"{place}: goal: {len(goal)} angles where start has {len(start)}")
    obstacles = _value(place, content, "obstacles")
    if not isinstance(obstacles, list):
        raise InvalidFile(f"{place}: obstacles: is not a list")
    return MotionProblem(
        name, start, goal, tuple(_obstacle(f"{place}: obstacle {n}", one) for n, one in enumerate(obstacles, start=1))
    )


def _obstacle(place: str, content: Any) -> Obstacle:
    shape = _value(place, content, "shape")
    position, quaternion = _numbers(place, content, "position", 3), _numbers(place, content, "quaternion", 4)
    if abs(math.hypot(*quaternion) - 1.0) > UNIT:
        raise InvalidFile(f"{place}: quaternion: is not of length 1")
    if shape == "box":
        size = _numbers(place, content, "size", 3)
    elif shape == "cylinder":
        radius, length = (_numbers(place, {key: [_value(place, content, key)]}, key)[0] for key in ("radius", "length"))
        size = 2.0 * radius, 2.0 * radius, length
    else:
        raise InvalidFile(f"{place}: shape: {shape!r:.40} is neither box nor cylinder")
    if min(size) <= 0.0:
        raise InvalidFile(f"{place}: its sizes are not all positive")
    return Obstacle(shape, position, quaternion, size)


def _value(place: str, content: Any, key: str) -> Any:
    if not isinstance(content, dict) or key not in content:
        raise InvalidFile(f"{place}: {key}: is missing")
    return content[key]


def _numbers(place: str, content: Any, key: str, count: int | None = None) -> tuple[float, ...]:
    values = _value(place, content, key)
    numeric = isinstance(values, list) and all(type(one) in (int, float) and math.isfinite(one) for one in values)
    if not numeric or not values or (count is not None and len(values) != count):
        raise InvalidFile(f"{place}: {key}: is not {'a list of' if count is None else count} numbers")
    return tuple(float(one) for one in values)
