"""Text on one line: without control characters, and with an end."""

from __future__ import annotations

import pytest

from tpbso_casadi.cli.command import LONGEST_PART
from tpbso_casadi.plain import LONGEST_LINE, one_line


@pytest.mark.parametrize(
    ("message", "line"),
    [
        ("two\nlines\t and  spaces", "two lines and spaces"),
        ("\x1b[31mred\x07", "\\x1b[31mred\\x07"),
        ("bytes \udcff, \u202eback", "bytes \\udcff, \\u202eback"),
        ("[red]ä字[/]", "[red]ä字[/]"),
        ("a" * 60 + "b" * 5000 + "c" * 60 + ".toml: missing", "a" * 47 + "..." + "c" * 44 + ".toml: missing"),
    ],
)
def test_one_line(message: str, line: str) -> None:
    assert one_line(message, LONGEST_PART) == line


def test_a_line_has_an_end() -> None:
    line = one_line("word " * 100)
    assert len(line) == LONGEST_LINE and line.endswith("...")
