"""``python -m tpbso_casadi.compare``: many scenarios, solvers and seeds, and what the runs say."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from tpbso_casadi.campaign import Run, SolverSpec, grid, parse_solvers
from tpbso_casadi.campaign.export import export
from tpbso_casadi.campaign.statistics import Summary, summarise
from tpbso_casadi.campaign.table import HEADER, rows, shown
from tpbso_casadi.cli.campaign import (
    add_campaign_options,
    exit_code_of,
    failures,
    prepare,
    run_with_progress,
    stored,
)
from tpbso_casadi.cli.common import OneLineParser, natural, positive_float, positive_int
from tpbso_casadi.scenario.loading import load
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import write_csv, writing

SOLVERS = "bso,pso,ga,bso+polish,ipopt"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = parser().parse_args(arguments)
    return exit_code_of(lambda: compare(options))


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    built = OneLineParser("python -m tpbso_casadi.compare", description="Compare solvers on scenarios.")
    built.add_argument("scenario", nargs="+", help="TOML files or built-in names")
    built.add_argument(
        "--solvers",
        default=SOLVERS,
        metavar="A,B,...",
        help=f"NAME, NAME(setting=value,...), either with +polish or +polishN; the first is what the others are "
        f"compared with; {SOLVERS} if none",
    )
    built.add_argument("--runs", type=positive_int, default=20, metavar="N", help="of each solver on each scenario; 20")
    built.add_argument("--seed", type=natural, default=1, help="of the first run; the next has the next; 1")
    budget = built.add_argument_group("the budget of each run, overriding the scenarios'")
    budget.add_argument("--population", type=positive_int, metavar="M", help="of every swarm")
    budget.add_argument("--iterations", type=positive_int, metavar="N", help="of ipopt, N starts")
    budget.add_argument("--evaluations", type=positive_int, metavar="N")
    budget.add_argument("--time-limit", type=positive_float, metavar="S", help="results then depend on the machine")
    add_campaign_options(built, Path("runs/compare"))
    built.add_argument("--json", action="store_true", help="print the table as JSON")
    built.add_argument("--no-plots", action="store_true", help="draw no figure")
    return built


def compare(options: argparse.Namespace) -> int:
    """Do what the options say; returns the exit status."""
    runs = campaign(options)
    prepare(options)
    with stored(options) as store:
        run_with_progress(runs, store, options)
        records = store.records(runs)
    summaries = summarise(records)
    write_summary(options.out, summaries, plots=not options.no_plots)
    if options.export is not None:
        export(records, options.export)
    if options.json:
        sys.stdout.write(json.dumps([dict(zip(HEADER, row, strict=True)) for row in rows(summaries)], indent=2) + "\n")
    elif not options.quiet:
        Console().print(shown(summaries))
        Console().print(f"written to {options.out}", highlight=False, soft_wrap=True)
    return failures(records)


def campaign(options: argparse.Namespace) -> list[Run]:
    """The runs that the options ask for.

    Raises:
        ScenarioError: something in them is not there or does not fit.
    """
    table = {key: getattr(options, key) for key in ("population", "iterations", "evaluations", "time_limit")}
    said = {key: value for key, value in table.items() if value is not None}
    specs = [with_budget(spec, said) for spec in parse_solvers(options.solvers)]
    seeds = range(options.seed, options.seed + options.runs)
    return grid(scenarios(options.scenario), specs, seeds)


def with_budget(spec: SolverSpec, table: dict[str, Any]) -> SolverSpec:
    """A solver with what the command line says of every run; IPOPT has no population."""
    own = {key: value for key, value in table.items() if key != "population" or spec.name != "ipopt"}
    return SolverSpec(spec.label, spec.name, spec.settings, spec.polish_starts, own)


def scenarios(names: Sequence[str]) -> dict[str, Scenario]:
    """By what they are called in tables: a built-in name, a file's stem, or its path where stems are the same.

    Raises:
        ScenarioError: one is not there, or is there twice.
    """
    stems = [Path(name).stem for name in names]
    found: dict[str, Scenario] = {}
    for name, stem in zip(names, stems, strict=True):
        label = stem if stems.count(stem) == 1 else name
        if label in found:
            raise ScenarioError(f"{name}: is there twice")
        found[label] = load(name)
    return found


def write_summary(folder: Path, summaries: Sequence[Summary], plots: bool) -> None:
    """Write ``summary.csv`` and ``comparison.png``."""
    with writing(folder):
        write_csv(folder / "summary.csv", HEADER, rows(summaries))
        if plots:
            from tpbso_casadi.campaign.figures import draw_comparison  # noqa: PLC0415 (matplotlib is slow to load)

            draw_comparison(folder / "comparison.png", summaries)
