"""``python -m tpbso_casadi.audit``: the structure of a scenario's constraints, the certificate of a run."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.audit", "python -m tpbso_casadi.audit")
