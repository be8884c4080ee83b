"""Speedup of a campaign by a second process: the same runs with one worker and with two, in turn.

    python -m benchmarks.campaign

The ratio is that of the whole commands, start and table included. Compiled costs are made beforehand. The ceiling is
what two such commands with one worker each, side by side, do in the time of one: what the machine's processors allow.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

CASES = ["time-3", "rotation-5", "obstacle-3", "pentagram-time"]


def seconds(folders: Sequence[Path], workers: int, runs: int) -> float:
    """Seconds of campaigns run side by side, as commands."""
    command = [sys.executable, "-m", "tpbso_casadi", "compare", *CASES, "--solvers", "bso,pso,bso+polish", "--no-plots"]
    command += ["--runs", str(runs), "--quiet", "--workers", str(workers), "--out"]
    began = time.perf_counter()
    started = [subprocess.Popen([*command, str(folder)]) for folder in folders]
    for process in started:
        assert process.wait() == 0
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    ratios, ceilings = [], []
    with TemporaryDirectory() as name:
        folder = Path(name)
        seconds([folder / "warm"], 2, 3)
        for number in range(options.rounds):
            one, two = (seconds([folder / f"{number}-{workers}"], workers, options.runs) for workers in (1, 2))
            both = seconds([folder / f"{number}-a", folder / f"{number}-b"], 1, options.runs)
            ratios.append(one / two)
            ceilings.append(2.0 * one / both)
            words = f"ratio {ratios[-1]:.2f}, ceiling {ceilings[-1]:.2f}"
            print(f"one worker {one:.1f} s, two {two:.1f} s, two commands {both:.1f} s: {words}", flush=True)
    spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
    print(
        f"speedup by two processes: {np.median(ratios):.2f} (median; {spread}), of {np.median(ceilings):.2f} possible"
    )


if __name__ == "__main__":
    main()
