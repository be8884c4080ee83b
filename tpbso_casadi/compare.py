"""``python -m tpbso_casadi.compare``: many runs of solvers on scenarios, and their statistics."""

from __future__ import annotations

import sys

from tpbso_casadi.cli.compare import main

if __name__ == "__main__":
    sys.exit(main())
