"""``python -m tpbso_casadi.simulate``: plan again and again while a simulated arm moves among simulated obstacles."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from problems import InvalidProblem
from solvers.driver.interruption import Interruption, deferred_interrupt
from tpbso_casadi.animation.simulated import write_player
from tpbso_casadi.cli.common import (
    Exit,
    OneLineParser,
    add_input_options,
    natural,
    path,
    positive_float,
    print_error,
    whole_number,
)
from tpbso_casadi.cli.display.console import OutputConsole
from tpbso_casadi.cli.display.simulation_tables import ReplanLines, print_simulation
from tpbso_casadi.cli.figure_formats import add_figures_option
from tpbso_casadi.cli.run_name import free_folder
from tpbso_casadi.planning.replanning.replanner import Replanner
from tpbso_casadi.scenario.loading import load
from tpbso_casadi.scenario.scenario import Scenario, parse_scenario, plugin_failures_named
from tpbso_casadi.scenario.section import MOST_EVALUATIONS, ScenarioError
from tpbso_casadi.scenario.simulation import SimulationSection
from tpbso_casadi.simulation.loop import Planner, Simulation
from tpbso_casadi.simulation.record import SimulationRecord
from tpbso_casadi.simulation.result import WHAT, SimulationResult
from tpbso_casadi.simulation.setting import Setting
from tpbso_casadi.simulation.store import write_simulation
from tpbso_casadi.storage.files import OutputError
from tpbso_casadi.storage.run_folder import Writer, check_run_folder

OVERRIDDEN = ("seconds", "every", "evaluations", "within")  # keys of [simulation]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = parser().parse_args(arguments)
    try:
        return simulate(options)
    except (ScenarioError, OutputError) as error:
        print_error(str(error))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        print_error("interrupted before the first replan; nothing was written")
        return Exit.INTERRUPTED


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    command_line = OneLineParser(
        "python -m tpbso_casadi.simulate",
        description="Simulate how the planner would drive an arm from goal to goal among obstacles that change "
        f"course: at every tick it sees them anew and has until the next one to answer. This is {WHAT}. "
        "Simulated time waits for the planner; how often it was late is counted. Exit status 0: nothing was touched by "
        "the moving arm, proven for all t, no limit was broken, and nothing jumped.",
    )
    command_line.add_argument("scenario", help="TOML file, with a [simulation] table or without")
    add_input_options(command_line)
    stated = command_line.add_argument_group("overriding the scenario")
    stated.add_argument("--seconds", type=positive_float, metavar="S", help="to simulate; 10 by default")
    stated.add_argument("--every", type=positive_float, metavar="S", help="time between two replans; 0.1 by default")
    stated.add_argument(
        "--evaluations", type=whole_number(1, MOST_EVALUATIONS), metavar="N", help="of each replan; 1500 by default"
    )
    stated.add_argument(
        "--within",
        type=positive_float,
        metavar="S",
        help="seconds that each replan may take; without it the same seed gives the same simulation",
    )
    stated.add_argument("--seed", type=natural, help="of changes of course and of the planner")
    output = command_line.add_argument_group("the output")
    output.add_argument(
        "--out",
        type=path,
        metavar="DIR",
        help="run folder, replaced as a whole; runs/SCENARIO-simulated-SEED by default",
    )
    output.add_argument("--no-plots", action="store_true", help="draw no figure, and write no player")
    add_figures_option(output)
    output.add_argument("--quiet", action="store_true", help="no progress, no table")
    return command_line


def simulate(options: argparse.Namespace) -> int:
    """Run the simulation of the options, write and print it; returns the exit status."""
    scenario = overridden(load(options.scenario, options.allow_outside_files), options)
    try:
        with plugin_failures_named(scenario, OutputError), deferred_interrupt() as interruption:
            setting = interruption.breakable(partial(Setting.of, scenario))
            name = f"{Path(options.scenario).stem}-simulated-{setting.scenario.solver.seed}"
            folder = options.out or free_folder(name, setting.scenario)
            check_run_folder(folder)
            simulation = Simulation(setting, interruption.breakable(partial(planner_of, setting)))
            record = simulation.run(interruption, ReplanLines(OutputConsole(stderr=True, quiet=options.quiet)))
            views = [] if options.no_plots else views_of(record, Path(options.scenario).stem, options.figures)
            return written(record, folder, views, interruption, OutputConsole(quiet=options.quiet))
    except ScenarioError as error:
        raise ScenarioError(f"{options.scenario}: {error}") from error


def overridden(scenario: Scenario, options: argparse.Namespace) -> Scenario:
    """The scenario with the values of the command line in place of its own."""
    table = (scenario.simulation or SimulationSection()).model_dump()
    table |= {key: getattr(options, key) for key in OVERRIDDEN if getattr(options, key) is not None}
    content = scenario.model_dump() | {"model": scenario.model.stated(), "simulation": table}
    if options.seed is not None:
        content["solver"]["seed"] = options.seed
    return parse_scenario(content)


def planner_of(setting: Setting) -> Planner:
    """The planner that is asked.

    Raises:
        ScenarioError: it does not plan such a task.
    """
    settings = setting.settings
    try:
        return Replanner(
            setting.scenario,
            every=settings.every,
            fail_safe_rate=settings.course_rate,
            evaluations=settings.evaluations,
            within=settings.within,
            seed=setting.scenario.solver.seed,
        )
    except InvalidProblem as error:
        raise ScenarioError(f"simulation.{error.field}: {error.reason}") from error


def views_of(record: SimulationRecord, title: str, formats: Sequence[str]) -> list[Writer]:
    """What shows a simulation: a figure in some formats, and a player of a title."""

    def draw(folder: Path) -> None:
        from tpbso_casadi.figures.simulation import draw_simulation  # noqa: PLC0415 (matplotlib is slow to load)

        draw_simulation(folder, record, formats)

    return [draw, lambda folder: write_player(folder, title, record)]


def written(
    record: SimulationRecord,
    folder: Path,
    views: Sequence[Writer],
    interruption: Interruption,
    console: OutputConsole,
) -> int:
    """Judge, write and print a simulation; returns the exit status."""
    result = SimulationResult.of(record)
    write_simulation(folder, record, result, views, interruption)
    print_simulation(result, console)
    console.say(f"written to {folder}")
    if interruption.requested:
        print_error(f"interrupted; the {record.duration:.4g} s that were simulated are in {folder}")
        return Exit.INTERRUPTED
    if not result.is_good:
        print_error(f"not safe, see {folder}: {'; '.join(faults(result))}")
        return Exit.INFEASIBLE
    return Exit.FEASIBLE


def faults(result: SimulationResult) -> Iterator[str]:
    """What should not have been."""
    summary = result.summary
    if summary.collisions or summary.unproven:
        yield f"{summary.collisions} collisions while moving, {summary.unproven} moves without a proof"
    if not summary.is_smooth:
        yield f"a jump of {max(summary.largest_jumps):.2g}"
    yield from (f"{limit.name} not kept" for limit in result.limits if not limit.satisfied)
