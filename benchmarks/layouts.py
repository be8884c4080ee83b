"""Random cells whose layout is searched: parts go from one bin to another, past a pillar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

DOWN = [1.0, 0.0, 0.0, 0.0]  # the tool points downward
DEEP, WALL, HEIGHT = 0.14, 0.01, 0.12  # m: how far the tool goes down; of the bins
BIN = (0.3, 0.4)  # inside, m
PART = 0.05  # size of a part, m
SPOTS = np.array([[-0.075, -0.1], [-0.075, 0.1], [0.075, -0.1], [0.075, 0.1]])  # of parts in a bin, about, m


@dataclass(frozen=True)
class Cell:
    """An arm that puts parts from one bin into another.

    Attributes:
        robot: its table; the tool is between the fingers.
        gripper: size of the box that stands for it, m, and how far it ends before the tool.
        reach: about how far the arm reaches, m.
    """

    robot: dict[str, Any]
    gripper: tuple[list[float], float] | None
    reach: float

    def tables(self, seed: int) -> dict[str, Any]:
        """A random cell, as the tables of a scenario."""
        rng = np.random.default_rng(seed)
        parts = int(rng.integers(2, 5))
        scale = self.reach / 0.85
        sides = rng.uniform([0.35, -0.35, 0.35, 0.2], [0.5, -0.2, 0.5, 0.4]) * scale
        spots = np.array([rng.permutation(SPOTS)[:parts] for _ in range(2)]) + rng.uniform(-0.01, 0.01, (2, parts, 2))
        pillar = [*(rng.uniform([0.55, -0.1], [0.75, 0.1]) * scale), 0.25]
        frames = [
            {"name": "pedestal", "position": [0.0, 0.0, 0.0]},
            {"name": "bin 1", "position": [*sides[:2], 0.0]},
            {"name": "bin 2", "position": [*sides[2:], 0.0]},
        ]
        table = {"shape": "box", "name": "table", "center": [0.0, 0.0, -0.12], "size": [4.0, 4.0, 0.2]}
        column = {"shape": "box", "name": "pillar", "center": pillar, "size": [0.08, 0.08, 0.5]}
        walls = [wall for name in ("bin 1", "bin 2") for wall in walls_of(name)]
        return {
            "robot": self.robot | {"base": {"frame": "pedestal"}},
            "carried": [] if self.gripper is None else [gripper_of(*self.gripper)],
            "frames": frames,
            "obstacles": [table, column, *walls, *(part_of(n, spot) for n, spot in enumerate(spots[0]))],
            "task": {
                "kind": "sequence",
                "start": place_above("bin 1", spots[0][0]),
                "cyclic": True,
                "stages": [*stages_of(spots), {"kind": "move", "goal": place_above("bin 1", spots[0][0])}],
            },
        }


def gripper_of(size: list[float], gap: float) -> dict[str, Any]:
    """The table of the gripper."""
    center = [0.0, 0.0, -gap - size[2] / 2.0]
    return {"shape": "box", "name": "gripper", "center": center, "size": size, "mass": 0.9}


def walls_of(name: str) -> list[dict[str, Any]]:
    """The four walls of a bin, in its frame."""
    found = []
    for axis, along in ((0, 1), (1, 0)):
        for sign in (-1.0, 1.0):
            center, size = [0.0, 0.0, HEIGHT / 2.0], [WALL, WALL, HEIGHT]
            center[axis], size[along] = sign * (BIN[axis] + WALL) / 2.0, BIN[along] + 2.0 * WALL
            found.append({"frame": name, "shape": "box", "name": f"{name} wall", "center": center, "size": size})
    return found


def part_of(number: int, spot: Any) -> dict[str, Any]:
    """The table of a part in the first bin."""
    center = [*map(float, spot), PART / 2.0]
    return {"frame": "bin 1", "shape": "box", "name": f"part {number + 1}", "center": center, "size": [PART] * 3}


def place_above(name: str, spot: Any) -> dict[str, Any]:
    """A pose of the tool above a spot of a bin."""
    return {"frame": name, "position": [*map(float, spot), PART / 2.0 + DEEP], "quaternion": DOWN}


def stages_of(spots: Any) -> list[dict[str, Any]]:
    """Each part is fetched and put down."""
    stages: list[dict[str, Any]] = []
    for number, (taken, put) in enumerate(zip(*spots, strict=True)):
        part = f"part {number + 1}"
        touching = [["gripper", part]]
        lying = [[part, "table"]]
        stages += [
            *([{"kind": "move", "goal": place_above("bin 1", taken)}] if number else []),
            {"kind": "line", "by": [0.0, 0.0, -DEEP], "may_touch": touching},
            {"kind": "attach", "name": part, "mass": 0.3},
            {"kind": "line", "by": [0.0, 0.0, DEEP], "may_touch": lying},
            {"kind": "move", "goal": place_above("bin 2", put)},
            {"kind": "line", "by": [0.0, 0.0, -DEEP]},
            {"kind": "detach", "name": part},
            {"kind": "line", "by": [0.0, 0.0, DEEP], "may_touch": touching},
        ]
    return stages


CELLS = {
    "ur5e": Cell({"model": "ur5e", "tool": {"position": [0.0, 0.0, 0.15]}}, ([0.1, 0.06, 0.12], 0.03), 0.85),
    "panda": Cell({"model": "panda", "tip_link": "panda_hand_tcp"}, None, 0.8),
}
