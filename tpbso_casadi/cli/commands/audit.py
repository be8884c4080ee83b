"""``python -m tpbso_casadi.audit``: the structure of a scenario's constraints, the certificate of a run."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from problems import CertificateStatus
from problems.evaluation import InvalidEvaluation
from tpbso_casadi.audit.content import audit_run, audit_scenario, impossible
from tpbso_casadi.cli.common import Exit, OneLineParser, add_input_options, path, print_error
from tpbso_casadi.cli.display.audit_tables import print_run_audit, print_scenario_audit
from tpbso_casadi.cli.display.console import OutputConsole
from tpbso_casadi.cli.figure_formats import add_figures_option
from tpbso_casadi.scenario.cases.builtin import TITLES
from tpbso_casadi.scenario.input_files import is_folder
from tpbso_casadi.scenario.loading import load
from tpbso_casadi.scenario.scenario import Scenario, plugin_failures_named
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import OutputError, check_writable
from tpbso_casadi.storage.plain import as_json
from tpbso_casadi.storage.stored_run import InvalidRun, read_run


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = parser().parse_args(arguments)
    try:
        if options.what not in TITLES and is_folder(options.what):
            return of_run(Path(options.what), options)
        return of_scenario(load(options.what, options.allow_outside_files), options)
    except (ScenarioError, OutputError, InvalidRun, InvalidEvaluation) as error:
        print_error(str(error))
        return Exit.BAD_INPUT


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    command_line = OneLineParser(
        "python -m tpbso_casadi.audit",
        description="Audit a run folder (exit 0 certified, 1 violated or undecided, 2 unreadable or contradictory) "
        "or a scenario (exit 1 when a constraint can never be met).",
    )
    command_line.add_argument(
        "what", metavar="RUN_FOLDER|SCENARIO", help="a run folder, a TOML file or a built-in name"
    )
    add_input_options(command_line)
    command_line.add_argument("--json", action="store_true", help="print the audit as JSON")
    command_line.add_argument(
        "--plots", type=path, metavar="DIR", help="draw the Jacobian's structure of a scenario there"
    )
    add_figures_option(command_line)
    return command_line


def of_run(folder: Path, options: argparse.Namespace) -> int:
    """Read, recompute and audit a run; returns the exit status."""
    run = read_run(folder)
    with plugin_failures_named(run.scenario):
        audit = audit_run(run)
    if options.json:
        sys.stdout.write(as_json(audit))
    else:
        print_run_audit(audit, OutputConsole())
    return Exit.FEASIBLE if audit["certificate"]["verdict"] == CertificateStatus.CERTIFIED else Exit.INFEASIBLE


def of_scenario(scenario: Scenario, options: argparse.Namespace) -> int:
    """Audit a scenario's structure; returns the exit status."""
    if options.plots is not None:
        check_writable(options.plots)
    try:
        with plugin_failures_named(scenario, OutputError, InvalidEvaluation):
            audit = audit_scenario(scenario)
            if options.plots is not None:
                draw(scenario, options.plots, options.figures)
    except ScenarioError as error:
        raise ScenarioError(f"{options.what}: {error}") from error
    if options.json:
        sys.stdout.write(as_json(audit))
    else:
        print_scenario_audit(audit, OutputConsole())
    if impossible(audit):
        print_error(f"{options.what}: nothing in the search box meets {', '.join(impossible(audit))}")
        return Exit.INFEASIBLE
    return Exit.FEASIBLE


def draw(scenario: Scenario, folder: Path, formats: Sequence[str]) -> None:
    """Draw the structure of the scenario's constraints."""
    from tpbso_casadi.figures.structure import draw_structure  # noqa: PLC0415 (matplotlib is slow to load)

    folder.mkdir(parents=True, exist_ok=True)
    draw_structure(folder, scenario, formats)
