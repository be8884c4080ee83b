"""``python -m tpbso_casadi.tracking``: the least tracking error that bounds logs of a robot, as a line of TOML."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.tracking", "python -m tpbso_casadi.tracking")
