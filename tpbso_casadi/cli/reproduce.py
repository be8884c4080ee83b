"""``python -m tpbso_casadi.reproduce``: the paper's Section IV, reproduced with one command."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from tpbso_casadi.campaign import Store
from tpbso_casadi.campaign.export import export
from tpbso_casadi.campaign.statistics import summarise
from tpbso_casadi.campaign.table import HEADER, rows
from tpbso_casadi.cli.campaign import (
    add_campaign_options,
    exit_code_of,
    failures,
    local,
    prepare,
    run_with_progress,
    stored,
)
from tpbso_casadi.cli.common import OneLineParser
from tpbso_casadi.reproduction.claims import CLAIMS
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import FULL, QUICK, Size, campaign
from tpbso_casadi.reproduction.gather import gather, illustrations
from tpbso_casadi.reproduction.report import render
from tpbso_casadi.reproduction.scaling import measure_scaling
from tpbso_casadi.storage.files import write_csv, write_text, writing


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = parser().parse_args(arguments)
    return exit_code_of(lambda: reproduce(options))


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    command_line = OneLineParser("python -m tpbso_casadi.reproduce", description="Reproduce Section IV of the paper.")
    command_line.add_argument("--quick", action="store_true", help="few and short runs, in under a minute")
    add_campaign_options(command_line, Path("runs/reproduction"))
    return command_line


def reproduce(options: argparse.Namespace) -> int:
    """Run the reproduction of the options; returns the exit status."""
    size = QUICK if options.quick else FULL
    if options.quick and options.backend is None:
        options.backend = "vm"  # so few evaluations are not worth a compiler
    runs = campaign(size)
    prepare(options, "summary.csv", "report.html")
    with stored(options) as store:
        run_with_progress(runs, store, options)
        evidence = gather(runs, store, stored_scaling(store, size, options.quiet))
        with local(options).start() as executor:
            drawn = illustrations(runs, store, executor)
    page = render(evidence, drawn, size, command_of(options), sum(record.seconds for record in evidence.records))
    with writing(options.out):
        write_csv(options.out / "summary.csv", HEADER, rows(summarise(evidence.records)))
        write_text(options.out / "report.html", lambda file: file.write(page))
    if options.export is not None:
        export(evidence.records, options.export)
    if not options.quiet:
        print_claims(evidence, Console())
        Console().print(f"written to {options.out / 'report.html'}", highlight=False, soft_wrap=True)
    return failures(evidence.records)


def stored_scaling(store: Store, size: Size, quiet: bool) -> dict[str, object]:
    """Growth of time and memory: measured once, then from the store."""
    name = f"scaling {asdict(size)}"
    scaling: dict[str, object] | None = store.measurement(name)
    if scaling is None:
        console = Console(stderr=True, quiet=quiet or not sys.stderr.isatty())
        with console.status("measuring growth") as status:
            scaling = measure_scaling(
                size is QUICK, lambda quantity: status.update(f"measuring the growth of {quantity}")
            )
        store.keep(name, scaling)
    return scaling


def command_of(options: argparse.Namespace) -> str:
    """The command that makes the same page again, on any executor."""
    return shlex.join(
        ["python", "-m", "tpbso_casadi.reproduce", *["--quick"] * options.quick, "--out", str(options.out)]
    )


def print_claims(evidence: Evidence, console: Console) -> None:
    """Print the outcome of each claim."""
    for claim in CLAIMS:
        console.print(f"[bold]{claim.statement}[/]")
        for basis, finding in claim.findings(evidence).items():
            colour = {"reproduced": "green", "not reproduced": "red"}.get(finding.outcome, "yellow")
            prefix = f"{basis}: " if basis else ""
            console.print(f"  {prefix}[{colour}]{finding.outcome}[/]. {finding.evidence}", highlight=False)
