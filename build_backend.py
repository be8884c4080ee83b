"""Setuptools as the build backend; it asks pip for a C++ compiler, Zig's Clang, where the machine has none.

Hooks of PEP 517 and PEP 660.
"""

from __future__ import annotations

import os
import platform
import shutil
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403 (the hooks that stay as they are)

COMPILERS = ("c++", "g++", "clang++")
WITH_WHEELS = ("x86_64", "aarch64", "arm64")  # processors for which there are wheels of ziglang


def compiler_from_pip() -> list[str]:
    """The requirement that brings a compiler; none where there is a compiler, or no wheel for this machine."""
    is_there = "CXX" in os.environ or any(map(shutil.which, COMPILERS))
    has_wheel = os.name == "posix" and platform.machine() in WITH_WHEELS
    return [] if is_there or not has_wheel else ["ziglang"]


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """The requirements of a build, and a compiler."""
    return [*build_meta.get_requires_for_build_wheel(config_settings), *compiler_from_pip()]


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:
    """The requirements of an editable installation, and a compiler."""
    return [*build_meta.get_requires_for_build_editable(config_settings), *compiler_from_pip()]
