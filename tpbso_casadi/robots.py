"""``python -m tpbso_casadi.robots``: the robots that are built in, and what is known of one or of a URDF."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.robots", "python -m tpbso_casadi.robots")
