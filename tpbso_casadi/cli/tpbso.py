"""``tpbso``: all commands under one name."""

from __future__ import annotations

import sys
from typing import NoReturn

from tpbso_casadi.cli.entry import run

COMMANDS = ("solve", "audit", "compare", "retime", "pareto", "reproduce", "robots", "simulate")


def main() -> NoReturn:
    """Run the command that the first argument names, with the arguments after it."""
    command = sys.argv[1] if len(sys.argv) > 1 else ""
    if command not in COMMANDS:
        print(f"usage: tpbso {'|'.join(COMMANDS)} ...", file=sys.stderr)
        raise SystemExit(2)
    sys.argv[:2] = [f"tpbso {command}"]
    run(f"tpbso_casadi.cli.commands.{command}")


if __name__ == "__main__":
    main()
