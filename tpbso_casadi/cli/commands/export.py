"""``tpbso export``: the plan of a run as a program for a controller."""

from __future__ import annotations

import argparse
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, run_command
from tpbso_casadi.cli.options import add_json, add_out, add_quiet, defaulting, listed, output_group, path
from tpbso_casadi.display.console import OutputConsole
from tpbso_casadi.plain import as_json
from tpbso_casadi.programs import EXPORTERS, Program, exporter_of
from tpbso_casadi.storage import OutputError, read_run


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(parser(), export, arguments, interrupted="interrupted; the program may be incomplete")


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "export",
        "Write the plan of a run as a program for a controller, and say what is proven of the motion that the "
        "controller makes of it. Exit status 0: all that is said is proven; 1: not, or the plan is not; 2: bad input.",
        examples=[
            "runs/first --as urscript",
            "runs/first --as krl --set accuracy=0.002 --set longest=0.05",
            "runs/pick --as fanuc --set 'outputs={gripper=1}' --out cell-3",
        ],
    )
    command_line.add_argument("run", type=path, metavar="RUN_FOLDER", help="that solve or retime wrote")
    command_line.add_argument(
        "--as",
        dest="kind",
        required=True,
        metavar="KIND",
        help=f"{listed(EXPORTERS.registry)}, a plug-in, or package.module:Class",
    )
    command_line.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help=defaulting("a setting of the kind, the value as in TOML; repeatable", "none"),
    )
    output = output_group(command_line)
    add_out(output, "RUN_FOLDER-KIND")
    add_json(output)
    add_quiet(output)
    return command_line


def export(options: argparse.Namespace) -> int:
    """Write the program, say what is proven; returns the exit status."""
    exporter = exporter_of(options.kind, settings_of(options.set))
    program = exporter.program(read_run(options.run))
    name = f"{options.run.resolve().name}-{options.kind.rpartition(':')[2]}"
    written = program.write(options.out or options.run.resolve().parent / name)
    if options.json:
        sys.stdout.write(as_json(content_of(program, written)))
    elif not options.quiet:
        console = OutputConsole()
        for line in program.lines:
            console.say(line)
        console.say(f"written to {', '.join(map(str, written))}")
    return Exit.FEASIBLE if program.proven else Exit.INFEASIBLE


def settings_of(statements: Sequence[str]) -> dict[str, Any]:
    """The settings that ``KEY=VALUE`` states, each a line of TOML.

    Raises:
        OutputError: one is none.
    """
    settings: dict[str, Any] = {}
    for statement in statements:
        try:
            settings |= tomllib.loads(statement)
        except tomllib.TOMLDecodeError as error:
            raise OutputError(f"--set {statement}: KEY=VALUE as in TOML is needed: {error}") from error
    return settings


def content_of(program: Program, written: Sequence[Path]) -> dict[str, Any]:
    """The program as plain data, without its text."""
    return {
        "content": program.content,
        "proven": program.proven,
        "plan": str(program.planned),
        "proofs": [proof._asdict() for proof in program.proofs],
        "assumptions": program.assumptions,
        "unstated": program.unstated,
        "files": list(map(str, written)),
    }
