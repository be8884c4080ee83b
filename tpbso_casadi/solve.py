"""``python -m tpbso_casadi.solve``: plan one motion and leave its files and pictures."""

from __future__ import annotations

import sys

from tpbso_casadi.cli.solve import main

if __name__ == "__main__":
    sys.exit(main())
