"""What the manual's pages show, done in order: files are written, Python is run, commands are run; and the gallery.

A block with a caption is a file of that name. Of a console block the lines that begin with ``$`` are commands.
"""

from __future__ import annotations

import ast
import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest
from _pytest.mark.structures import ParameterSet

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [DOCS / "index.md", *sorted((DOCS / "how-to").glob("*.md")), *sorted((DOCS / "explanation").glob("*.md"))]
LONG = {  # seconds
    *("index.md", "how-to/figures.md", "how-to/compare.md", "how-to/logs.md", "how-to/moving.md", "how-to/player.md"),
    *("how-to/layout.md", "how-to/own-objective.md", "how-to/read-a-comparison.md", "how-to/robots.md"),
    "explanation/replanning.md",
}
FENCE = re.compile(r"^```(?P<head>[^\n`]*)\n(?P<body>.*?)^```$", re.DOTALL | re.MULTILINE)
CAPTION = re.compile(r"\A:caption: (?P<name>\S+)\n(?::[^\n]*\n)*\n?")
FAILING = "error: "  # a command that is shown with an error does end with one


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        language: python, console, toml ...
        caption: the file that it is; "" where it is none.
        body: without fences and options.
    """

    language: str
    caption: str
    body: str

    @property
    def commands(self) -> list[str]:
        """Of a console block."""
        return [line.removeprefix("$ ") for line in self.body.splitlines() if line.startswith("$ ")]


def blocks_of(page: Path) -> list[Block]:
    found = []
    for match in FENCE.finditer(page.read_text()):
        language = match["head"].removeprefix("{code-block}").strip()
        caption = CAPTION.match(match["body"])
        body = match["body"] if caption is None else match["body"][caption.end() :]
        found.append(Block(language, caption["name"] if caption else "", body))
    return found


def pages_with(language: str) -> list[ParameterSet]:
    return [
        pytest.param(name := str(page.relative_to(DOCS)), marks=[pytest.mark.slow] if name in LONG else [])
        for page in PAGES
        if any(block.language == language and not block.caption for block in blocks_of(page))
    ]


def run(command: list[str], folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])} | more
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where commands of the manual are typed: ``tpbso`` is found, and so are the examples and modules."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (tmp_path / "bin").mkdir()
    script = tmp_path / "bin" / "tpbso"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tpbso_casadi.cli.tpbso "$@"\n')
    script.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{Path(sys.executable).parent}", prepend=":")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def write_files(blocks: list[Block], folder: Path) -> None:
    for block in blocks:
        if block.caption:
            file = folder / block.caption
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.body)


@pytest.mark.parametrize("page", pages_with("python"))
def test_the_python_of_a_page_runs(page: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = blocks_of(DOCS / page)
    write_files(blocks, folder)
    module = ModuleType("page")
    monkeypatch.setitem(sys.modules, "page", module)  # where dataclasses look for what annotations name
    for block in blocks:
        if block.language == "python" and not block.caption:
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(block.body, page, "exec", dont_inherit=True), vars(module))


@pytest.mark.process
@pytest.mark.slow
@pytest.mark.parametrize("page", pages_with("console"))
def test_the_commands_of_a_page_run(page: str, folder: Path) -> None:
    blocks = blocks_of(DOCS / page)
    write_files(blocks, folder)
    for block in blocks:
        for command in block.commands if block.language == "console" else ():
            done = run(["bash", "-c", command], folder, COLUMNS="100")
            assert done.returncode == 0 or FAILING in block.body, f"{command}\n{done.stderr}"
            if FAILING in block.body and done.returncode:
                assert done.stderr.strip() in block.body


def test_no_block_is_of_an_unknown_kind() -> None:
    """A misspelt language would be a block that nobody runs."""
    known = {"", "python", "console", "toml", "text", "json", "csv", "{toctree}", "{eval-rst}"}
    unknown = {page.name: {block.language for block in blocks_of(page)} - known for page in PAGES}
    assert not {page: languages for page, languages in unknown.items() if languages}


# The gallery

GALLERY = DOCS / "gallery"
SECTIONS = (GALLERY / "index.md").read_text().split("\n## ")[1:]
MOST_LINES = 10


def script_of(section: str) -> str:
    [name] = re.findall(r"\{literalinclude\} (\w+\.py)", section)
    return str(name)


def command_of(section: str) -> str:
    [command] = re.findall(r"^\$ tpbso (.+)$", section, flags=re.M)
    return str(command)


def test_the_gallery_shows_every_short_script_with_its_picture_and_command() -> None:
    scripts = sorted(GALLERY.glob("*.py"))
    assert sorted(map(script_of, SECTIONS)) == [script.name for script in scripts]
    for section in SECTIONS:
        picture = script_of(section).removesuffix(".py").replace("_", "-") + ".png"
        assert f"]({picture})" in section and (GALLERY / picture).exists()
        assert command_of(section)
    for script in scripts:
        assert ast.parse(script.read_text()).body
        assert sum(bool(line.strip()) for line in script.read_text().splitlines()) <= MOST_LINES, script


@pytest.mark.process
@pytest.mark.slow
@pytest.mark.parametrize("section", SECTIONS, ids=script_of)
def test_each_makes_its_picture_and_its_command_works(section: str, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(GALLERY, tmp_path / "gallery", ignore=shutil.ignore_patterns("*.png")))
    name = script_of(section)
    for arguments in ([name], ["-m", "tpbso_casadi", *command_of(section).split()]):
        done = run([sys.executable, *arguments], folder, TPBSO_CASADI_BACKEND="auto", MPLBACKEND="agg")
        assert done.returncode == 0, done.stderr
        assert name in arguments or done.stdout.strip()
    assert (folder / name.replace("_", "-")).with_suffix(".png").stat().st_size > 10_000
