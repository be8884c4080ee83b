"""``python -m tpbso_casadi.certify``: a trajectory of any program, judged for all t."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.certify", "python -m tpbso_casadi.certify")
