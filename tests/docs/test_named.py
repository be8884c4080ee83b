"""What the manual, the README and CONTRIBUTING name is there: files, commands, and options of these.

Files are named in backticks and by links, with their folder or without; commands in backticks and in blocks.
"""

from __future__ import annotations

import argparse
import ast
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest
from helpers.commands import parser_of

from tpbso_casadi.cli.tpbso import COMMANDS

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES += sorted((ROOT / "benchmarks" / "results").glob("*.md"))
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]
FOLDERS = ("problems", "solvers", "tpbso_casadi", "tests", "benchmarks", "docs", "examples", ".ci")
SOURCES = (".py", ".hpp", ".cpp", ".js", ".css")  # which a page names without their folder
FENCE = re.compile(r"^( *)(```+)(?P<head>[^\n]*)\n(?P<body>.*?)^\1\2 *$", re.DOTALL | re.MULTILINE)
INDENTED = re.compile(r"(?:^ {4}[^\n]*\n)+", re.MULTILINE)
INLINE = re.compile(r"(?<!`)(`+)(?!`)(?P<text>.+?)(?<!`)\1(?!`)", re.DOTALL)
LINK = re.compile(r"\]\((?P<target>[^)\s#]+)[^)]*\)")
WRITTEN = re.compile(r"^:caption: (\S+)$|%%writefile (\S+)|`([\w.]+)`:\n\n```", re.MULTILINE)
OUTPUT = re.compile(r"(?:--out|-o|folder=|save\()[ =\"']*([\w-]+)")
PATH = re.compile(r"[\w.-]+(?:/[\w.-]+)*/?")
COMMAND = re.compile(
    r"(?:^|[\s(\"'])(?:(?:tpbso|-m tpbso_casadi) (?P<command>[a-z]+)|-m (?P<module>[\w.]+))(?P<rest>[^\n|;&]*)"
)
OPTION = re.compile(r"(?:^|[\s\[(/])(--[a-z][\w-]*)")


@dataclass(frozen=True)
class Named:
    """What a page names.

    Attributes:
        inline: what stands in backticks, each in one line.
        blocks: of code; of consoles the commands alone.
        links: where they lead, without those that leave the repository.
    """

    inline: tuple[str, ...]
    blocks: tuple[str, ...]
    links: tuple[str, ...]

    @classmethod
    def on(cls, text: str) -> Named:
        fenced = [match["body"] for match in FENCE.finditer(text)]
        prose = FENCE.sub("", text)
        indented = INDENTED.findall(prose)
        blocks = [re.sub(r"\\\n\s*", " ", block) for block in (*fenced, *indented)]
        prose = INDENTED.sub("\n", prose)
        links = [match["target"] for match in LINK.finditer(INLINE.sub("", prose))]
        return cls(
            tuple(" ".join(match["text"].split()) for match in INLINE.finditer(prose)),
            tuple(blocks),
            tuple(link for link in links if not re.match(r"\w+:", link)),
        )

    @property
    def files(self) -> Iterator[str]:
        """What looks like a path of the repository, or a source file by its name."""
        for text in self.inline:
            name = re.sub(r":[\w:]+$", "", text)  # a class, or a line
            of_repository = "/" in name and name.split("/")[0] in FOLDERS
            alone = name.endswith(SOURCES) or (name.endswith("/") and name.count("/") == 1)
            if PATH.fullmatch(name) and (of_repository or alone):
                yield name

    @property
    def commands(self) -> Iterator[tuple[str, str, str]]:
        """Commands of ``tpbso``, modules of ``-m``, of each one or the other, and what follows them."""
        for text in (*self.inline, *self.blocks):
            for match in COMMAND.finditer(text):
                yield match["command"] or "", match["module"] or "", match["rest"].split("`")[0]


@cache
def known_names() -> frozenset[str]:
    """The names of all files and folders of the source tree, without their folders."""
    folders = [ROOT / folder for folder in FOLDERS]
    return frozenset(path.name for folder in folders for path in (folder, *folder.rglob("*")))


