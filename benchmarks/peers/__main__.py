"""Print all tables."""

from __future__ import annotations

import argparse
import sys

import benchmarks.peers
from benchmarks.peers.moving_ends import moving_ends
from benchmarks.peers.planar_plans import planar_plans
from benchmarks.peers.report import Size
from benchmarks.peers.rest_moves import rest_moves
from benchmarks.peers.space.command import add_space_options, compare_in_space
from benchmarks.peers.waypoint_paths import waypoint_paths

TABLES = (rest_moves, moving_ends, waypoint_paths, planar_plans)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.peers",
        description=benchmarks.peers.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--moves", type=int, default=1000)
    parser.add_argument("--paths", type=int, default=500)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="a tenth of the cases or less")
    add_space_options(parser)
    options = parser.parse_args()
    if options.space is not None:
        sys.exit(compare_in_space(options))
    size = Size(100, 20, options.workers) if options.quick else Size(options.moves, options.paths, options.workers)
    for table in TABLES:
        table(size).print()


if __name__ == "__main__":
    main()
