"""``python -m tpbso_casadi.pareto``: what more of one objective buys of another, as a front of certified plans."""

from __future__ import annotations

from tpbso_casadi.cli.entry import run

if __name__ == "__main__":
    run("tpbso_casadi.cli.commands.pareto", "python -m tpbso_casadi.pareto")
