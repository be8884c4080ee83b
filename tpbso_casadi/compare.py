"""``python -m tpbso_casadi.compare``: many scenarios, solvers and seeds, and what the runs say."""

from __future__ import annotations

import sys

from tpbso_casadi.cli.compare import main

if __name__ == "__main__":
    sys.exit(main())
