"""The blocks of a page of the manual, done in order: files are written, Python is run, commands are run.

A block with a caption is a file of that name. Of a console block the lines that begin with ``$`` are commands.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
DOCS = REPOSITORY / "docs"
FENCE = re.compile(r"^```(?P<head>[^\n`]*)\n(?P<body>.*?)^```$", re.DOTALL | re.MULTILINE)
CAPTION = re.compile(r"\A:caption: (?P<name>\S+)\n(?::[^\n]*\n)*\n?")


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
    """The fenced blocks of a page."""
    found = []
    for match in FENCE.finditer(page.read_text()):
        language = match["head"].removeprefix("{code-block}").strip()
        caption = CAPTION.match(match["body"])
        body = match["body"] if caption is None else match["body"][caption.end() :]
        found.append(Block(language, caption["name"] if caption else "", body))
    return found


def prepare(folder: Path) -> None:
    """Let a folder be one in which commands of the manual are typed: ``tpbso`` is found, and so are the examples."""
    (folder / "examples").symlink_to(REPOSITORY / "examples")
    (folder / "bin").mkdir()
    script = folder / "bin" / "tpbso"
    script.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tpbso_casadi.cli.tpbso "$@"\n')
    script.chmod(0o755)


def run_command(command: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command of a console block in a folder."""
    paths = [str(folder), str(REPOSITORY)]
    environment = os.environ | {
        "PATH": os.pathsep.join([str(folder / "bin"), str(Path(sys.executable).parent), os.environ["PATH"]]),
        "PYTHONPATH": os.pathsep.join(paths),
        "COLUMNS": "100",
    }
    return subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
