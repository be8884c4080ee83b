"""What all commands have in common: help, defaults, versions, short options, examples, completion in a shell."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.commands import module_of, options_of, parser_of, parsers
from helpers.scenes import CART, SHORT_ARM, TURN, toml

from problems.library import core_account
from problems.robots import BUILT_IN
from tpbso_casadi import __version__
from tpbso_casadi.cli.command import WIDEST, OneLineParser
from tpbso_casadi.cli.commands import completion
from tpbso_casadi.cli.commands.completion import SHELLS
from tpbso_casadi.cli.tpbso import COMMANDS
from tpbso_casadi.scenario import SOLVER_CATALOGUE
from tpbso_casadi.scenario.cases import TITLES

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


def test_every_module_of_the_folder_is_a_command() -> None:
    folder = Path(str(module_of("solve").__file__)).parent
    assert {path.stem for path in folder.glob("[!_]*.py")} == set(COMMANDS)


def printed_by(command: str, option: str, capsys: pytest.CaptureFixture[str]) -> str:
    """What a command answers at once, which is no error."""
    with pytest.raises(SystemExit, match=r"^0$"):
        module_of(command).main([option])
    printed = capsys.readouterr()
    assert printed.err == ""
    return printed.out


@each_command
def test_help_version_and_an_unknown_option(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = printed_by(command, "-h", capsys)
    assert text == printed_by(command, "--help", capsys) == parser_of(command).format_help()
    assert text.startswith(f"usage: tpbso {command} ")
    version = f"tpbso-casadi {__version__}\ncore: {core_account()}\n"
    assert printed_by(command, "-V", capsys) == printed_by(command, "--version", capsys) == version
    with pytest.raises(SystemExit, match=r"^2$"):
        module_of(command).main([*parser_of(command).examples[0].split(), "--unknown"])
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", "error: unrecognized arguments: --unknown\n")


def text_of(default: object) -> object:
    """As it is typed: several values with commas between them."""
    return ",".join(default) if isinstance(default, tuple) else default


def test_every_value_has_a_default_that_the_help_shows() -> None:
    for parser in parsers():
        check_defaults(parser)


def check_defaults(parser: OneLineParser) -> None:
    valued = [action for action in options_of(parser) if action.nargs != 0 and not action.required]
    formatter = parser._get_formatter()
    helps = {action.dest: formatter._expand_help(action) for action in valued}
    assert {option: shown for option, shown in helps.items() if not re.search(r"\[default: [^\]]+\]$", shown)} == {}
    stated = {action.dest: text_of(action.default) for action in valued if action.default not in (None, [], ())}
    assert {option: value for option, value in stated.items() if f"[default: {value}]" not in helps[option]} == {}


def test_a_help_is_not_wider_than_the_terminal_or_100_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    for columns in (80, 100, 300):
        monkeypatch.setenv("COLUMNS", str(columns))
        for parser in parsers():
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


URDF = """<robot name="arm"><link name="base"/><link name="tool0"/>
<joint name="j" type="revolute"><parent link="base"/><child link="tool0"/><axis xyz="0 0 1"/><origin xyz="0 0 0.5"/>
<limit lower="-1" upper="1" velocity="1" effort="10"/></joint></robot>"""


@pytest.mark.slow
def test_examples_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(toml(arm=SHORT_ARM))
    Path("scene.toml").write_text(toml(arm=SHORT_ARM, task=TURN, obstacles=[CART]))
    Path("waypoints.csv").write_text("q1,q2\n0,0\n0.5,0.4\n1,-0.2\n")
    Path("arm.urdf").write_text(URDF)
    for command in ("solve", "audit", "retime", "robots", "simulate", "completion"):
        for example in parser_of(command).examples:
            assert module_of(command).main(example.split()) == 0, example


def test_short_options() -> None:
    for parser in parsers():
        named = {option: action for action in options_of(parser) for option in action.option_strings}
        assert {option for option in named if not option.startswith("--")} <= set(SHORT)
        for brief, long in SHORT.items():
            assert (brief in named) == (long in named)
            assert named.get(brief) is named.get(long)


def test_the_same_option_has_the_same_short_form_metavar_and_help_everywhere() -> None:
    """Where one file is written, not a folder, it says so."""
    meanings: dict[tuple[str, bool], set[tuple[str, ...]]] = {}
    for parser in parsers():
        for action in options_of(parser):
            text = str(action.help).partition(" [default:")[0]
            meaning = (*action.option_strings, str(action.metavar), text)
            meanings.setdefault((action.option_strings[-1], action.metavar == "FILE"), set()).add(meaning)
    assert {option: several for option, several in meanings.items() if len(several) > 1} == {}
    assert {"--out", "--seed", "--evaluations", "--within"} <= {option for option, _ in meanings}


def test_groups_are_the_same_and_in_the_same_order() -> None:
    order = ["positional arguments", "options", "problem", "search", "machine", "output"]
    for parser in parsers():
        titles = [str(group.title) for group in parser._action_groups if group._group_actions]
        assert titles == [title for title in order if title in titles]


def test_the_usage_says_how_the_command_was_called(monkeypatch: pytest.MonkeyPatch) -> None:
    for program in ("tpbso solve", "python -m tpbso_casadi solve", "python -m tpbso_casadi.solve"):
        monkeypatch.setattr(sys, "argv", [program])
        assert parser_of("solve").format_help().startswith(f"usage: {program} [-h]")
    for program in ("/usr/bin/pytest", "my solve.py"):  # another program that runs it
        monkeypatch.setattr(sys, "argv", [program])
        assert parser_of("solve").prog == "tpbso solve"


@pytest.mark.process
@pytest.mark.parametrize("program", ["tpbso_casadi.solve", "tpbso_casadi solve", "tpbso_casadi compare"])
def test_a_module_that_is_run_knows_its_name(program: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", *program.split(), "--help"], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith(f"usage: python -m {program} ")
    assert f"\n  python -m {program} {parser_of(program[13:]).examples[0]}\n" in done.stdout


COMPLETING = """
. ./completion.bash
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
$(complete -p tpbso | sed 's/.*-F \\([^ ]*\\) .*/\\1/')
printf '%s\\n' "${COMPREPLY[@]}"
"""  # what bash does when the user presses Tab after the words


@pytest.fixture
def completing(in_an_empty_folder: None, capsys: pytest.CaptureFixture[str]) -> None:
    """A working folder with a scenario, a folder of runs and the script for bash."""
    assert completion.main(["bash"]) == 0
    Path("completion.bash").write_text(capsys.readouterr().out)
    Path("mine.toml").touch()
    Path("runs").mkdir()


def completed(*words: str) -> set[str]:
    done = subprocess.run(["bash", "-c", COMPLETING, "-", *words], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return set(done.stdout.split())


@pytest.mark.process
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_completes_commands_options_scenarios_solvers_and_files(completing: None) -> None:
    assert completed("tpbso", "") == set(COMMANDS)
    assert completed("tpbso", "re") == {"reach", "retime", "reproduce"}
    assert completed("tpbso", "solve", "time-") == {name for name in TITLES if name.startswith("time-")}
    assert completed("tpbso", "solve", "") >= {*TITLES, "mine.toml"}
    assert completed("tpbso", "solve", "mi") == {"mine.toml"}
    assert completed("tpbso", "compare", "time-3", "obst") == {name for name in TITLES if name.startswith("obst")}
    assert completed("tpbso", "solve", "--solver", "") == set(SOLVER_CATALOGUE.registry)
    assert completed("tpbso", "solve", "time-3", "--solver", "ab") == {"abso"}
    assert completed("tpbso", "solve", "--backend", "n") == {"native"}
    assert completed("tpbso", "solve", "--export", "ros") == {"ros-json", "ros-yaml"}
    assert completed("tpbso", "solve", "-o", "") == {"runs"}
    assert completed("tpbso", "retime", "path.csv", "--robot", "m") == {"mine.toml"}
    assert completed("tpbso", "audit", "ru") == {"runs"}
    assert completed("tpbso", "robots", "show", "p") == {name for name in BUILT_IN if name.startswith("p")}
    for command in COMMANDS:
        options = {option for action in options_of(parser_of(command)) for option in action.option_strings}
        assert completed("tpbso", command, "--") == {option for option in options if option.startswith("--")}


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_has_a_script_with_every_command_scenario_and_solver(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert completion.main([shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in (*COMMANDS, *TITLES, *SOLVER_CATALOGUE.registry))
