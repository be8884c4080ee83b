"""Caches that are damaged or full, and several processes that use one: nothing is lost but time."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest
from helpers.evaluation import needs_compiler, points, same_bits, small, source_of

from problems.base import FloatArray, cache
from problems.evaluation import EvaluationOptions, PopulationFunction, population
from problems.evaluation.compiler import find_compiler
from problems.evaluation.native import compile_library, find_library, key, name_of

pytestmark = pytest.mark.usefixtures("cache_folder", "compiled_once")
BACKGROUND = [sys.executable, "-c", "from problems.evaluation.native import fill_cache; fill_cache()"]


def library_in(folder: Path) -> Path:
    [path] = folder.glob("*.so")
    return path


@needs_compiler
def test_a_second_process_finds_what_the_first_compiled(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compile_library(source_of(small()))
    assert cache_folder.stat().st_mode & 0o777 == 0o700
    assert library_in(cache_folder).stat().st_mode & 0o777 == 0o600
    monkeypatch.setattr(population, "compile_library", lambda *_: pytest.fail("compiled again"))
    assert PopulationFunction(small(), EvaluationOptions("native"))(points()).size
    assert find_library(name_of(source_of(small(2.0)))) is None


def damage(path: Path, how: str) -> None:
    content = path.read_bytes()
    if how == "truncated":
        path.write_bytes(content[: len(content) // 2])
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "one bit":
        path.write_bytes(content[:1000] + bytes([content[1000] ^ 1]) + content[1001:])
    elif how == "another library":
        other = key(name_of(source_of(small(2.0))), find_compiler())
        compile_library(source_of(small(2.0)))
        path.write_bytes((path.parent / f"{other}.so").read_bytes())
    elif how == "others may write":
        path.chmod(0o666)
    elif how == "folder of others":
        path.parent.chmod(0o777)
    elif how == "a folder":
        path.unlink()
        path.mkdir()


@needs_compiler
@pytest.mark.parametrize(
    "how", ["truncated", "empty", "one bit", "another library", "others may write", "folder of others", "a folder"]
)
def test_a_damaged_library_is_never_loaded(how: str, cache_folder: Path) -> None:
    expected = PopulationFunction(small(), EvaluationOptions("native"))(points())
    damage(library_in(cache_folder), how)
    assert find_library(name_of(source_of(small()))) is None
    assert same_bits(PopulationFunction(small(), EvaluationOptions("native"))(points()), expected)
    if how not in {"folder of others", "a folder"}:
        assert find_library(name_of(source_of(small()))) is not None


@needs_compiler
@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_read_only_cache(cache_folder: Path) -> None:
    cache_folder.mkdir(mode=0o500)
    assert not cache.writable()
    evaluate = PopulationFunction(small(), EvaluationOptions("native"))
    assert evaluate(points()).size
    assert evaluate.backend == "native"
    assert not list(cache_folder.iterdir())


def test_the_least_recently_used_libraries_go(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(cache.MOST_FILES, "so", 3)
    keys = [cache.key_of(str(k)) for k in range(5)]
    for age, name in enumerate(keys):
        path = cache.store(name, b"library")
        os.utime(path, (1e9 + age, 1e9 + age))
        if age == 2:
            assert cache.find(keys[0])  # used just now
    (cache_folder / "mine.txt").write_text("kept")
    cache.store(cache.key_of("last"), b"library")
    kept = {path.stem for path in cache_folder.iterdir()}
    assert [name in kept for name in keys] == [True, False, False, False, True]
    assert (cache_folder / "mine.txt").exists()


def costs_of(backend: str) -> FloatArray:
    """What another process computes."""
    return PopulationFunction(small(3.0), EvaluationOptions(backend))(points())


@needs_compiler
@pytest.mark.process
def test_four_processes_compile_the_same(cache_folder: Path) -> None:
    with ProcessPoolExecutor(4, mp_context=get_context("spawn")) as pool:
        results = list(pool.map(costs_of, ["native"] * 4))
    assert all(same_bits(result, costs_of("vm")) for result in results)
    assert find_library(name_of(source_of(small(3.0)))) is not None
    assert library_in(cache_folder)


@needs_compiler
@pytest.mark.process
def test_a_killed_compile_leaves_nothing(cache_folder: Path) -> None:
    code = "import os, signal, sys; from problems.base import cache; from problems.evaluation import native\n"
    code += "cache._seal = lambda content, key: os.kill(os.getpid(), signal.SIGKILL)\n"
    code += "native.compile_library(sys.stdin.read())"
    process = subprocess.run([sys.executable, "-c", code], input=source_of(small()), text=True, check=False)
    assert process.returncode == -9
    assert find_library(name_of(source_of(small()))) is None
    assert PopulationFunction(small(), EvaluationOptions("native"))(points()).size
    assert find_library(name_of(source_of(small()))) is not None


@needs_compiler
@pytest.mark.process
def test_of_several_background_processes_one_compiles(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = key(name_of(source_of(small())), find_compiler())
    assert cache.claim(name)
    assert not cache.claim(name)
    subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True)
    assert find_library(name_of(source_of(small()))) is None
    monkeypatch.setattr(cache, "CLAIM_SECONDS", 0.0)
    assert cache.claim(name)
    compile_library(source_of(small()))
    assert cache.claim(name)


@needs_compiler
@pytest.mark.process
def test_one_background_process_compiles_at_a_time(cache_folder: Path) -> None:
    with cache.compile_lock() as ours:
        assert ours
        with cache.compile_lock() as theirs:
            assert not theirs
        subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True)
        assert find_library(name_of(source_of(small()))) is None
    subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True)  # it did not claim what it did not make
    assert find_library(name_of(source_of(small()))) is not None


@needs_compiler
@pytest.mark.process
def test_a_background_process_prints_nothing_and_fails_quietly(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CXX", "no-such-compiler")
    process = subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True, capture_output=True)
    assert (process.stdout, process.stderr) == ("", "")
    monkeypatch.delenv("CXX")
    subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True)
    assert find_library(name_of(source_of(small()))) is not None
