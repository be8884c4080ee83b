"""``python -m tpbso_casadi.audit``: the structure of a scenario's constraints, the certificate of a run."""

from __future__ import annotations

import sys

from tpbso_casadi.cli.audit import main

if __name__ == "__main__":
    sys.exit(main())
