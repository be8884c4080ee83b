"""Do two checkouts plan the same, byte for byte?

    python -m benchmarks.same_results record CHECKOUT FOLDER
    python -m benchmarks.same_results compare FOLDER OTHER_FOLDER

``record`` solves, times, trades off or simulates every file of ``examples/`` and every built-in case with the code of
a checkout, and keeps the exit status and every trajectory (CSV) of each; ``compare`` says which of them differ
between two recordings, and ends with 1 where any does. Seeds are fixed and budgets are the files' own, so that a
change that is not meant to change results leaves no difference, whatever the load of the machine.
``benchmarks/results/same_results`` is a recording of 26 November 2026, with CasADi 3.8, NumPy 2.4 and SciPy 1.17; the
code has been reorganised since, and compared with it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

CASES = (
    *(f"{kind}-{links}" for kind in ("time", "rotation") for links in range(2, 6)),
    *(f"obstacle-{links}" for links in range(3, 6)),
    *(f"{path}-{objective}" for path in ("pentagram", "closed-curve") for objective in ("time", "rotation")),
)
OTHER_COMMANDS = {  # by example: how it is run, where that is not by solving it
    "arm": ("retime", "waypoints.csv", "--robot", "arm.toml"),
    "pareto": ("pareto", "pareto.toml", "--objectives", "time,energy", "--points", "3"),
    "simulation-plane": ("simulate", "simulation-plane.toml"),
    "simulation-panda": ("simulate", "simulation-panda.toml"),
}
WITHOUT_PLOTS = {"solve", "retime", "pareto", "simulate"}


def commands(checkout: Path) -> dict[str, tuple[str, ...]]:
    """The command of each built-in case and of each example, by name."""
    examples = sorted(path.stem for path in (checkout / "examples").glob("*.toml"))
    return {name: ("solve", name) for name in CASES} | {
        f"examples/{name}": OTHER_COMMANDS.get(name, ("solve", f"{name}.toml")) for name in examples
    }


def record(checkout: Path, folder: Path) -> None:
    """Run what is not recorded in the folder yet; a JSON file for each command."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, command in commands(checkout).items():
        kept = folder / f"{name.replace('/', '-')}.json"
        if not kept.exists():
            outcome = run(checkout, command)
            kept.write_text(json.dumps(outcome, indent=1) + "\n", encoding="utf-8")
            print(f"{name}: exit status {outcome['status']}, {len(outcome['tables'])} tables", flush=True)


def run(checkout: Path, command: tuple[str, ...]) -> dict[str, object]:
    """The exit status of a command and the digests of the tables that it writes.

    Of a simulation the status alone counts: what its planner does depends on how soon it answers.
    """
    plain = ("--no-plots",) if command[0] in WITHOUT_PLOTS else ()
    with TemporaryDirectory() as out:
        line = [sys.executable, "-m", "tpbso_casadi", *command, "--out", f"{out}/run", *plain]
        environment = os.environ | {"PYTHONPATH": str(checkout)}
        done = subprocess.run(line, cwd=checkout / "examples", env=environment, capture_output=True, check=False)
        tables = {
            str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(Path(out).rglob("trajectory.csv"))  # other tables hold seconds
            if command[0] != "simulate"
        }
    return {"status": done.returncode, "tables": tables}


def compare(one: Path, two: Path) -> int:
    """Print what differs between two recordings; returns the exit status."""
    first, second = ({path.stem: json.loads(path.read_text()) for path in sorted(f.glob("*.json"))} for f in (one, two))
    different = [name for name in first.keys() | second.keys() if first.get(name) != second.get(name)]
    for name in sorted(different):
        print(f"{name}: {first.get(name, 'not recorded')} here, {second.get(name, 'not recorded')} there")
    print(f"{len(first)} and {len(second)} commands recorded, {len(different)} differ")
    return 1 if different else 0


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    subparsers = parser.add_subparsers(required=True, dest="what")
    for what, paths in (("record", ("checkout", "folder")), ("compare", ("folder", "other"))):
        sub = subparsers.add_parser(what)
        for path in paths:
            sub.add_argument(path, type=Path)
    arguments = parser.parse_args()
    if arguments.what == "compare":
        return compare(arguments.folder, arguments.other)
    record(arguments.checkout.resolve(), arguments.folder.resolve())
    return 0


if __name__ == "__main__":
    sys.exit(main())
