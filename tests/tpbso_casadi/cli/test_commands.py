"""What all commands have in common: help, defaults, versions, short options, examples, one line of error."""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.commands import module_of, options_of, parser_of, parsers

from tpbso_casadi import __version__
from tpbso_casadi.cli.command import WIDEST, OneLineParser
from tpbso_casadi.cli.tpbso import COMMANDS

PARSERS = list(parsers())
SHORT = {
    "-h": "--help",
    "-V": "--version",
    "-v": "--verbose",
    "-o": "--out",
    "-s": "--seed",
    "-j": "--json",
    "-q": "--quiet",
}
each_command = pytest.mark.parametrize("command", COMMANDS)
each_parser = pytest.mark.parametrize("parser", PARSERS, ids=lambda parser: parser.prog)


def test_every_module_of_the_folder_is_a_command() -> None:
    folder = Path(str(module_of("solve").__file__)).parent
    assert {path.stem for path in folder.glob("[!_]*.py")} == set(COMMANDS)


@each_command
@pytest.mark.parametrize("option", ["-h", "--help"])
def test_help(command: str, option: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match=r"^0$"):
        module_of(command).main([option])
    printed = capsys.readouterr()
    assert printed.err == "" and printed.out == parser_of(command).format_help()
    assert printed.out.startswith(f"usage: tpbso {command} ")


@each_command
@pytest.mark.parametrize("option", ["-V", "--version"])
def test_version(command: str, option: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match=r"^0$"):
        module_of(command).main([option])
    assert capsys.readouterr().out == f"tpbso-casadi {__version__}\n"


@each_command
def test_an_unknown_option_is_one_line(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match=r"^2$"):
        module_of(command).main([*parser_of(command).examples[0].split(), "--unknown"])
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", "error: unrecognized arguments: --unknown\n")


def text_of(default: object) -> object:
    """As it is typed: several values with commas between them."""
    return ",".join(default) if isinstance(default, tuple) else default


@each_parser
def test_every_value_has_a_default_that_the_help_shows(parser: OneLineParser) -> None:
    valued = [action for action in options_of(parser) if action.nargs != 0 and not action.required]
    formatter = parser._get_formatter()
    helps = {action.dest: formatter._expand_help(action) for action in valued}
    assert {option: shown for option, shown in helps.items() if not re.search(r"\[default: [^\]]+\]$", shown)} == {}
    stated = {action.dest: text_of(action.default) for action in valued if action.default not in (None, [], ())}
    assert {option: value for option, value in stated.items() if f"[default: {value}]" not in helps[option]} == {}


@each_parser
@pytest.mark.parametrize("columns", [80, 100, 300])
def test_a_help_is_not_wider_than_the_terminal_or_100_columns(
    parser: OneLineParser, columns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    lines = [line for line in parser.format_help().splitlines() if not line.startswith("  tpbso ")]
    assert max(map(len, lines)) <= min(columns, WIDEST)
    assert all(len(f"  {parser.prog} {example}") <= WIDEST for example in parser.examples)


@each_command
def test_examples_end_the_help_and_mean_something(command: str) -> None:
    parser = parser_of(command)
    assert 2 <= len(parser.examples) <= 3
    ends = "\n".join(f"  tpbso {command} {example}" for example in parser.examples)
    assert parser.format_help().endswith(f"\n\nexamples:\n{ends}\n")
    for example in parser.examples:
        parser.parse_example(example)


ARM = "[arm]\nlink_lengths = [0.5, 0.4]\nmax_speed = 3.0\nmax_acceleration = 15.0\n"
SCENE = """
[task]
kind = "point-to-point"
start = { joints = [-0.6, 0.4] }
goal = { joints = [0.8, -0.3] }
[[obstacles]]
shape = "box"
center = [1.05, -0.6]
size = [0.1, 0.1]
velocity = [0.0, 0.2]
"""
URDF = """<robot name="arm"><link name="base"/><link name="tool0"/>
<joint name="j" type="revolute"><parent link="base"/><child link="tool0"/><axis xyz="0 0 1"/><origin xyz="0 0 0.5"/>
<limit lower="-1" upper="1" velocity="1" effort="10"/></joint></robot>"""


@pytest.mark.slow
def test_examples_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(ARM)
    Path("scene.toml").write_text(ARM + SCENE)
    Path("waypoints.csv").write_text("q1,q2\n0,0\n0.5,0.4\n1,-0.2\n")
    Path("arm.urdf").write_text(URDF)
    for command in ("solve", "audit", "retime", "robots", "simulate", "completion"):
        for example in parser_of(command).examples:
            assert module_of(command).main(example.split()) == 0, example


@each_parser
def test_short_options(parser: OneLineParser) -> None:
    named = {
        option: options_of(parser)[i]
        for i, action in enumerate(options_of(parser))
        for option in [*action.option_strings]
    }
    short = {option for option in named if not option.startswith("--")}
    assert short <= set(SHORT)
    for brief, long in SHORT.items():
        assert (brief in named) == (long in named)
        assert named.get(brief) is named.get(long)


def test_a_short_option_that_two_have_is_an_error_of_the_parser() -> None:
    parser = parser_of("solve")
    with pytest.raises(argparse.ArgumentError):
        parser.add_argument("-o", "--other")


def test_the_same_option_has_the_same_short_form_metavar_and_help_everywhere() -> None:
    meanings: dict[str, set[tuple[str, ...]]] = {}
    for parser in PARSERS:
        for action in options_of(parser):
            text = str(action.help).partition(" [default:")[0]
            meaning = (*action.option_strings, str(action.metavar), text)
            meanings.setdefault(action.option_strings[-1], set()).add(meaning)
    assert {option: several for option, several in meanings.items() if len(several) > 1} == {}
    assert {"--out", "--seed", "--evaluations", "--within"} <= set(meanings)


def test_groups_are_the_same_and_in_the_same_order() -> None:
    order = ["positional arguments", "options", "problem", "search", "machine", "output"]
    for parser in PARSERS:
        titles = [str(group.title) for group in parser._action_groups if group._group_actions]
        assert titles == [title for title in order if title in titles]


@pytest.mark.parametrize("program", ["tpbso audit", "python -m tpbso_casadi audit", "python -m tpbso_casadi.audit"])
def test_the_usage_says_how_the_command_was_called(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", [program])
    assert parser_of("audit").format_help().startswith(f"usage: {program} [-h]")


@pytest.mark.parametrize("program", ["/usr/bin/pytest", "my audit.py"])
def test_the_usage_of_a_command_that_another_program_runs(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", [program])
    assert parser_of("audit").prog == "tpbso audit"


def test_a_module_that_is_run_knows_its_name() -> None:
    command = [sys.executable, "-m", "tpbso_casadi.audit", "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("usage: python -m tpbso_casadi.audit ")
    assert "\n  python -m tpbso_casadi.audit runs/first --json\n" in done.stdout
