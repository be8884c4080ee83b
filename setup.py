"""The compiled core, made with the package by the machine's C++ compiler, or by the one that pip brings.

Each variant is the same sources for another instruction set and computes the same numbers. They are plain libraries
that are loaded by ctypes, not modules: :mod:`problems.library`. As they use nothing of Python's, one wheel serves every
version of it.
"""

import os
import platform
import shutil
import sys
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path

from setuptools import Extension, setup

FOLDER = Path("problems/core/cpp")
SOURCES = sorted(map(str, FOLDER.glob("*.cpp")))
HEADERS = sorted(map(str, FOLDER.glob("*.hpp")))
DIGEST = sha256(b"".join(path.read_bytes() for path in sorted(FOLDER.iterdir()))).hexdigest()
FLAGS = ["-O2", "-std=c++17", "-ffp-contract=off", "-fno-math-errno", "-Wno-psabi", "-fvisibility=default"]
VARIANTS = {"_portable": []}
if platform.machine() in {"x86_64", "AMD64"}:
    VARIANTS |= {"_avx2": ["-mavx2"], "_avx512": ["-mavx512f", "-mavx512dq", "-mprefer-vector-width=512"]}

if not any(map(shutil.which, ("c++", "g++", "clang++"))) and find_spec("ziglang") is not None:
    os.environ.setdefault("CXX", f"{sys.executable} -m ziglang c++")

setup(
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
    ext_modules=[
        Extension(
            f"problems.core.{name}",
            SOURCES,
            depends=HEADERS,
            language="c++",
            define_macros=[("CORE_DIGEST", f'"{DIGEST}"')],
            extra_link_args=["-s"] if sys.platform == "linux" else [],
            py_limited_api=True,
            extra_compile_args=[*FLAGS, *flags],
            optional=True,  # where no compiler works all the rest is installed
        )
        for name, flags in VARIANTS.items()
        if sys.platform != "win32"
    ],
)
