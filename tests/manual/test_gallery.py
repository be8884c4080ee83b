"""The gallery: each script is short, runs, and makes its picture; each command does the same."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
GALLERY = ROOT / "docs" / "gallery"
PAGE = (GALLERY / "index.md").read_text()
SECTIONS = PAGE.split("\n## ")[1:]
SCRIPTS = sorted(path.name for path in GALLERY.glob("*.py"))
MOST_LINES = 10
QUICK = {"TPBSO_CASADI_BACKEND": "auto", "MPLBACKEND": "agg", "PYTHONPATH": str(ROOT)}


def script_of(section: str) -> str:
    [name] = re.findall(r"\{literalinclude\} (\w+\.py)", section)
    return str(name)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the gallery without its pictures."""
    return Path(shutil.copytree(GALLERY, tmp_path / "gallery", ignore=shutil.ignore_patterns("*.png")))


def run(folder: Path, *command: str) -> str:
    done = subprocess.run(
        [sys.executable, *command], cwd=folder, env=os.environ | QUICK, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_page_shows_every_script_with_its_picture() -> None:
    assert sorted(map(script_of, SECTIONS)) == SCRIPTS
    for section in SECTIONS:
        picture = script_of(section).removesuffix(".py").replace("_", "-") + ".png"
        assert f"]({picture})" in section and (GALLERY / picture).exists()


@pytest.mark.parametrize("name", SCRIPTS)
def test_each_takes_ten_lines_at_most(name: str) -> None:
    text = (GALLERY / name).read_text()
    ast.parse(text)
    assert sum(bool(line.strip()) for line in text.splitlines()) <= MOST_LINES


@pytest.mark.parametrize("section", SECTIONS, ids=script_of)
def test_each_takes_one_command(section: str) -> None:
    assert len(re.findall(r"^\$ tpbso ", section, flags=re.M)) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", SCRIPTS)
def test_each_makes_its_picture(name: str, folder: Path) -> None:
    run(folder, name)
    assert (folder / name.replace("_", "-")).with_suffix(".png").stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.parametrize("section", SECTIONS, ids=script_of)
def test_each_command_works(section: str, folder: Path) -> None:
    [command] = re.findall(r"^\$ tpbso (.+)$", section, flags=re.M)
    assert run(folder, "-m", "tpbso_casadi", *command.split()).strip()
