"""``python -m tpbso_casadi``: the same as ``tpbso``."""

from __future__ import annotations

from tpbso_casadi.cli.tpbso import main

if __name__ == "__main__":
    main("python -m tpbso_casadi")
