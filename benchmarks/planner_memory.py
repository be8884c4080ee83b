"""Memory and CPU seconds of many plans through one planner, and what is symbolic in them after the first.

python -m benchmarks.planner_memory --plans 1000
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

import tpbso_casadi as tp

HOME = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)  # rad
SPREAD = 0.6  # rad
MEGABYTE = 2**20


def main() -> None:
    """Plan random moves of a Panda beside a box and print a line now and then."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plans", type=int, default=1000)
    parser.add_argument("--every", type=int, default=100)
    options = parser.parse_args()
    planner = tp.Planner("panda", obstacles=[tp.Box(center=(0.5, 0.0, 0.3), size=(0.1, 0.4, 0.2))])
    rng, made, certified, refused = np.random.default_rng(0), count_functions(), 0, 0
    began = time.process_time()
    for number in range(1, options.plans + 1):
        start, goal = (tp.Joints(tuple(np.add(HOME, rng.uniform(-SPREAD, SPREAD, 7)).tolist())) for _ in range(2))
        try:
            certified += planner.plan(start, goal).planned.feasible
        except tp.ScenarioError:  # it starts or ends in contact
            refused += 1
        if number % options.every == 0 or number == 1:
            each = (time.process_time() - began) / options.every
            print(
                f"{number} plans ({certified} certified, {refused} refused): {resident() / MEGABYTE:.1f} MB, "
                f"{each:.3f} s of CPU each, {made.total()} symbolic functions",
                flush=True,
            )
            began = time.process_time()
            made.clear()


def resident() -> int:
    """Bytes of this process that are in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")


def count_functions() -> Counter[str]:
    """Counts, from now on, functions that are made of expressions."""
    counts: Counter[str] = Counter()
    make = ca.Function.__init__

    def counted(function: ca.Function, *arguments: Any) -> None:
        if arguments and isinstance(arguments[0], str):
            counts[arguments[0]] += 1
        make(function, *arguments)

    ca.Function.__init__ = counted
    return counts


if __name__ == "__main__":
    main()
