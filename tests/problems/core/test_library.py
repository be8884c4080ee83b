"""The compiled core as a library: its source and variants."""

from __future__ import annotations

import ctypes
import re
import runpy
from pathlib import Path
from typing import Any

import pytest
import setuptools
from helpers.compilers import each_compiler
from helpers.core_answers import answers
from helpers.slow import slow_except

from problems.evaluation import THIS_PROCESSOR, usable_compiler
from problems.library import FILES, FLAGS, SIGNATURES, SOURCES, VARIANTS, core_account, loaded_core, source

ROOT = Path(__file__).parents[3]


def bodies() -> dict[str, str]:
    """Of each file what it says itself."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in sorted(SOURCES.glob("*.[ch]pp"))}
    own = r'#pragma once\n|#include "\w+\.hpp"\n'
    return {name: max(re.split(own, text), key=len) for name, text in texts.items()}


def test_every_file_is_in_the_joined_source_once() -> None:
    text = source()
    assert set(FILES) <= set(bodies())
    assert {name: text.count(body) for name, body in bodies().items()} == dict.fromkeys(bodies(), 1)
    assert '#include "' not in text and "#pragma once" not in text


def test_what_a_file_includes_of_ours_is_there() -> None:
    for path in SOURCES.glob("*.[ch]pp"):
        for name in re.findall(r'#include "([^"]+)"', path.read_text(encoding="utf-8")):
            assert (SOURCES / name).is_file(), f"{path.name}: {name}"


@pytest.fixture
def library() -> ctypes.CDLL:
    found = loaded_core().library
    if found is None:
        pytest.skip("there is no compiled core, and no compiler that makes one")
    return found


def test_functions_that_python_calls_are_defined(library: ctypes.CDLL) -> None:
    assert all(hasattr(library, name) for name in SIGNATURES)
    defined = re.findall(r"\b(core_\w+)\(", re.sub(r"//.*", "", source()))
    assert set(defined) == set(SIGNATURES)


def test_this_processor_has_a_variant(library: ctypes.CDLL) -> None:
    assert library.core_variant() in (0, 1, 2)


def test_a_compiled_core_says_by_what_and_for_what(library: ctypes.CDLL) -> None:
    made = r"compiled by (GCC|Clang|Apple Clang) \d+\.\d+\.\d+ for (AVX-512|AVX2|any processor of its kind)"
    assert re.fullmatch(made, core_account())


def flags_of_variants() -> dict[str, list[str]]:
    """Of the libraries that come with the package, by name, as ``setup.py`` states them."""
    made: dict[str, Any] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(setuptools, "setup", made.update)
        patch.chdir(ROOT)
        runpy.run_path("setup.py")
    return {part.name.rpartition(".")[2]: part.extra_compile_args for part in made["ext_modules"]}


def variant(folder: Path, *flags: str) -> ctypes.CDLL:
    path = folder / "variant.so"
    path.write_bytes(usable_compiler().library(source(), ("-shared", "-fPIC", *flags)))
    library = ctypes.CDLL(str(path))
    for function, (result, arguments) in SIGNATURES.items():
        getattr(library, function).restype, getattr(library, function).argtypes = result, arguments
    return library


@pytest.mark.process
@each_compiler
@pytest.mark.parametrize("name", slow_except(["native", "_portable", "_avx2", "_avx512"], 2))
def test_every_compiler_and_variant_gives_the_same_bits(
    compiler: str, name: str, library: ctypes.CDLL, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flags = {"native": [*FLAGS, *THIS_PROCESSOR]} | flags_of_variants()
    if name not in flags or VARIANTS[::-1].index(name if name in VARIANTS else "_portable") > library.core_variant():
        pytest.skip("not for this processor")
    monkeypatch.setenv("CXX", compiler)
    monkeypatch.setattr("problems.evaluation.compiler.COMPILE_SECONDS", 1_000.0)
    other = variant(tmp_path, *flags[name])
    assert ("Clang" in other.core_made().decode()) == ("clang" in usable_compiler().version.lower())
    for seed in range(3):
        expected, found = answers(library, seed), answers(other, seed)
        assert [what for what, part in expected.items() if found[what] != part] == []
