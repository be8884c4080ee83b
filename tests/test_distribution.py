"""What is published: a wheel and an sdist, installed into an environment of their own, where every command runs."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
import yaml
from helpers.compilers import COMPILERS

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
PACKAGES = ("problems", "solvers", "tpbso_casadi")
LEFT_OUT = shutil.ignore_patterns(".*", "*.egg-info", "build", "dist", "_build", "runs", "__pycache__")
BACKEND = {"TPBSO_CASADI_BACKEND": "vm"}  # no compiler is needed


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the wheel and the sdist; the wheel is built from the sdist."""
    pytest.importorskip("build")
    source, target = tmp_path_factory.mktemp("source") / "tree", tmp_path_factory.mktemp("dist")
    shutil.copytree(ROOT, source, ignore=LEFT_OUT)
    said([sys.executable, "-m", "build", "--no-isolation", "--outdir", str(target), str(source)], target)
    return target


def installed(archive: Path, folder: Path) -> Path:
    """The programs of an environment that holds an archive, and of ours only what it depends on."""
    venv.create(folder, with_pip=False)
    [packages] = folder.glob("lib/python*/site-packages")
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")  # whose .pth files are not read
    pip = [sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python"), "install", "-q", "--no-deps"]
    said([*pip, "--no-index", "--no-build-isolation", "--ignore-installed", str(archive)], folder)
    return folder / "bin"


@pytest.fixture(scope="session")
def programs(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    [wheel] = built.glob("*.whl")
    return installed(wheel, tmp_path_factory.mktemp("wheel") / "venv")


def said(command: list[str], folder: Path) -> str:
    """The output of a command in a folder that knows nothing of our sources."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | BACKEND
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def run(programs: Path, folder: Path, program: str, *arguments: str) -> str:
    """The output of an installed program."""
    return said([str(programs / program), *arguments], folder)


@pytest.mark.process
def test_the_wheel_holds_the_packages_and_their_data(built: Path) -> None:
    [wheel] = built.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    sources = {
        str(path.relative_to(ROOT))
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert sources == {name for name in names if name.split("/")[0] in PACKAGES}
    assert {name.split("/")[0] for name in names} == {*PACKAGES, f"tpbso_casadi-{PROJECT['version']}.dist-info"}
    assert {f"{package}/py.typed" for package in PACKAGES} < names
    assert "-cp311-abi3-" in wheel.name  # which every later Python takes, too


@pytest.mark.process
def test_the_sdist_holds_tests_and_manual_too(built: Path) -> None:
    [sdist] = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    needed = {"README.md", "LICENSE", "NOTICE", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "pyproject.toml"}
    assert needed | {"tests/test_distribution.py", "examples/cart.toml", "docs/index.md"} <= names
    assert not [name for name in names if "__pycache__" in name or name.endswith(".pyc")]


@pytest.mark.process
def test_a_motion_is_planned_from_the_wheel(programs: Path, tmp_path: Path) -> None:
    assert PROJECT["version"] in run(programs, tmp_path, "tpbso", "--version")
    run(programs, tmp_path, "tpbso", "solve", "time-2", "--evaluations", "300", "--out", "run", "--animate", "run.html")
    assert "certified" in run(programs, tmp_path, "tpbso", "audit", "run")
    assert json.loads((tmp_path / "run" / "result.json").read_text())["feasible"]
    script = "import tpbso_casadi as tp; print(tp.__file__, tp.__version__, tp.plan('time-2', evaluations=300))"
    line = run(programs, tmp_path, "python", "-c", script)
    assert line.startswith(str(programs.parent)) and "certified" in line


@pytest.mark.process
def test_a_class_in_the_working_folder_is_found(programs: Path, tmp_path: Path) -> None:
    (tmp_path / "walking.py").write_text("from solvers import PSO\n\n\nclass Walking(PSO):\n    ...\n")
    options = ["--solver", "walking:Walking", "--evaluations", "300", "--no-plots", "-o", "run"]
    run(programs, tmp_path, "tpbso", "solve", "time-2", *options)
    assert json.loads((tmp_path / "run" / "result.json").read_text())["solver"]["name"] == "walking:Walking"


@pytest.mark.process
@pytest.mark.slow
def test_every_command_runs_from_the_wheel(programs: Path, tmp_path: Path) -> None:
    for example in ("simulation-plane.toml", "waypoints.csv", "arm.toml", "pareto.toml"):
        shutil.copy(ROOT / "examples" / example, tmp_path)
    search = ("--evaluations", "300")
    commands = [
        ("solve", "time-3", *search, "--out", "solved"),
        ("audit", "solved"),
        ("compare", "time-2", "--solvers", "pso,ga", "--runs", "3", *search, "--out", "compared"),
        ("retime", "waypoints.csv", "--robot", "arm.toml", "--out", "retimed"),
        ("pareto", "pareto.toml", "--objectives", "time,energy", "--points", "2", *search, "--out", "front"),
        ("robots", "show", "panda", "--figure", "panda.png"),
        ("simulate", "simulation-plane.toml", "--seconds", "0.3", "--out", "simulated"),
        ("reproduce", "--quick", "--out", "paper"),
    ]
    listed = set(re.findall(r"^  tpbso (\w+) ", run(programs, tmp_path, "tpbso", "--help"), flags=re.M))
    assert {name for name, *_ in commands} <= listed
    for command in commands:
        run(programs, tmp_path, "tpbso", *command)
        run(programs, tmp_path, "python", "-m", f"tpbso_casadi.{command[0]}", "--help")
    assert (tmp_path / "paper" / "report.html").exists()


@pytest.mark.process
@pytest.mark.slow
def test_the_sdist_installs(built: Path, tmp_path: Path) -> None:
    [sdist] = built.glob("*.tar.gz")
    programs = installed(sdist, tmp_path / "venv")
    run(programs, tmp_path, "tpbso", "solve", "time-2", "--evaluations", "300", "--no-plots", "--out", "run")
    assert "certified" in run(programs, tmp_path, "tpbso", "audit", "run")


def test_the_version_is_the_same_everywhere() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    number, date = re.findall(
        r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$", (ROOT / "CHANGELOG.md").read_text(), re.M
    )[0]
    assert citation["version"] == number == PROJECT["version"]
    assert str(citation["date-released"]) == date


def test_continuous_integration_elsewhere_runs_the_same() -> None:
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text())
    [job] = workflow["jobs"].values()
    assert ".ci/run" in [step.get("run") for step in job["steps"]]
    matrix = job["strategy"]["matrix"]
    assert job["env"] == {"CXX": "${{ matrix.compiler }}"}
    assert {*matrix["compiler"], *(each["compiler"] for each in matrix["include"])} == set(COMPILERS)
