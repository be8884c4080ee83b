"""C++ compilers that results must not depend on; tests skip those that are not there."""

from __future__ import annotations

import shutil

import pytest

COMPILERS = ("g++", "clang++")
each_compiler = pytest.mark.parametrize(
    "compiler",
    [
        pytest.param(name, marks=pytest.mark.skipif(shutil.which(name) is None, reason=f"there is no {name}"))
        for name in COMPILERS
    ],
)
