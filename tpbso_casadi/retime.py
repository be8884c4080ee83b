"""``python -m tpbso_casadi.retime``: the least time along a given path, and its files and figures."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.retime", "python -m tpbso_casadi.retime")
