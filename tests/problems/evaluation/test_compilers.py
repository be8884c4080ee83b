"""Compilers that fail, hang, lie or have no room: nothing waits for them, one line says why, other code evaluates."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import gettempdir

import pytest
from helpers.evaluation import needs_compiler, points, same_bits, small, source_of

from problems.base import cache
from problems.evaluation import EvaluationOptions, PopulationFunction, compiler, native
from problems.evaluation.compiler import (
    FLAGS,
    MAX_OUTPUT,
    NativeUnavailable,
    NoAnswer,
    asked_version,
    find_compiler,
    run,
)
from problems.evaluation.native import compile_library, find_library, name_of

pytestmark = pytest.mark.usefixtures("cache_folder", "compiled_once")
LONG = 1000.0  # s; a test that waits for so long fails by the run's own deadline


def shell(folder: Path, script: str) -> str:
    """A program of a few lines."""
    path = folder / "compiler"
    path.write_bytes(b"#!/bin/sh\n" + script.encode() + b"\n")
    path.chmod(0o700)
    return str(path)


def test_a_program_is_asked_with_its_input_and_answers() -> None:
    answer = run(["cat"], LONG, "first\nsecond\n")
    assert (answer.status, answer.output, answer.first_line) == (0, "first\nsecond\n", "first")
    assert run(["sh", "-c", "echo no >&2; exit 3"], LONG).status == 3
    assert run(["sh", "-c", "kill -9 $$"], LONG).status == -9


@pytest.mark.process
def test_what_a_program_started_ends_with_it(tmp_path: Path) -> None:
    pids = tmp_path / "pids"
    with pytest.raises(NoAnswer, match=r"^sh did not end within 0\.5 s$"):
        run(["sh", "-c", f"sleep {LONG:g} & echo $! > {pids}; wait"], 0.5)
    deadline = time.monotonic() + 10.0
    while is_running(int(pids.read_text())) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not is_running(int(pids.read_text()))


def is_running(pid: int) -> bool:
    """Whether a process runs; one that has ended but that nobody has waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_program_that_leaves_its_output_open_is_not_waited_for(tmp_path: Path) -> None:
    pids = tmp_path / "pids"
    answer = run(["sh", "-c", f"echo done; sleep {LONG:g} & echo $! > {pids}"], LONG)
    assert answer.first_line == "done"
    os.kill(int(pids.read_text()), 9)


def test_a_program_that_closes_its_output_and_stays_is_ended() -> None:
    with pytest.raises(NoAnswer):
        run(["sh", "-c", f"exec >&- 2>&-; sleep {LONG:g}"], 0.3)


def test_a_program_that_never_stops_printing_is_ended_and_not_stored() -> None:
    with pytest.raises(NoAnswer):
        run(["yes"], 0.3)
    assert len(run([sys.executable, "-c", f"print('x' * {10 * MAX_OUTPUT})"], LONG).output) == MAX_OUTPUT


def test_the_first_line_is_short_and_plain() -> None:
    answer = run(["printf", r"\n\033[31m\377\000 bad\tflag\n" + "x" * 999], LONG)
    assert answer.first_line == "[31m\N{REPLACEMENT CHARACTER}  bad flag"
    assert len(run(["printf", "y" * 999], LONG).first_line) == 200


VERSION = '[ "$1" = --version ] && echo 1.0 && exit 0\n'
SCRIPTS: dict[str, tuple[str, str]] = {
    "complains": (VERSION + "echo no such flag >&2; exit 4", "failed: no such flag"),
    "silent": (VERSION + "exit 0", "left no library"),
    "no version": (f"sleep {LONG:g}", "no C++ compiler"),
    "no library": (f"{VERSION}sleep {LONG:g}", "did not end within 0.3 s"),
    "prints rubbish": (VERSION + r"printf '\377\376\033[2J'; exit 1", "failed: "),
    "no compiler at all": (r"printf '\377\376\000'; exit 1", "no C++ compiler"),
    "none on the path": ("", "no C++ compiler"),
}


