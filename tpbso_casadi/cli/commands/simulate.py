"""``tpbso simulate``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from rich.text import Text

from problems.certify import WorstIs
from solvers import deferred_interrupt
from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, print_error, run_command
from tpbso_casadi.cli.options import (
    SCENARIO,
    SCENARIOS,
    add_figures_option,
    add_key,
    add_no_plots,
    add_out,
    add_outside_files,
    add_quiet,
    add_search_keys,
    output_group,
    problem_group,
    search_group,
)
from tpbso_casadi.cli.output import free_folder
from tpbso_casadi.display.console import OutputConsole, number, prose, table_of, word
from tpbso_casadi.facade.simulating import simulate as simulate_scenario
from tpbso_casadi.facade.simulating import simulation_scenario
from tpbso_casadi.replanning import EVALUATION_RATE, FEWEST_EVALUATIONS, MOST_EVALUATIONS
from tpbso_casadi.scenario import (
    Scenario,
    SimulationSection,
    load,
    named,
)
from tpbso_casadi.simulation import (
    WHAT,
    Replan,
    SimulationResult,
    SummaryResult,
)
from tpbso_casadi.storage import check_run_folder

GOOD, BAD = "green", "red"


class ReplanLines:
    """Lines on what becomes otherwise while a simulation runs: the arm stops, goes on, or is without a proof."""

    def __init__(self, console: OutputConsole) -> None:
        self._console = console
        self._last = "goes on"

    def __call__(self, replan: Replan) -> None:
        """Say what an answer of the planner changes; nothing where that is nothing."""
        unproven = "" if replan.certified else ", not certified"
        unsafe = "" if replan.fail_safe else ", no stop in time is proven"
        words = f"{'stops' if replan.kind == 'stop' else 'goes on'}{unproven}{unsafe}"
        if words != self._last:
            self._console.say(f"t = {replan.time:.4g} s: {words}")
        self._last = words


def print_simulation(result: SimulationResult, console: OutputConsole) -> None:
    """Print the measurements, each with a mark where it should be otherwise, and limits that were broken."""
    summary = result.summary
    table = table_of(word("measured"), number("value"), prose(""))
    for name, value, good, remark in _rows(summary):
        table.add_row(name, Text(value, "" if good is None else GOOD if good else BAD), remark)
    console.print_table(f"{WHAT}; {summary.seconds:.6g} s", table)
    for limit in result.limits:
        if not limit.satisfied:
            worst = "?" if limit.worst is None else f"{limit.worst:.6g}"
            console.say(
                f"{limit.name} was {worst} {limit.unit} ({limit.where}); the limit is {limit.bound} {limit.unit}"
            )


def _rows(summary: SummaryResult) -> list[tuple[str, str, bool | None, str]]:
    closest, largest = summary.closest, max(summary.largest_jumps)
    distance = "-" if closest.distance is None else WorstIs.FOUND.distance(closest.distance)
    where = f"{closest.pair}, t = {closest.time:.4g} s, {'moving' if closest.moving else 'standing'}"
    kinds = f"{summary.new} new, {summary.old} old, {summary.stop} stops"
    proven = f"{summary.certified} certified as predicted, {summary.fail_safe} with a stop in time proven"
    return [
        ("collisions while moving", str(summary.collisions), not summary.collisions, "with what obstacles really did"),
        *([("moves without a proof", str(summary.unproven), False, "of that")] if summary.unproven else []),
        ("contacts while standing", str(summary.standing_contacts), None, "something came to the arm where it stood"),
        ("closest", distance, None, where if closest.pair else "nothing within reach"),
        ("largest jump", f"{largest:.2g}", summary.is_smooth, "of angle, speed, acceleration where motions join"),
        ("goals reached", str(summary.goals_reached), None, ""),
        ("replans", str(summary.replans), None, f"{kinds}; {proven}"),
        ("deadlines met", f"{summary.deadlines_met:.1%}", None, ""),
        ("time of a replan", f"{summary.median_ms:.4g} ms", None, _slowest(summary)),
    ]


def _slowest(summary: SummaryResult) -> str:
    return f"median; 99 %: {summary.percentile_99_ms:.4g} ms, largest: {summary.largest_ms:.4g} ms"


OVERRIDDEN = ("seconds", "every", "evaluations", "within")  # keys of [simulation]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(
        parser(), simulate, arguments, interrupted="interrupted before the first replan; nothing was written"
    )


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "simulate",
        "Simulate how the planner would drive an arm from goal to goal among obstacles that change course: at every "
        f"tick it sees them anew and has until the next one to answer. This is {WHAT}. Simulated time waits for the "
        "planner; how often it was late is counted. Exit status 0: nothing was touched by the moving arm, proven for "
        "all t, no limit was broken, and nothing jumped.",
        examples=["scene.toml --out runs/simulated", "scene.toml --seconds 5 --every 0.2 --seed 3"],
    )
    command_line.add_argument(
        "scenario", metavar=SCENARIO, help="TOML file or built-in name, with a [simulation] table or without"
    )
    problem = problem_group(command_line)
    add_outside_files(problem)
    for key, text in {"seconds": "to simulate", "every": "time between two replans, s"}.items():
        usual = f"{SCENARIOS}, else {SimulationSection.schema()[key].default:g}"
        add_key(problem, SimulationSection, key, text, default=usual, metavar="S")
    search = search_group(command_line)
    bounds = f"from {FEWEST_EVALUATIONS} to {MOST_EVALUATIONS}"
    evaluations = f"{SCENARIOS}, else {EVALUATION_RATE} for each second of --every, {bounds}"
    within = f"{SCENARIOS}, else no limit of time"
    add_search_keys(search, "evaluations", "within", "seed", evaluations=evaluations, within=within)
    output = output_group(command_line)
    add_out(output, "runs/SCENARIO-simulated-SEED")
    add_no_plots(output)
    add_figures_option(output)
    add_quiet(output)
    return command_line


def simulate(options: argparse.Namespace) -> int:
    """Run the simulation of the options, write and print it; returns the exit status."""
    settings = {key: getattr(options, key) for key in OVERRIDDEN}
    given = load(options.scenario, options.allow_outside_files)
    scenario = simulation_scenario(given, seed=options.seed, **settings)
    stem, console = Path(options.scenario).stem, OutputConsole(quiet=options.quiet)
    folders: list[Path] = []

    def ready(complete: Scenario) -> None:
        name = f"{stem}-simulated-{complete.solver.seed}"
        folders.append(options.out or free_folder(name, complete))
        check_run_folder(folders[0])

    with named(options.scenario), deferred_interrupt() as interruption:
        lines = ReplanLines(OutputConsole(stderr=True, quiet=options.quiet))
        run = simulate_scenario(scenario, ready=ready, told=lines)
        [folder] = folders
        run.save(folder, plots=not options.no_plots, figures=options.figures, title=stem)
        print_simulation(run.result, console)
        console.say(f"written to {folder}")
        if interruption.requested:
            print_error(f"interrupted; the {run.duration:.4g} s that were simulated are in {folder}")
            return Exit.INTERRUPTED
        if not run.good:
            print_error(f"not safe, see {folder}: {'; '.join(run.faults)}")
            return Exit.INFEASIBLE
        return Exit.FEASIBLE
