"""The suite in C: what is written, and the library that it builds, against Python."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np
import pytest
from helpers.compilers import each_compiler

import tpbso_casadi as tp
from problems.evaluation import NativeUnavailable, usable_compiler
from tpbso_casadi.cli.commands.suite import main
from tpbso_casadi.storage import OutputError
from tpbso_casadi.suite import InvalidSuite, Suite, SuiteProblem, c_sources

STATED = ["--functions", "spline-2,time-energy-3,constrained-3", "--instances", "1,7"]
NAMES = [f"{name}@{k}" for name in ("spline-2", "constrained-3", "time-energy-3") for k in (1, 7)]


class Shown(ctypes.Structure):
    """``arm_motion`` of the header."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        *((name, ctypes.c_int) for name in ("variables", "objectives", "constraints")),
        *((name, ctypes.POINTER(ctypes.c_double)) for name in ("lower", "upper")),
        *((name, ctypes.c_double) for name in ("feasible_merit", "best_known", "lower_bound")),
        ("content", ctypes.c_void_p),
    )


def only(*names: str) -> Suite:
    return Suite("arm-motions-1", tuple(tp.suite()[name] for name in names))


def make(folder: Path, *variables: str) -> None:
    """Build the library, where that can be done, with variables of the Makefile."""
    try:
        usable_compiler()
        done = subprocess.run(["make", "-C", folder, *variables], capture_output=True, text=True, check=False)
    except (NativeUnavailable, FileNotFoundError) as error:
        pytest.skip(str(error))
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.mark.process
@each_compiler
def test_a_library_in_c_has_the_bits_of_python(compiler: str, tmp_path: Path) -> None:
    folder = tmp_path / "in c"
    assert main(["export", str(folder), *STATED]) == 0
    make(folder, f"CXX={compiler}", "CC=clang" if compiler == "clang++" else "CC=gcc")
    library = ctypes.CDLL(str(folder / "libarm_motions.so"))
    for found in (library.arm_motions_at, library.arm_motions_find):
        found.restype = ctypes.POINTER(Shown)
    assert library.arm_motions_count() == len(NAMES)
    assert not library.arm_motions_at(-1) and not library.arm_motions_at(len(NAMES))
    assert not library.arm_motions_find(b"arm-motions-1/spline-2@2") and not library.arm_motions_find(None)
    assert library.arm_motions_find(b"spline-2@7").contents.name == b"arm-motions-1/spline-2@7"
    for number, name in enumerate(NAMES):
        problem = tp.suite()[name]
        shown = library.arm_motions_find(problem.name.encode())
        assert ctypes.addressof(shown.contents) == ctypes.addressof(library.arm_motions_at(number).contents)
        compare(library, shown, problem)
    lines = subprocess.run([folder / "example"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert [line.partition(":")[0] for line in lines] == [tp.suite()[name].name for name in NAMES]
    assert all("the suite's bits" in line for line in lines)


def compare(library: ctypes.CDLL, shown: ctypes._Pointer[Shown], problem: SuiteProblem) -> None:
    """All that the library says of a problem."""
    of, d = shown.contents, problem.dimension
    shape = (of.variables, of.objectives, of.constraints)
    assert shape == (d, len(problem.objectives), len(problem.constraint_names))
    assert [of.lower[:d], of.upper[:d]] == [corner.tolist() for corner in problem.bounds]
    assert of.feasible_merit == problem.feasible_merit
    known, bound = problem.best_known, problem.lower_bound
    np.testing.assert_equal(of.best_known, np.nan if known is None else known.value)
    np.testing.assert_equal(of.lower_bound, np.nan if bound is None else bound)
    assert library.arm_motions_is_intact(shown) == 1

    points = np.random.default_rng(2).uniform(*problem.bounds, (133, d))  # more than two blocks
    points[3, 0], points[70, d - 1] = np.nan, problem.bounds[1][-1] * 2.0 + 1.0
    values = [np.zeros((133, columns)) for columns in shape[1:2] * 2 + shape[2:]]
    addresses = [ctypes.c_void_p(array.ctypes.data) for array in (points, *values)]
    library.arm_motions_evaluate(shown, addresses[0], ctypes.c_longlong(133), *addresses[1:])
    expected = problem.values(points)
    assert np.isinf(expected.merit[[3, 70]]).all()
    for one, other in zip(values, expected, strict=True):
        np.testing.assert_array_equal(one, other.reshape(one.shape))
    again = np.zeros_like(values[0])
    into = ctypes.c_void_p(again.ctypes.data)
    copied = Shown.from_buffer_copy(shown.contents)
    library.arm_motions_evaluate(ctypes.byref(copied), addresses[0], ctypes.c_longlong(133), into, None, None)
    np.testing.assert_array_equal(again, values[0])


@pytest.mark.process
def test_a_library_of_other_values_says_so(tmp_path: Path) -> None:
    only("spline-2@1").export(tmp_path)
    table = tmp_path / "problems" / "table.cpp"
    text = table.read_text()
    table.write_text(text.replace("0x", "0x1", 1))  # a corner of the box
    assert table.read_text() != text
    make(tmp_path)
    library = ctypes.CDLL(str(tmp_path / "libarm_motions.so"))
    library.arm_motions_at.restype = ctypes.POINTER(Shown)
    assert library.arm_motions_is_intact(library.arm_motions_at(0)) == 0


def test_what_is_written_replaces_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "c"
    assert main(["export", str(folder), "--functions", "paper-time-3", "--instances", "2"]) == 0
    assert f"written: arm-motions-1/paper-time-3@2; `make -C {folder}` builds a library" in capsys.readouterr().out
    written = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    own = {"Makefile", "arm_motions.cpp", "arm_motions.h", "example.c", "problem.hpp"}
    assert written == own | {"problems/arm_motions_1_paper_time_3_0.cpp", "problems/table.cpp"}
    assert "arm-motions-1/paper-time-3@2" in (folder / "problems" / "table.cpp").read_text()
    assert main(["export", str(folder), "--functions", "paper-time-3"]) == 2
    assert capsys.readouterr().err.strip().endswith(f"{folder}: holds something already; name a new folder")


@pytest.mark.process
def test_several_libraries_of_one_process_are_apart(tmp_path: Path) -> None:
    counts = []
    for names in (["spline-2@1"], ["paper-time-3@1", "spline-2@2"]):
        folder = only(*names).export(tmp_path / str(len(names)))
        make(folder)
        library = ctypes.CDLL(str(folder / "libarm_motions.so"), mode=ctypes.RTLD_GLOBAL)
        library.arm_motions_at.restype = ctypes.POINTER(Shown)
        assert library.arm_motions_is_intact(library.arm_motions_at(0)) == 1
        counts.append(library.arm_motions_count())
    assert counts == [1, 2]


def test_instances_of_a_function_need_not_be_together_nor_differ(tmp_path: Path) -> None:
    folder = only("paper-time-3@2", "spline-2@1", "paper-time-3@1", "paper-time-3@2").export(str(tmp_path / "c"))
    kernel = (folder / "problems" / "arm_motions_1_paper_time_3_0.cpp").read_text()
    assert [f"numbers_{k}[]" in kernel for k in (1, 2, 3)] == [True, True, False]


def test_versions_of_a_function_have_kernels_of_their_own(tmp_path: Path) -> None:
    both = tuple(tp.suite(version=version)["energy-3@1"] for version in (1, 2))
    folder = Suite("both", both).export(tmp_path / "c")
    kernels = [(folder / "problems" / f"arm_motions_{version}_energy_3_0.cpp").read_text() for version in (1, 2)]
    assert kernels[0].replace("motions_1", "motions_2") != kernels[1]
    table = (folder / "problems" / "table.cpp").read_text()
    assert all(f'"{each.name}"' in table for each in both)


def test_a_failure_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(c_sources, "_table", fail)
    with pytest.raises(KeyboardInterrupt):
        only("paper-time-3@2").export(tmp_path / "c")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InvalidSuite, match="there is no problem to write"):
        only().export(tmp_path / "c")
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is a file, not a folder"):
        only("paper-time-3@2").export(tmp_path / "file")


def test_other_values_are_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SuiteProblem, "is_intact", lambda _: False)
    with pytest.raises(InvalidSuite, match=r"spline-2@1: this machine does not give the suite's values"):
        only("spline-2@1").export(tmp_path / "c")
    assert not (tmp_path / "c").exists()
