"""Are the rows that are exported for a controller proven as it joins them, and how much slower are they?

Plans as in benchmarks.certificate_files; each is exported as a message, which is read back and judged as anybody's
motion: by ``tp.certify``, which joins rows as the controller does.

    python -m benchmarks.controller_rows panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml --count 139
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

import tpbso_casadi as tp
from benchmarks.certificate_files import plans
from benchmarks.motion_bench_maker.options import add_problem_options
from tpbso_casadi.facade.robots import StatedRobot
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.programs import exporter_of


def judged(plan: PlannedMotion, folder: Path) -> tp.Plan:
    """The motion that a controller makes of the message."""
    scenario = plan.scenario
    content = scenario.table()
    return tp.certify(
        str(exporter_of("ros-json").program(plan).write(folder)[0]),
        StatedRobot(scenario.robot_table),
        obstacles=content["obstacles"],
        margin=content["model"]["margin"],
        self_collision=content["model"]["self_collision"],
    )


def measure(options: argparse.Namespace) -> None:
    """Print how many are proven."""
    statuses: Counter[str] = Counter()
    slower, seconds, rows = [], [], []
    with tempfile.TemporaryDirectory() as place:
        for number, plan in enumerate(plans(options)):
            if number == options.count:
                break
            began = time.process_time()
            found = plan.controller_rows
            seconds.append(time.process_time() - began)
            slower.append(found.time_scale - 1.0)
            rows.append(len(found.times))
            again = judged(plan, Path(place))
            statuses[f"{'quintics' if found.accelerations else 'cubics'}, {again.status}"] += 1
            if not (again.certified and found.joined.feasible):
                print(found.said, [each for each in again.verdicts if not each.satisfied], file=sys.stderr, flush=True)
    print(dict(statuses))
    for name, values in (("slower, %", 100.0 * np.array(slower)), ("CPU s", seconds), ("rows", rows)):
        print(f"{name}: median {np.median(values):.2g}, worst {np.max(values):.2g}")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problems", type=Path, nargs="?", metavar="FILE", help="of problems of MotionBenchMaker")
    add_problem_options(parser, Path("runs/controller-rows"))
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0, help="of the first random move")
    parser.add_argument("--plane", action="store_true", help="random moves of planar arms")
    measure(parser.parse_args())


if __name__ == "__main__":
    main()
