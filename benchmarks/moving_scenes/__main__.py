"""Random scenes with obstacles that move: how many are solved, how fast, and whether a certificate is ever false.

Half of the scenes are in the plane, half with a Panda; see ``scenes`` for why they are hard and fair. A certificate of
clearance is checked at 20,000 times by NumPy, and by coal where that is installed. To compare, each scene is planned
with the obstacles standing where they are at t = 0, and that plan is run among the moving ones.

    python -m benchmarks.moving_scenes --scenes 200 --seed 1 --workers 2 --json moving_scenes.json
    python -m benchmarks.moving_scenes --plane 0 --space 50 --straight --alone --solver abso
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from itertools import zip_longest
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from benchmarks.moving_scenes.courses import STRAIGHT
from benchmarks.moving_scenes.judge import Outcome, judged
from benchmarks.moving_scenes.scenes import random_scenes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=200, help="half in the plane, half in space")
    parser.add_argument("--plane", type=int, help="so many in the plane instead")
    parser.add_argument("--space", type=int, help="so many in space instead")
    parser.add_argument("--seed", type=int, default=1, help="of scenes and searches")
    parser.add_argument("--evaluations", type=int, default=6000, help="of each search")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument(
        "--minutes",
        type=float,
        default=np.inf,
        help="after which no further scene is begun, nor what runs then counted",
    )
    parser.add_argument("--alone", action="store_true", help="without the plans for standing obstacles")
    parser.add_argument("--straight", action="store_true", help="all that moves at constant velocities")
    parser.add_argument("--solver", help="of the scenes; the one that is taken where none is named")
    parser.add_argument("--json", type=Path, help="where every outcome is written")
    options = parser.parse_args()
    counts = {
        2: options.scenes // 2 if options.plane is None else options.plane,
        3: options.scenes - options.scenes // 2 if options.space is None else options.space,
    }
    began = time.perf_counter()
    outcomes: list[Outcome] = []
    share = 1.0 if options.straight else STRAIGHT
    each = [list(random_scenes(dim, count, options.seed, share)) for dim, count in counts.items()]
    scenes = [scene for pair in zip_longest(*each) for scene in pair if scene is not None]
    with ProcessPoolExecutor(options.workers, mp_context=get_context("spawn")) as pool:
        futures = [
            pool.submit(judged, scene, options.evaluations, options.seed, not options.alone, options.solver)
            for scene in scenes
        ]
        for future in as_completed(futures):
            outcomes.append(future.result())
            print(line(outcomes[-1]), flush=True)
            if time.perf_counter() - began > 60.0 * options.minutes:
                pool.shutdown(wait=False, cancel_futures=True)
                break
    outcomes.sort(key=lambda outcome: (outcome.dim, int(outcome.scene.split()[-1])))
    if options.json is not None:
        options.json.write_text(json.dumps([asdict(outcome) for outcome in outcomes], indent=1))
    print(f"\n{table(outcomes)}\n{time.perf_counter() - began:.0f} s")


def line(outcome: Outcome) -> str:
    """One outcome."""
    if outcome.error:
        return f"{outcome.scene}: {outcome.error}"
    status = "certified" if outcome.feasible else "not certified"
    room = "" if outcome.room is None else f", {1e3 * outcome.room:.1f} mm left"
    return (
        f"{outcome.scene}: {status}, T = {outcome.duration:.3f} s of {outcome.bound:.3f}, {outcome.seconds:.1f} s{room}"
    )


def table(outcomes: Sequence[Outcome]) -> str:
    """What came of all of them."""
    rows = [
        "| | scenes | certified | false | T / bound: median | 90 % | planning, s: median | 90 % | still plan hit |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for dim, name in ((2, "plane"), (3, "space")):
        own = [outcome for outcome in outcomes if outcome.dim == dim]
        solved = [outcome for outcome in own if outcome.feasible]
        ratios = [outcome.duration / outcome.bound for outcome in solved if outcome.duration and outcome.bound]
        seconds = [outcome.seconds for outcome in own if not outcome.error]
        still = [outcome.still_hit for outcome in own if outcome.still_feasible]
        numbers = [
            f"{part:.{digits}f}" for values, digits in ((ratios, 3), (seconds, 1)) for part in _quantiles(values)
        ]
        false = sum(outcome.is_false for outcome in own)
        cells = [name, len(own), len(solved), false, *numbers, f"{sum(map(bool, still))} of {len(still)}"]
        rows.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(rows)


def _quantiles(values: Sequence[float]) -> tuple[float, float]:
    """The median, and what 90 % do not exceed."""
    return (float(np.median(values)), float(np.quantile(values, 0.9))) if values else (np.nan, np.nan)


if __name__ == "__main__":
    main()
