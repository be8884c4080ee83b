"""``python -m tpbso_casadi.simulate``: plan again and again while a simulated arm moves among simulated obstacles."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.simulate", "python -m tpbso_casadi.simulate")
