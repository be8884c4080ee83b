"""``python -m tpbso_casadi.solve``: plan one motion and write its files and figures."""

from __future__ import annotations

import sys

from tpbso_casadi.cli.solve import main

if __name__ == "__main__":
    sys.exit(main())
