"""``python -m tpbso_casadi.solve``: plan one motion and write its files and figures."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.solve", "python -m tpbso_casadi.solve")
