"""One line of error, whatever it holds and wherever it goes; numbers, names and paths on a command line."""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tpbso_casadi.cli.command import LONGEST_PART, print_error
from tpbso_casadi.cli.options import natural, path, positive_float, positive_int, printable_name, whole_number
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


def test_what_an_encoding_lacks_is_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    buffer = io.BytesIO()
    monkeypatch.setattr(sys, "stderr", io.TextIOWrapper(buffer, "ascii"))
    print_error("ä 字")
    assert buffer.getvalue() == b"error: \\xe4 \\u5b57\n"


@pytest.mark.parametrize("redirection", ["2>/dev/full", "2>&-"])
def test_a_full_or_closed_standard_error_changes_no_status(redirection: str) -> None:
    code = "from tpbso_casadi.cli.command import print_error; print_error('lost'); raise SystemExit(2)"
    done = subprocess.run(["sh", "-c", f'"$0" -c "$1" {redirection}', sys.executable, code], check=False)
    assert done.returncode == 2


def test_no_standard_error_at_all(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    print_error("lost")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("kind", "text", "reason"),
    [
        (positive_int, "1.5", "a whole number is needed, not '1.5'"),
        (positive_int, "9" * 5000, "a whole number is needed, not '999"),
        (positive_int, "0", "0 is not positive"),
        (positive_int, str(10**30), f"{10**30} is more than 1000000000"),
        (whole_number(1, 100), "101", "101 is more than 100"),
        (whole_number(2, 100), "1", "1 is less than 2"),
        (natural, "-1", "-1 is negative"),
        (natural, str(2**63), f"{2**63} is more than {2**63 - 1}"),
        (positive_float, "fast", "a number is needed, not 'fast'"),
        *(
            (positive_float, text, f"{text} is not a positive number")
            for text in ("nan", "inf", "1e308", "5e-324", "-1")
        ),
        (printable_name, "a\0b", "printable"),
        (printable_name, "\udcff", "printable"),
        (printable_name, "a" * 201, "at most 200"),
        (path, "", "a path is needed, not ''"),
        (path, "a\0b", "a path is needed"),
    ],
)
def test_what_is_typed_wrong(kind: Callable[[str], object], text: str, reason: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError) as caught:
        kind(text)
    assert str(caught.value).startswith(reason) or reason in str(caught.value)
    assert len(str(caught.value)) < LONGEST_LINE


def test_what_is_typed_right() -> None:
    assert natural(str(2**63 - 1)) == 2**63 - 1
    assert positive_float("1e-12") == 1e-12
    assert path("[red]") == Path("[red]")
    assert printable_name("ä.b:C") == "ä.b:C"
