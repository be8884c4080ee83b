"""``tpbso audit``: the structure of a scenario's constraints, the certificate of a run."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from problems.evaluation import InvalidEvaluation
from tpbso_casadi.audit_report import audit_scenario
from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, print_error, run_command
from tpbso_casadi.cli.options import (
    add_certificate,
    add_figures_option,
    add_json,
    add_outside_files,
    add_quiet,
    defaulting,
    output_group,
    path,
    problem_group,
)
from tpbso_casadi.display.console import OutputConsole
from tpbso_casadi.facade.audit import Audit, ScenarioAudit
from tpbso_casadi.facade.planning import read_run
from tpbso_casadi.figures.palette import DEFAULT
from tpbso_casadi.plain import as_json
from tpbso_casadi.scenario import TITLES, Scenario, ScenarioError, is_folder, load, named, plugin_failures_named
from tpbso_casadi.storage import OutputError, check_writable, write_certificate


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(parser(), audit, arguments)


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "audit",
        "Audit a run folder (exit status 0: certified; 1: violated or undecided; 2: unreadable or contradictory) "
        "or a scenario (1: a constraint can never be met).",
        examples=["runs/first", "runs/first --json", "obstacle-3 --plots structure"],
    )
    command_line.add_argument(
        "what", metavar="RUN_FOLDER|SCENARIO", help="a run folder, a TOML file or a built-in name"
    )
    add_outside_files(problem_group(command_line))
    output = output_group(command_line)
    add_json(output)
    add_certificate(output)
    output.add_argument(
        "--plots",
        type=path,
        metavar="DIR",
        help=defaulting("draw the structure of a scenario's Jacobian", "none"),
    )
    add_figures_option(output)
    command_line.set_defaults(figures=None)  # stated without --plots it would do nothing
    add_quiet(output)
    return command_line


def audit(options: argparse.Namespace) -> int:
    """Audit what the options name; returns the exit status."""
    if options.figures is not None and options.plots is None:
        raise ScenarioError("--figures: an audit draws nothing by itself; say --plots DIR too")
    if options.what not in TITLES and is_folder(options.what):
        return of_run(Path(options.what), options)
    return of_scenario(load(options.what, options.allow_outside_files), options)


def of_run(folder: Path, options: argparse.Namespace) -> int:
    """Read, recompute and audit a run; returns the exit status."""
    if options.plots is not None:
        raise ScenarioError(f"--plots: {folder} is a run, whose figures are made with it; say a scenario")
    plan = read_run(folder)
    audited = plan.audit()
    if options.certificate is not None:
        write_certificate(options.certificate, plan.motion)
    print_audit(audited, options)
    return Exit.FEASIBLE if audited.certified else Exit.INFEASIBLE


def of_scenario(scenario: Scenario, options: argparse.Namespace) -> int:
    """Audit a scenario's structure; returns the exit status."""
    if options.certificate is not None:
        raise ScenarioError(f"--certificate: {options.what} is a scenario; say the folder of a run")
    if options.plots is not None:
        check_writable(options.plots)
    with named(options.what), plugin_failures_named(scenario, OutputError, InvalidEvaluation):
        audited = ScenarioAudit(audit_scenario(scenario))
        if options.plots is not None:
            from tpbso_casadi.figures.limits import draw_structure  # noqa: PLC0415 (matplotlib is slow to load)

            options.plots.mkdir(parents=True, exist_ok=True)
            draw_structure(options.plots, scenario, options.figures or DEFAULT)
    print_audit(audited, options)
    if audited.impossible:
        print_error(f"{options.what}: nothing in the search box meets {', '.join(audited.impossible)}")
        return Exit.INFEASIBLE
    return Exit.FEASIBLE


def print_audit(audited: Audit, options: argparse.Namespace) -> None:
    """Print an audit as JSON or as tables."""
    if options.json:
        sys.stdout.write(as_json(audited.content))
    else:
        audited.print_on(OutputConsole(quiet=options.quiet))
