"""Does a simulator that speaks Franka's protocol take the rows of ``tpbso export --as franka``?

The rows are sent by libfranka's own bindings, one for each of its cycles. First the arm is led to the first row.

    pip install franky-sim pylibfranka
    franky-sim -s mujoco &
    python -m benchmarks.franka_rows run-franka/tpbso-franka.csv 127.0.0.1
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path
from typing import Any

import numpy as np

LEADING = 4000  # ms, from where the arm stands to the first row
SETTLING = 3.0  # s
MOST_LATE = 3  # cycles that are looked back


def sent(robot: Any, rows: np.ndarray) -> np.ndarray:
    """Send rows (n, 7), rad; returns what the arm was commanded and where it was in each cycle, (n, 2, 7)."""
    from pylibfranka import ControllerMode, JointPositions  # noqa: PLC0415 (not a dependency)

    control, found = robot.start_joint_position_control(ControllerMode.JointImpedance), []
    for number, row in enumerate(rows, start=1):
        state, _ = control.readOnce()
        command = JointPositions(row.tolist())
        command.motion_finished = number == len(rows)
        control.writeOnce(command)
        found.append((state.q_d, state.q))
    return np.array(found)


def main() -> None:
    """Run the command line."""
    from pylibfranka import RealtimeConfig, Robot  # noqa: PLC0415 (not a dependency)

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", type=Path, metavar="CSV")
    parser.add_argument("host")
    options = parser.parse_args()
    with options.rows.open(newline="") as file:
        _, *lines = csv.reader(file)
    rows = np.array([line[1:-1] for line in lines], dtype=np.float64)
    robot = Robot(options.host, RealtimeConfig.kIgnore)
    here, shares = np.array(robot.read_once().q), np.linspace(0.0, 1.0, LEADING)[:, None]
    sent(robot, here + (10 * shares**3 - 15 * shares**4 + 6 * shares**5) * (rows[0] - here))
    time.sleep(SETTLING)
    commanded, arm = np.moveaxis(sent(robot, rows), 1, 0)
    late = [float(np.abs(commanded[by:] - rows[: len(rows) - by]).max()) for by in range(MOST_LATE + 1)]
    print(
        f"{len(rows)} rows taken; commanded within {min(late):.2g} rad of the row {int(np.argmin(late))} cycles before"
    )
    step, behind = np.abs(np.diff(rows, axis=0)).max(), np.abs(arm - rows).max()
    print(f"largest step of a row {step:.2g} rad; arm behind by {behind:.2g} rad")
    time.sleep(SETTLING)
    states = [robot.read_once().q for _ in range(int(1000 * SETTLING))]
    print(f"at the end off by {np.abs(np.array(states[-1]) - rows[-1]).max():.2g} rad")


if __name__ == "__main__":
    main()
