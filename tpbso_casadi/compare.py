"""``python -m tpbso_casadi.compare``: many runs of solvers on scenarios, and their statistics."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.compare", "python -m tpbso_casadi.compare")
