"""``python -m tpbso_casadi.reproduce``: the paper's Section IV, reproduced with one command."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.reproduce", "python -m tpbso_casadi.reproduce")
