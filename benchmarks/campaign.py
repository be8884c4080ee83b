"""What a second process is worth to a campaign: the same runs with one worker and with two, in turn.

    python -m benchmarks.campaign

The ratio is that of the whole commands, start and table included. Compiled costs are made beforehand.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

CASES = ["time-3", "rotation-5", "obstacle-3", "pentagram-time"]


def seconds(folder: Path, workers: int, runs: int) -> float:
    """Of one campaign, as a command."""
    command = [sys.executable, "-m", "tpbso_casadi.compare", *CASES, "--solvers", "bso,pso,bso+polish", "--no-plots"]
    command += ["--runs", str(runs), "--quiet", "--workers", str(workers), "--out", str(folder)]
    began = time.perf_counter()
    subprocess.run(command, check=True)
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    ratios = []
    with TemporaryDirectory() as name:
        folder = Path(name)
        seconds(folder / "warm", 2, 3)
        for number in range(options.rounds):
            one, two = (seconds(folder / f"{number}-{workers}", workers, options.runs) for workers in (1, 2))
            ratios.append(one / two)
            print(f"one worker {one:.1f} s, two {two:.1f} s, ratio {one / two:.2f}", flush=True)
    print(f"two processes are worth {np.median(ratios):.2f} (median; {min(ratios):.2f} to {max(ratios):.2f})")


if __name__ == "__main__":
    main()
