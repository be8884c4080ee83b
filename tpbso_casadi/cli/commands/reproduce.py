"""``tpbso reproduce``: the paper's Section IV, reproduced with one command."""

from __future__ import annotations

import argparse
import shlex
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from tpbso_casadi.cli.campaign import (
    add_campaign_options,
    failures,
    local,
    prepare,
    run_campaign_command,
    run_with_progress,
)
from tpbso_casadi.cli.command import OneLineParser, command_parser
from tpbso_casadi.cli.options import search_group
from tpbso_casadi.judging.results import results_of
from tpbso_casadi.judging.store import RunStore
from tpbso_casadi.judging.tables import HEADER, export, rows
from tpbso_casadi.reproduction.claims import CLAIMS
from tpbso_casadi.reproduction.experiment import FULL, QUICK, Evidence, Size, campaign
from tpbso_casadi.reproduction.judgements import ClaimOutcome
from tpbso_casadi.reproduction.page_figures import gather, illustrations
from tpbso_casadi.reproduction.report import render
from tpbso_casadi.reproduction.scaling import measured
from tpbso_casadi.storage import write_csv, write_text, writing

UNBREAKABLE = "\N{NO-BREAK SPACE}"
COLOURS = {
    ClaimOutcome.REPRODUCED: "green",
    ClaimOutcome.NOT_REPRODUCED: "red",
    ClaimOutcome.NOT_TESTABLE: "yellow",
    ClaimOutcome.NOT_JUDGED: "yellow",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_campaign_command(parser(), reproduce, arguments)


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "reproduce",
        "Reproduce Section IV of the paper: its runs, its tables and what became of each of its claims, on one page. "
        "The same command resumes an interrupted reproduction.",
        examples=["--quick", "--workers 4 --out runs/reproduction"],
    )
    search_group(command_line).add_argument(
        "--quick", action="store_true", help="one short run of each kind: about 80 s of processor time"
    )
    add_campaign_options(command_line, Path("runs/reproduction"))
    return command_line


def reproduce(options: argparse.Namespace) -> int:
    """Run the reproduction of the options; returns the exit status."""
    size = QUICK if options.quick else FULL
    if options.quick and options.backend is None:
        options.backend = "vm"  # so few evaluations are not worth a compiler
    runs = campaign(size)
    prepare(options, "summary.csv", "report.html")
    with RunStore.in_folder(options.out) as store:
        run_with_progress(runs, store, options)
        evidence = gather(runs, store, **measurements(store, size, options))
        with local(options).start() as executor:
            drawn = illustrations(runs, store, executor)
        summaries = results_of(runs, store).summaries
    page = render(evidence, drawn, size, command_of(options), sum(record.seconds for record in evidence.records))
    with writing(options.out):
        write_csv(options.out / "summary.csv", HEADER, rows(summaries))
        write_text(options.out / "report.html", lambda file: file.write(page))
    if options.table is not None:
        export(evidence.records, options.table)
    if not options.quiet:
        print_claims(evidence, Console())
        Console().print(f"written to {options.out / 'report.html'}", highlight=False, soft_wrap=True)
    return failures(evidence.records)


def measurements(store: RunStore, size: Size, options: argparse.Namespace) -> dict[str, Any]:
    """Growth of time and memory, and the time of searches; what is measured is said on a terminal."""
    console = Console(stderr=True, quiet=options.quiet or not sys.stderr.isatty())
    with console.status("measuring") as status:
        return measured(
            store, size, options.quick, options.backend, lambda quantity: status.update(f"measuring {quantity}")
        )


def command_of(options: argparse.Namespace) -> str:
    """The command that makes the same page again, on any executor."""
    return shlex.join(["tpbso", "reproduce", *["--quick"] * options.quick, "--out", str(options.out)])


def print_claims(evidence: Evidence, console: Console) -> None:
    """Print the outcome of each claim, in lines as wide as the console, broken between words alone."""
    for claim in CLAIMS:
        console.print(wrapped(claim.statement, console.width, style="bold"), crop=False)
        for basis, finding in claim.findings(evidence).items():
            text = f"{basis}: {finding.outcome}. " if basis else f"{finding.outcome}. "
            lines = wrapped(text + finding.evidence, console.width, indent="  ")
            start = lines.plain.index(finding.outcome)
            lines.stylize(COLOURS[finding.outcome], start, start + len(finding.outcome))
            console.print(lines, crop=False)


def wrapped(text: str, width: int, indent: str = "", style: str = "") -> Text:
    """Text in lines of at most ``width`` columns, where its words allow that; outcomes and percentages stay whole."""
    for words in (*ClaimOutcome, " %"):
        text = text.replace(words, words.replace(" ", UNBREAKABLE))
    lines = textwrap.wrap(
        text, width, initial_indent=indent, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return Text("\n".join(lines).replace(UNBREAKABLE, " "), style=style, no_wrap=True, overflow="ignore")
