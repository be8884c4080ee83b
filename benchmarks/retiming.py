"""Retiming random paths of 6 and 7 joints with jerk limits: CPU seconds, and durations over those without jerk.

python -m benchmarks.retiming --paths 10 --waypoints 50
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing import retime

JERKS = (10.0, 50.0)  # times the acceleration limits, 1/s


def timed(seed: int, waypoints: int, jerk: float) -> tuple[float, float]:
    """CPU seconds, and the duration over the one without a jerk limit."""
    rng, k = np.random.default_rng(seed), 6 + seed % 2
    path = JointPath.through(rng.uniform(-2.0, 2.0, (waypoints, k)))
    speed, acceleration = rng.uniform(1.0, 4.0, k), rng.uniform(4.0, 20.0, k)
    free = JointLimits(speed=tuple(speed), acceleration=tuple(acceleration))
    smooth = JointLimits(speed=free.speed, acceleration=free.acceleration, jerk=tuple(jerk * acceleration))
    began = time.process_time()
    duration = retime(path, smooth).duration
    return time.process_time() - began, duration / retime(path, free).duration


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--paths", type=int, default=10)
    parser.add_argument("--waypoints", type=int, default=50)
    options = parser.parse_args()
    timed(0, 5, JERKS[0])  # loads what is loaded once
    print("| jerk limit | CPU seconds: median / 90 % / worst | over no jerk limit: median / worst |\n|---|---|---|")
    for jerk in JERKS:
        seconds, ratios = np.array([timed(seed, options.waypoints, jerk) for seed in range(options.paths)]).T
        spread = " / ".join(f"{value:.2f}" for value in np.quantile(seconds, [0.5, 0.9, 1.0]))
        print(f"| {jerk:g} a | {spread} | {np.median(ratios):.4f} / {ratios.max():.4f} |", flush=True)


if __name__ == "__main__":
    main()
