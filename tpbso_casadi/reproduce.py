"""``python -m tpbso_casadi.reproduce``: the paper's Section IV, reproduced with one command."""

from __future__ import annotations

import sys

from tpbso_casadi.cli.reproduce import main

if __name__ == "__main__":
    sys.exit(main())
