"""Paths on a turntable: how long a UR5e takes along them while the table may turn, and while it stands.

Ten paths through points around the table's axis are drawn: their radius, height, and how far they go around. Each is
followed within 2 mm, with the tool turned as it is in the frame of the table, or in the world where the table stands:
no line of the tool moves the table then.

    python -m benchmarks.turntable --count 10
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import tpbso_casadi as tp
from benchmarks.off_the_shelf import print_rows
from problems.base import FloatArray

TABLE = """<robot name="turntable"><link name="foot"/><link name="disc">
<collision><origin xyz="0 0 -0.02"/><geometry><cylinder radius="0.15" length="0.02"/></geometry></collision>
<inertial><mass value="5"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="revolute"><parent link="foot"/><child link="disc"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>
<limit lower="-6.28" upper="6.28" velocity="1.5" effort="200"/></joint></robot>"""
PLACE, HEIGHT = np.array([0.55, 0.0, 0.2]), (0.04, 0.15)  # m: of the table's top; of paths above it
RADIUS, AROUND = (0.05, 0.14), (0.5, 1.5)  # m; in half turns
HOME = [0.0, -1.5, 1.8, -1.87, -1.57, 0.0]
DOWN = (1.0, 0.0, 0.0, 0.0)
POINTS, ACCURACY = 12, 0.002  # m
HEADER = ("path", "table turns: s", "table stands: s", "shorter by", "turned by rad", "CPU s")


def paths(count: int) -> list[FloatArray]:
    """Points in the table's frame, (n, 3) each, m."""
    rng, found = np.random.default_rng(5), []
    for _ in range(count):
        first, around = rng.uniform(-np.pi, np.pi), rng.choice([-1.0, 1.0]) * np.pi * rng.uniform(*AROUND)
        angles, radius = first + np.linspace(0.0, around, POINTS), rng.uniform(*RADIUS)
        heights = rng.uniform(*HEIGHT) + 0.02 * np.sin(np.linspace(0.0, 2.0 * np.pi, POINTS))
        found.append(np.column_stack([radius * np.cos(angles), radius * np.sin(angles), heights]))
    return found


def cell_in(folder: Path) -> tp.StatedRobot:
    """The table and the arm."""
    file = folder / "table.urdf"
    file.write_text(TABLE)
    base = {"position": [*PLACE[:2].tolist(), 0.0]}
    table: dict[str, Any] = {"tip_link": "disc", "max_acceleration": 4.0, "max_jerk": 40.0, "base": base}
    return tp.cell({"table": tp.robot(file, **table), "arm": tp.robot("ur5e", max_jerk=60.0)})


def followed(cell: tp.StatedRobot, points: FloatArray, turns: bool) -> tp.Plan:
    """The plan of a path, to whose first point the arm moves before."""
    world = (points + PLACE).tolist()
    first = tp.MoveTo(tp.Pose(tuple(world[0]), DOWN), arm="arm")
    if turns:
        along = tp.Along(points[1:].tolist(), accuracy=ACCURACY, arm="arm", frame="table")
    else:
        along = tp.Along(world[1:], accuracy=ACCURACY, arm="arm")
    return tp.sequence(cell, start={"table": [0.0], "arm": HOME}, stages=[first, along])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=10)
    options = parser.parse_args()
    rows, shares = [], []
    with TemporaryDirectory() as folder:
        cell = cell_in(Path(folder))
        for number, points in enumerate(paths(options.count), start=1):
            began = time.process_time()
            turning, standing = (followed(cell, points, turns) for turns in (True, False))
            spent = time.process_time() - began
            one, other = (plan.stages[-1].duration for plan in (turning, standing))
            assert turning.certified and standing.certified
            way = turning.stages[-1].trajectory
            assert way is not None
            turned = float(np.ptp(way(np.linspace(0.0, way.duration, 400))[:, 0]))
            shares.append(1.0 - one / other)
            rows.append(
                [str(number), f"{one:.3f}", f"{other:.3f}", f"{shares[-1]:.1%}", f"{turned:.2f}", f"{spent:.1f}"]
            )
    rows.append(["median", "", "", f"{np.median(shares):.1%}", "", ""])
    print_rows(HEADER, rows)


if __name__ == "__main__":
    main()
