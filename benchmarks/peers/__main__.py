"""Print all tables."""

from __future__ import annotations

import argparse

import benchmarks.peers
from benchmarks.peers.report import Size
from benchmarks.peers.rest_moves import rest_moves
from benchmarks.peers.waypoint_paths import waypoint_paths

TABLES = (rest_moves, waypoint_paths)


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
    options = parser.parse_args()
    size = Size(100, 20, options.workers) if options.quick else Size(options.moves, options.paths, options.workers)
    for table in TABLES:
        table(size).print()


if __name__ == "__main__":
    main()
