"""A folder of odd files to work in, plug-ins that misbehave, and the counts of what was tried."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from fuzz.hostile import write_files, write_modules
from fuzz.outcome import BACKEND, Tally
from fuzz.values import POINT
from helpers.scenes import toml


@pytest.fixture(scope="module")
def tally() -> Iterator[Tally]:
    """Counts; shown with ``pytest -s``."""
    counts = Tally()
    yield counts
    print(f"\n{dict(sorted(counts.items()))}")


@pytest.fixture(scope="module")
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The current folder for a module of tests: odd files in it, plug-ins on the path of modules."""
    folder = tmp_path_factory.mktemp("fuzz")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setenv(BACKEND, "vm")
        patch.setenv("PYTHONPATH", str(folder), prepend=":")
        patch.syspath_prepend(str(folder))
        write_modules(folder)
        write_files(folder, toml(**POINT))
        before = set(sys.modules)
        yield folder
        for name in set(sys.modules) - before:
            if name.startswith("hostile"):
                del sys.modules[name]
