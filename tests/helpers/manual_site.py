"""The manual, built as its readers find it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]


def built(folder: Path) -> Path:
    """The site, built strictly in a folder; notebooks are not executed. A warning fails the test.

    Skips the test where Sphinx is not installed.
    """
    pytest.importorskip("sphinx")
    options = ["-W", "--keep-going", "-q", "-d", str(folder / "doctrees"), "-D", "nb_execution_mode=off"]
    command = [sys.executable, "-m", "sphinx", *options, str(REPOSITORY / "docs"), str(folder / "site")]
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "site"
