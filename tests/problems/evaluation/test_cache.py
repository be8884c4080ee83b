"""Compilers that fail and caches that are damaged: nothing is lost but time."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest
from helpers.evaluation import needs_compiler, points, same_bits, small, source_of

from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, PopulationFunction, cache, population
from problems.evaluation.compiler import FLAGS, NativeUnavailable, asked_version, find_compiler
from problems.evaluation.native import compile_library, find_library, key

pytestmark = pytest.mark.usefixtures("cache_folder")
BACKGROUND = [sys.executable, "-c", "from problems.evaluation.native import fill_cache; fill_cache()"]


# Compilers


def program(folder: Path, script: str) -> str:
    """A compiler that answers --version and then does something else."""
    path = folder / "compiler"
    path.write_text(f'#!/bin/sh\n[ "$1" = --version ] && echo 1.0 && exit 0\n{script}\n')
    path.chmod(0o700)
    return str(path)


@pytest.mark.parametrize(
    ("script", "says"),
    [
        (None, "no C\\+\\+ compiler"),
        ("exit 1", "failed: status 1"),
        ("echo no such flag >&2; exit 4", "failed: no such flag"),
        ("kill -9 $$", "failed: status -9"),
        ("exit 0", "left no library"),
    ],
    ids=["none", "fails", "complains", "killed", "silent"],
)
def test_without_a_compiler_that_works_the_virtual_machine_evaluates(
    script: str | None,
    says: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    cache_folder: Path,
) -> None:
    if script is None:
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.delenv("CXX", raising=False)
    else:
        monkeypatch.setenv("CXX", program(tmp_path, script))
    evaluate = PopulationFunction(small(), EvaluationOptions("native"))
    assert same_bits(evaluate(points()), PopulationFunction(small(), EvaluationOptions("vm"))(points()))
    evaluate(points())
    [line] = caplog.messages
    assert line.startswith("evaluated by CasADi's virtual machine")
    assert re.search(says, line)
    assert not cache_folder.exists()


def test_a_compiler_that_lies_makes_nothing_that_is_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cache_folder: Path
) -> None:
    monkeypatch.setenv("CXX", program(tmp_path, 'for last; do :; done; echo "no library" > "$last"'))
    with pytest.raises(NativeUnavailable, match="cannot be loaded"):
        compile_library(source_of(small()))
    assert find_library(source_of(small())) is None
    assert not list(cache_folder.glob("*.so"))


@needs_compiler
def test_the_environment_names_the_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", "c++ -DNDEBUG")
    assert find_compiler().command[1:] == ("-DNDEBUG",)
    monkeypatch.setenv("CXX", "no-such-compiler --fast")
    with pytest.raises(NativeUnavailable, match="no-such-compiler --fast"):
        find_compiler()


@pytest.mark.parametrize("content", ["c++ 'unfinished", "{folder}/no-program", "{folder}/compiler"])
def test_a_compiler_that_cannot_be_started(content: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "compiler").write_bytes(b"\x00 neither a script nor a program")
    (tmp_path / "compiler").chmod(0o700)
    monkeypatch.setenv("CXX", content.format(folder=tmp_path))
    with pytest.raises(NativeUnavailable, match=r"CXX|no C\+\+ compiler"):
        find_compiler()


@needs_compiler
def test_nothing_of_a_function_reaches_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    commands = []
    start = subprocess.Popen

    def recorded(command: list[str], **options: object) -> object:
        commands.append(command)
        assert not options.get("shell")
        return start(command, **options)  # type: ignore[call-overload]

    monkeypatch.setattr("problems.evaluation.compiler.subprocess.Popen", recorded)
    asked_version.cache_clear()
    compile_library(source_of(small()))
    [asking, compiling] = commands
    assert asking[1:] == ["--version"]
    assert compiling[1 : 1 + len(FLAGS)] == list(FLAGS)
    assert compiling[1 + len(FLAGS) : -1] == ["-x", "c++", "-", "-o"]


# The cache


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
    assert find_library(source_of(small(2.0))) is None


def damage(path: Path, how: str) -> None:
    content = path.read_bytes()
    if how == "truncated":
        path.write_bytes(content[: len(content) // 2])
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "one bit":
        path.write_bytes(content[:1000] + bytes([content[1000] ^ 1]) + content[1001:])
    elif how == "another library":
        other = key(source_of(small(2.0)), find_compiler())
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
    "how",
    ["truncated", "empty", "one bit", "another library", "others may write", "folder of others", "a folder"],
)
def test_a_damaged_library_is_never_loaded(how: str, cache_folder: Path) -> None:
    expected = PopulationFunction(small(), EvaluationOptions("native"))(points())
    damage(library_in(cache_folder), how)
    assert find_library(source_of(small())) is None
    assert same_bits(PopulationFunction(small(), EvaluationOptions("native"))(points()), expected)
    if how not in {"folder of others", "a folder"}:
        assert find_library(source_of(small())) is not None


@needs_compiler
@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_read_only_cache(cache_folder: Path) -> None:
    cache_folder.mkdir(mode=0o500)
    assert not cache.writable()
    evaluate = PopulationFunction(small(), EvaluationOptions("native"))
    assert evaluate(points()).size
    assert evaluate.backend == "native"
    assert not list(cache_folder.iterdir())


@needs_compiler
def test_a_cache_that_is_a_file(cache_folder: Path) -> None:
    cache_folder.write_text("mine")
    evaluate = PopulationFunction(small(), EvaluationOptions("native"))
    assert evaluate(points()).size
    assert evaluate.backend == "native"
    assert cache_folder.read_text() == "mine"


def test_the_least_recently_used_libraries_go(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "MAX_LIBRARIES", 3)
    keys = [cache.key_of(str(k)) for k in range(5)]
    for age, name in enumerate(keys):
        path = cache.keep(name, b"library")
        os.utime(path, (1e9 + age, 1e9 + age))
        if age == 2:
            assert cache.find(keys[0])  # used just now
    (cache_folder / "mine.txt").write_text("kept")
    cache.keep(cache.key_of("last"), b"library")
    assert [name in {path.stem for path in cache_folder.iterdir()} for name in keys] == [
        True,
        False,
        False,
        False,
        True,
    ]
    assert (cache_folder / "mine.txt").exists()


def costs_of(backend: str) -> FloatArray:
    """What another process computes."""
    return PopulationFunction(small(3.0), EvaluationOptions(backend))(points())


@needs_compiler
def test_four_processes_compile_the_same(cache_folder: Path) -> None:
    with ProcessPoolExecutor(4, mp_context=get_context("spawn")) as pool:
        results = list(pool.map(costs_of, ["native"] * 4))
    assert all(same_bits(result, costs_of("vm")) for result in results)
    assert find_library(source_of(small(3.0))) is not None
    assert library_in(cache_folder)


@needs_compiler
def test_a_killed_compile_leaves_nothing(cache_folder: Path) -> None:
    code = "import sys; from problems.evaluation.native import native, cache; import os, signal\n"
    code += "cache._seal = lambda library, key: os.kill(os.getpid(), signal.SIGKILL)\n"
    code += "native.compile_library(sys.stdin.read())"
    process = subprocess.run([sys.executable, "-c", code], input=source_of(small()), text=True, check=False)
    assert process.returncode == -9
    assert find_library(source_of(small())) is None
    assert PopulationFunction(small(), EvaluationOptions("native"))(points()).size
    assert find_library(source_of(small())) is not None


@needs_compiler
def test_of_several_background_processes_one_compiles(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name = key(source_of(small()), find_compiler())
    assert cache.claim(name)
    assert not cache.claim(name)
    subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True)
    assert find_library(source_of(small())) is None
    monkeypatch.setattr(cache, "CLAIM_SECONDS", 0.0)
    assert cache.claim(name)
    compile_library(source_of(small()))
    assert cache.claim(name)


@needs_compiler
def test_one_background_process_compiles_at_a_time(cache_folder: Path) -> None:
    with cache.compile_lock() as ours:
        assert ours
        with cache.compile_lock() as theirs:
            assert not theirs
        subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True)
        assert find_library(source_of(small())) is None
    subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True)  # it did not claim what it did not make
    assert find_library(source_of(small())) is not None


@needs_compiler
def test_a_background_process_prints_nothing_and_fails_quietly(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CXX", "no-such-compiler")
    process = subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True, capture_output=True)
    assert (process.stdout, process.stderr) == ("", "")
    monkeypatch.delenv("CXX")
    subprocess.run(BACKGROUND, input=source_of(small()), text=True, check=True)
    assert find_library(source_of(small())) is not None
