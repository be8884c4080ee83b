"""MoveIt's scene files: named bodies made of boxes, spheres, cylinders, cones and meshes, as [[obstacles]] tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from problems import InvalidProblem
from problems.base import FloatArray, InvalidTable, number_of
from problems.geometry import convex_parts
from problems.robots import FixedFrame, Transform, as_point, matrix_of, quaternions_of
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.obstacle_section import ObstacleSection
from tpbso_casadi.scenario.obstacles import read_obstacle
from tpbso_casadi.scenario.validation import MOST_OBSTACLES, ScenarioError

SIDES = 24  # of the pyramid around a cone
MOST_NUMBERS = 5_000_000  # of a mesh
Table = dict[str, Any]


class _Words:
    """The words of a text, one after the other, and where they are."""

    def __init__(self, text: str) -> None:
        self._lines = list(enumerate(text.splitlines(), start=1))
        self._words: Iterator[tuple[int, str]] = ((n, word) for n, line in self._lines for word in line.split())
        self.line = 0

    def word(self) -> str:
        """The next word of the file.

        Raises:
            ScenarioError: there is none.
        """
        self.line, word = next(self._words, (self.line, ""))
        if not word:
            raise self.fault("it ends in the middle")
        return word

    def numbers(self, count: int) -> list[float]:
        """The next numbers of the file, so many of them.

        Raises:
            ScenarioError: a word is none, or not finite.
        """
        found = []
        for _ in range(count):
            word = self.word()
            try:
                found.append(number_of(word))
            except ValueError as error:
                raise self.fault(f"a number is needed, not {word!r}") from error
            if not math.isfinite(found[-1]):
                raise self.fault("a number is not finite")
        return found

    def whole(self, most: int) -> int:
        """A whole number from 0 to the most.

        Raises:
            ScenarioError: it is none, or larger.
        """
        (number,) = self.numbers(1)
        if number != int(number) or not 0 <= number <= most:
            raise self.fault(f"a whole number up to {most} is needed")
        return int(number)

    def rest_of_line(self) -> str:
        """The words that are left of the line, joined by spaces."""
        line = self._lines[self.line - 1][1].strip()
        for _ in line.split()[1:]:
            self.word()
        return line.split(maxsplit=1)[1] if " " in line or "\t" in line else ""

    def pose(self) -> Transform:
        """Position, m, and quaternion x, y, z, w.

        Raises:
            ScenarioError: the quaternion is none.
        """
        place, turn = self.numbers(3), np.array(self.numbers(4))
        length = float(np.linalg.norm(turn))
        if not abs(length - 1.0) < 1e-3:
            raise self.fault("the quaternion is not of length 1")
        x, y, z, w = (turn / length).tolist()
        return Transform(matrix_of((x, y, z, w)), as_point(place))

    def fault(self, reason: str) -> ScenarioError:
        """An error at the place of the last word."""
        return ScenarioError(f"line {self.line}: {reason}")


def read_scene(name: str, folder: InputFolder) -> list[ObstacleSection]:
    """The tables of a file beside a scenario.

    Raises:
        ScenarioError: the file cannot be read, may not be, or is none.
    """
    try:
        text = folder.read_text(name)
    except ScenarioError as error:
        raise ScenarioError(f"scene: {error}") from error
    try:
        return [read_obstacle(table) for table in scene_tables(text)]
    except (ScenarioError, InvalidTable) as error:
        raise ScenarioError(f"scene: {folder.path / name}: {error}") from error


def scene_tables(text: str) -> list[Table]:
    """The tables of all bodies of a MoveIt scene file, of either of its formats.

    Raises:
        ScenarioError: it is none, or has a shape that is not read; naming the line.
    """
    words, tables = _Words(text), list[Table]()
    has_poses = _has_poses(text)
    words.word()
    words.rest_of_line()  # the scene's name
    while True:
        mark = words.word()
        if mark == ".":
            return tables
        if mark != "*":
            raise words.fault(f"'*' before an object or '.' at the end is needed, not {mark!r}")
        name = words.rest_of_line()
        pose = words.pose() if has_poses else Transform()
        for _ in range(words.whole(MOST_OBSTACLES)):
            tables.append({"name": name} | _shape(words, pose))
            words.numbers(4)  # its colour
        if has_poses:
            for _ in range(words.whole(MOST_OBSTACLES)):  # frames that have names
                words.word()
                words.pose()


def _has_poses(text: str) -> bool:
    """Whether objects have poses of their own: the line below the first one's name has several numbers."""
    lines = [line.strip() for line in text.splitlines()]
    first = next((n for n, line in enumerate(lines) if line.startswith("*")), None)
    return first is not None and first + 1 < len(lines) and len(lines[first + 1].split()) > 1


def _shape(words: _Words, outer: Transform) -> Table:
    """A shape with its pose."""
    kind = words.word()
    if kind not in _SHAPES:
        raise words.fault(f"shape {kind!r}; {', '.join(_SHAPES)} are read")
    place, table = words.line, _SHAPES[kind](words)
    pose = FixedFrame.of(outer @ words.pose())
    quaternion = quaternions_of(np.array(pose.rotation).reshape(1, 9))[0].tolist()
    turned = {} if kind == "sphere" else {"quaternion": quaternion}
    if "corners" in table:
        try:
            parts = convex_parts(table.pop("corners"))
        except InvalidProblem as error:
            raise ScenarioError(f"line {place}: {error.reason}") from error
        table["parts_points"] = [part.corners.tolist() for part in parts]
    return table | {"center": list(pose.translation)} | turned


def _box(words: _Words) -> Table:
    return {"shape": "box", "size": words.numbers(3)}


def _sphere(words: _Words) -> Table:
    return {"shape": "sphere", "radius": words.numbers(1)[0]}


def _cylinder(words: _Words) -> Table:
    radius, length = words.numbers(2)
    return {"shape": "cylinder", "radius": radius, "length": length}


def _cone(words: _Words) -> Table:
    """A pyramid around it."""
    radius, length = words.numbers(2)
    phase = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = radius / np.cos(np.pi / SIDES) * np.column_stack([np.cos(phase), np.sin(phase)])
    points: FloatArray = np.concatenate([np.column_stack([ring, np.full(SIDES, -length / 2)]), [[0, 0, length / 2]]])
    return {"shape": "polytope", "points": points.tolist()}


def _mesh(words: _Words) -> Table:
    vertices, triangles = words.whole(MOST_NUMBERS), words.whole(MOST_NUMBERS)
    places = np.array(words.numbers(3 * vertices)).reshape(-1, 3)
    numbers = np.array(words.numbers(3 * triangles)).reshape(-1, 3)
    if not triangles or not np.isin(numbers, np.arange(vertices)).all():
        raise words.fault("a mesh needs triangles of its own vertices")
    return {"shape": "mesh", "corners": places[numbers.astype(np.intp)]}


_SHAPES: dict[str, Callable[[_Words], Table]] = {
    "box": _box,
    "sphere": _sphere,
    "cylinder": _cylinder,
    "cone": _cone,
    "mesh": _mesh,
}