def unknown_files(page: Path) -> list[str]:
    text = page.read_text()
    named, written = Named.on(text), {name for names in WRITTEN.findall(text) for name in names if name}
    written |= set(OUTPUT.findall(" ".join((*named.blocks, *named.inline))))

    def is_there(name: str) -> bool:
        short = name.removesuffix("/")
        return (ROOT / short).exists() or short in written or ("/" not in short and short in known_names())

    missing = [name for name in named.files if not is_there(name)]
    return missing + [link for link in named.links if not (page.parent / link).exists() and link not in written]


def source_of(module: str) -> Path | None:
    """The file that ``python -m`` runs; None where there is none."""
    path = ROOT / Path(*module.split("."))
    return next((file for file in (path.with_suffix(".py"), path / "__main__.py") if file.exists()), None)


@cache
def strings_in(file: Path) -> frozenset[str]:
    """The string constants, options among them, of a source file and of those of its package that it imports."""
    tree = ast.parse(file.read_text())
    found = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    top = file.relative_to(ROOT).parts[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == top:
            inner = source_of(f"{node.module}") or ROOT / Path(*str(node.module).split(".")) / "__init__.py"
            below = [source_of(f"{node.module}.{name.name}") for name in node.names]
            for other in (inner, *below):
                if other is not None and other.exists() and other != file:
                    found |= strings_in(other)
    return frozenset(found)


def options_below(parser: argparse.ArgumentParser) -> set[str]:
    """The options of a command and of those below it."""
    found = set(parser._option_string_actions)
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            found |= {option for below in action.choices.values() for option in options_below(below)}
    return found


def known_options(command: str, module: str) -> frozenset[str] | set[str] | None:
    """The options of a command; None where there is no such command."""
    command = "solve" if module == "tpbso_casadi.solve" else command
    if command:
        return options_below(parser_of(command)) if command in COMMANDS else None
    if module in {"tpbso_casadi", "tpbso_casadi.cli.tpbso"}:
        return frozenset(option for each in COMMANDS for option in options_below(parser_of(each)))
    source = source_of(module)
    return None if source is None else strings_in(source)


def unknown_commands(page: Path) -> list[str]:
    found, named = [], Named.on(page.read_text())
    on_page = set(known_options("", "tpbso_casadi") or ())
    for command, module, rest in named.commands:
        if module and (module.split(".")[0] not in FOLDERS or module.split(".")[-1].isupper()):
            continue  # of Python, pip or another program; or any of ours
        known = known_options(command, module)
        if known is None:
            found.append(command or module)
        else:
            found += [f"{command or module} {option}" for option in OPTION.findall(rest) if not knows(known, option)]
            on_page |= known
    alone = [option for text in named.inline if text.startswith("--") for option in OPTION.findall(text)]
    return found + [option for option in alone if not knows(on_page, option)]


def knows(options: Collection[str], option: str) -> bool:
    """Whether an option is one of these, or turns one of them off (``argparse.BooleanOptionalAction``)."""
    return option in options or option.replace("--no-", "--", 1) in options


WRONG = """
`solvers/bso.py`, `bso.py` and `solvers/none.py`, `none.py`, `solvers/`, `nowhere/`; [there](page.md) and [not](off.md),
`tpbso solve time-2 --seed
3 --sed 4`, `tpbso slove`, `python -m benchmarks.polish --none`, `python -m benchmarks.none`, `--quick`, `--quik`;
`mine.py`:

```python
```

    OPTION=1 python -m tpbso_casadi compare time-2 --runs 2 \\
        --run 3

```console
$ tpbso retime path.csv --no-plots --out made
```

`made/`; `pip install --upgrade`, `python -m pip --help`
"""


def test_what_is_wrong_is_found(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(WRONG)
    assert unknown_files(page) == ["solvers/none.py", "none.py", "nowhere/", "off.md"]
    commands = ["solve --sed", "slove", "benchmarks.polish --none", "benchmarks.none", "compare --run"]
    assert unknown_commands(page) == [*commands, "--quik"]


@pytest.mark.parametrize("page", NAMES)
def test_every_file_that_a_page_names_is_there(page: str) -> None:
    assert unknown_files(ROOT / page) == []


@pytest.mark.parametrize("page", NAMES)
def test_every_command_that_a_page_names_is_one_and_knows_its_options(page: str) -> None:
    assert unknown_commands(ROOT / page) == []
