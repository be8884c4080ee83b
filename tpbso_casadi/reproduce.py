"""``python -m tpbso_casadi.reproduce``: Section IV of the paper, again, with one command."""

from __future__ import annotations

import sys

from tpbso_casadi.cli.reproduce import main

if __name__ == "__main__":
    sys.exit(main())