@pytest.mark.parametrize(("script", "says"), SCRIPTS.values(), ids=SCRIPTS)
def test_without_a_compiler_that_works_the_virtual_machine_evaluates(
    script: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    monkeypatch.setattr(compiler, "VERSION_SECONDS", 0.3 if script.startswith("sleep") else LONG)
    monkeypatch.setattr(compiler, "COMPILE_SECONDS", 0.3 if "sleep" in script else LONG)
    if script:
        monkeypatch.setenv("CXX", shell(tmp_path, script))
    else:
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.delenv("CXX", raising=False)
    expected = PopulationFunction(small(), EvaluationOptions("vm"))(points())
    for backend in ("auto", "native"):
        evaluate = PopulationFunction(small(), EvaluationOptions(backend))
        for _ in range(2):
            assert same_bits(evaluate(points()), expected)
        assert evaluate.backend == "vm"
        assert len(caplog.messages) == (backend == "native")
    [line] = caplog.messages
    assert line.startswith("evaluated by CasADi's virtual machine")
    assert says in line
    assert line.isprintable()
    assert len(line) < 300
    assert not list(cache.folder().glob("*.so"))


@needs_compiler
def test_the_version_of_a_compiler_need_not_be_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = find_compiler().command[0]
    rubbish = r"""[ "$1" = --version ] && printf '\377\376\000'"""
    monkeypatch.setenv("CXX", shell(tmp_path, f'{rubbish}\nexec {real} "$@"'))
    assert PopulationFunction(small(), EvaluationOptions("native"))(points()).size
    assert cache.find(native.key(name_of(source_of(small())), find_compiler())) is not None


def test_a_compiler_that_lies_makes_nothing_that_is_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cache_folder: Path
) -> None:
    monkeypatch.setenv("CXX", shell(tmp_path, VERSION + 'for last; do :; done; echo "no library" > "$last"'))
    with pytest.raises(NativeUnavailable, match="cannot be loaded"):
        compile_library(source_of(small()))
    assert find_library(name_of(source_of(small()))) is None
    assert not list(cache_folder.glob("*.so"))


@needs_compiler
def test_the_environment_names_the_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", "c++ -DNDEBUG")
    assert find_compiler().command[1:] == ("-DNDEBUG",)


def test_a_compiler_that_cannot_be_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "compiler").write_bytes(b"\x00 neither a script nor a program")
    (tmp_path / "compiler").chmod(0o700)
    for content in ("c++ 'unfinished", f"{tmp_path}/no-program", f"{tmp_path}/compiler", "no-such-compiler --fast"):
        monkeypatch.setenv("CXX", content)
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
    compile_library(source_of(small(7.0)))  # which no other test compiles
    [asking, compiling] = commands
    assert asking[1:] == ["--version"]
    flags = list(find_compiler().flags)
    assert set(flags) <= set(FLAGS)
    assert compiling[1:-1] == [*flags, "-x", "c++", "-", "-o"]


AUTO = """
from helpers.evaluation import points, small
from problems.evaluation import EvaluationOptions, PopulationFunction, population
population.WORTH_COMPILING_SECONDS = population.COMPILE_AFTER_SECONDS = -1.0
population.processors = lambda: 2
evaluate = PopulationFunction(small(), EvaluationOptions("auto"))
assert evaluate(points()).size and evaluate(points()).size
"""


@pytest.mark.process
def test_no_process_waits_for_a_background_compiler_that_hangs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pids = tmp_path / "pids"
    script = f'[ "$1" = --version ] && echo 1.0 && exit 0\necho $$ > {pids}.new; mv {pids}.new {pids}; sleep {LONG:g}'
    monkeypatch.setenv("CXX", shell(tmp_path, script))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    answer = run([sys.executable, "-c", AUTO], LONG)
    assert (answer.status, answer.output) == (0, "")
    deadline = time.monotonic() + 60.0
    while not pids.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(int(pids.read_text()), 9)  # the compiler leads a group of its own


# A full disk


@needs_compiler
@pytest.mark.parametrize("full", ["cache", "everything"])
def test_a_full_disk_costs_time_and_nothing_else(full: str, monkeypatch: pytest.MonkeyPatch) -> None:
    real = native.NamedTemporaryFile

    def no_room(*args: object, **options: object) -> object:
        if full == "everything" or options.get("dir") is not None:
            raise OSError(28, "No space left on device")
        return real(*args, **options)  # type: ignore[call-overload]

    def no_room_to_write(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(native, "NamedTemporaryFile", no_room)
    monkeypatch.setattr(cache, "_write", no_room_to_write)
    evaluate = PopulationFunction(small(), EvaluationOptions("native"))
    assert same_bits(evaluate(points()), PopulationFunction(small(), EvaluationOptions("vm"))(points()))
    assert evaluate.backend == ("native" if full == "cache" else "vm")
    assert not list(cache.folder().iterdir())


def test_no_temporary_folder_at_all(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    assert gettempdir() == str(tmp_path / "nowhere")
    with pytest.raises(NativeUnavailable):
        compile_library(source_of(small(8.0)))  # which no other test compiles


@pytest.mark.parametrize("name", ["x" * 5000, "a/" * 3000, "file/below"])
def test_an_impossible_cache_folder(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("mine")
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / name))
    assert not cache.writable()
    assert cache.scratch() is None
    assert cache.find(cache.key_of("library")) is None
    assert PopulationFunction(small(), EvaluationOptions("auto"))(points()).size
