"""What the manual's pages show, done: every block of Python and every command."""

from __future__ import annotations

import contextlib
import io
import sys
from pathlib import Path
from types import ModuleType

import pytest
from _pytest.mark.structures import ParameterSet
from helpers.manual_blocks import DOCS, Block, blocks_of, prepare, run_command

PAGES = [DOCS / "index.md", *sorted((DOCS / "how-to").glob("*.md")), *sorted((DOCS / "explanation").glob("*.md"))]
LONG = {
    "index.md",
    "how-to/figures.md",
    "how-to/compare.md",
    "how-to/logs.md",
    "how-to/moving.md",
    "how-to/own-objective.md",
    "how-to/player.md",
    "how-to/read-a-comparison.md",
    "how-to/robots.md",
    "explanation/moving.md",
}  # seconds
FAILING = "error: "  # a command that is shown with an error does end with one


def pages_with(language: str) -> list[ParameterSet]:
    return [
        pytest.param(name := str(page.relative_to(DOCS)), marks=[pytest.mark.slow] if name in LONG else [])
        for page in PAGES
        if any(block.language == language and not block.caption for block in blocks_of(page))
    ]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    prepare(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def write_files(blocks: list[Block], folder: Path) -> None:
    for block in blocks:
        if block.caption:
            (folder / block.caption).write_text(block.body)


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


@pytest.mark.slow
@pytest.mark.parametrize("page", pages_with("console"))
def test_the_commands_of_a_page_run(page: str, folder: Path) -> None:
    blocks = blocks_of(DOCS / page)
    write_files(blocks, folder)
    for block in blocks:
        for command in block.commands if block.language == "console" else ():
            done = run_command(command, folder)
            assert done.returncode == 0 or FAILING in block.body, f"{command}\n{done.stderr}"
            if FAILING in block.body and done.returncode:
                assert done.stderr.strip() in block.body


def test_no_block_is_of_an_unknown_kind() -> None:
    """A misspelt language would be a block that nobody runs."""
    known = {"", "python", "console", "toml", "text", "json", "csv", "{toctree}", "{eval-rst}"}
    for page in PAGES:
        assert {block.language for block in blocks_of(page)} <= known, page
