"""What a certificate costs by the number of its rows: CPU milliseconds of ``tp.certify``, the robot being there.

A Panda between two boxes swings on a quintic from rest to rest, given as rows joined by cubics; without a verdict on
the jerk, which cubics break; and without one on the torques, whose proof takes most of the time.

    python -m benchmarks.long_motions
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import tpbso_casadi as tp
from problems.scene import Box

START, GOAL = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]), np.array([1.2, -0.2, 0.4, -1.9, 0.3, 1.9, 0.2])
SECONDS = 2.0
BOXES = [Box(center=(0.5, -0.6, 0.3), size=(0.2, 0.2, 0.2)), Box(center=(0.2, 0.9, 0.2), size=(0.2, 0.2, 0.2))]


def milliseconds(rows: int, times: int, without: tuple[str, ...]) -> str:
    """The median of so many certificates, and their status."""
    u = np.linspace(0.0, 1.0, rows)
    shapes = 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5, 30.0 * (u * (1.0 - u)) ** 2 / SECONDS
    q, v = (np.outer(shape, GOAL - START) for shape in shapes)
    robot, taken, status = tp.robot("panda"), [], ""
    for _ in range(times + 1):  # the first one builds what the others find
        began = time.process_time()
        status = tp.certify((SECONDS * u, START + q, v), robot, obstacles=BOXES, without=without).status
        taken.append(1e3 * (time.process_time() - began))
    return f"{np.median(taken[1:]):.0f}, {status}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", default="20,200,2000", help="with commas")
    parser.add_argument("--times", type=int, default=25)
    options = parser.parse_args()
    print("| rows | CPU ms, median | without torques |\n|---|---|---|")
    for rows in map(int, options.rows.split(",")):
        cells = (milliseconds(rows, options.times, without) for without in (("jerk",), ("jerk", "torque")))
        print(f"| {rows} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
