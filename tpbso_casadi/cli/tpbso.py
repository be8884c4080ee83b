"""``tpbso``: all commands under one name.

Loads nothing but the standard library, so that the overview and a mistyped name are answered at once.
"""

from __future__ import annotations

import sys
from itertools import takewhile
from typing import NoReturn

from tpbso_casadi import __version__
from tpbso_casadi.cli.entry import answer, refuse, run

COMMANDS = {
    "solve": "plan one motion, prove it for all t, write its run folder",
    "audit": "the certificate of a run, or the structure of a scenario",
    "certify": "a trajectory of any program, proven for all t or what it breaks",
    "export": "a plan as a program for a robot's controller",
    "compare": "many runs of solvers on scenarios, and their statistics",
    "retime": "the least time along a given path in joint space",
    "pareto": "a front of certified plans between two objectives",
    "reproduce": "the paper's Section IV, reproduced",
    "robots": "the robots that are built in, or one from a URDF",
    "reach": "a map of what an arm reaches, clear of what is around it",
    "layout": "where the robot and the fixtures of a cell stand so that its cycle is short",
    "tracking": "how far joints are off what is planned, from logs of a robot",
    "simulate": "plan again and again among moving obstacles, in a simulation",
    "suite": "solvers judged on robot motions, a benchmark suite",
    "completion": "completion of the command line for bash, zsh or tcsh",
}
OVERVIEW = """\
tpbso-casadi {version}: robot-arm motions by metaheuristics and gradients on one CasADi model

usage: {name} COMMAND [OPTION ...]

commands:
{commands}

options:
  -h, --help     this overview; {name} COMMAND --help says every option of a command
  -V, --version  print the version and which core answers

example:
  {name} solve time-3 --out runs/first     plan the first built-in scenario
  {name} solve --list                      list the built-in scenarios"""


def main(name: str = "tpbso") -> NoReturn:
    """Run the command that the first argument names, with the arguments after it.

    Args:
        name: under which all commands are called.
    """
    before = list(takewhile(lambda argument: argument in FOR_ANY or argument.strip("v") == "-", sys.argv[1:]))
    command, *arguments = sys.argv[1 + len(before) :] or ["--help"]
    arguments = [*arguments, *before]  # as if they stood behind the command
    if command in COMMANDS:
        sys.argv[1:] = arguments
        sys.path.append("")  # plug-ins in the working folder, as with python -m; what is installed comes first
        run(f"tpbso_casadi.cli.commands.{command}", f"{name} {command}")
    if command not in ANSWERS:
        refuse(f"there is no command {command!a:.60}{_meant(command)} ({name} --help lists all)")
    answer(lambda: ANSWERS[command](name))


FOR_ANY = ("--verbose", "-q", "--quiet")  # options of every command, which may stand before its name


def _overview(name: str) -> str:
    return OVERVIEW.format(version=__version__, name=name, commands=_listed(name))


def _version(_: str) -> str:
    from tpbso_casadi.plain import version_text  # noqa: PLC0415 (loads the core, or has it compiled)

    return version_text()


ANSWERS = {
    **dict.fromkeys(("-h", "--help", "help"), _overview),
    **dict.fromkeys(("-V", "--version"), _version),
}


def _listed(name: str) -> str:
    return "\n".join(f"  {name} {command:<10}  {purpose}" for command, purpose in COMMANDS.items())


def _meant(command: str) -> str:
    from difflib import get_close_matches  # noqa: PLC0415 (for a mistake alone)

    nearest = get_close_matches(command, COMMANDS, n=1)
    return f"; the nearest is {nearest[0]}" if nearest else ""


if __name__ == "__main__":
    main()
