"""``tpbso solve``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NoReturn, get_args

from problems import OBJECTIVES, CertificateStatus, Problem
from problems.evaluation import EvaluationOptions, InvalidEvaluation
from problems.families.two_segments import FORMULATIONS
from problems.tasks import Elbow, KnotRedundancy
from solvers import Interruption, best_so_far, deferred_interrupt
from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, print_error, run_command
from tpbso_casadi.cli.options import (
    SCENARIO,
    SCENARIOS,
    Group,
    add_backend,
    add_key,
    add_outside_files,
    add_search_keys,
    add_threads,
    defaulting,
    is_silent,
    listed,
    machine_group,
    path,
    printable_name,
    problem_group,
    search_group,
    whole_number,
)
from tpbso_casadi.cli.output import Output, add_output_options, run_folder
from tpbso_casadi.cli.progress import planning_progress
from tpbso_casadi.display.console import OutputConsole
from tpbso_casadi.display.plan_tables import print_plan, print_scenarios, summary_of
from tpbso_casadi.facade.statement import scenario_of
from tpbso_casadi.planning import PlannedMotion, Progress, plan
from tpbso_casadi.scenario import (
    DEFAULT,
    FAMILIES,
    MOST_LINKS,
    SOLVER_CATALOGUE,
    ModelSection,
    PointToPointTask,
    Scenario,
    ScenarioError,
    load,
    named,
    named_solver,
    plugin_failures_named,
)
from tpbso_casadi.storage import OutputError, check_certificate, read_earlier, result_of


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(
        parser(), solve, arguments, interrupted="interrupted before there was a plan; nothing was written"
    )


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "solve",
        "Plan the motion of a robot arm: search, refine, prove it for all t. Exit status 0: certified; 1: not; "
        "2: bad input, or a plug-in raised, and the best until then is written.",
        examples=[
            "time-3 --out runs/first",
            "obstacle-3 --solver pso --evaluations 20000 --seed 7",
            "closed-curve-time --polish --animate curve.html",
        ],
    )
    command_line.add_argument(
        "scenario", nargs="?", default=DEFAULT, metavar=SCENARIO, help="TOML file or built-in name"
    )
    command_line.add_argument("--list", action="store_true", help="list the built-in scenarios")
    add_problem_options(problem_group(command_line))
    add_search_options(search_group(command_line))
    machine = machine_group(command_line)
    add_backend(machine)
    add_threads(machine)
    add_output_options(command_line, "runs/SCENARIO-SOLVER-SEED..., none with --json")
    return command_line


KEYS = (  # of the scenario
    "objective", "elbow", "motion", "retime", "formulation", "knot_redundancy", "population", "iterations",
    "evaluations", "time_limit", "within", "first", "seed",
)  # fmt: skip


def add_problem_options(problem: Group) -> None:
    """The options that change what a scenario states."""
    add_outside_files(problem)
    problem.add_argument(
        "--links",
        type=whole_number(1, MOST_LINKS),
        metavar="K",
        help=defaulting("the same reach with K equal links", SCENARIOS),
    )
    problem.add_argument(
        "--objective",
        type=printable_name,
        metavar="NAME",
        help=defaulting(f"{', '.join(OBJECTIVES)}, a plug-in, or package.module:Class", SCENARIOS),
    )
    kinds = {"elbow": get_args(Elbow), "motion": FAMILIES, "formulation": FORMULATIONS}
    kinds["knot_redundancy"] = get_args(KnotRedundancy)
    words = {key: listed(known) for key, known in kinds.items()}
    elbow = f"branch of inverse kinematics at both ends: {words['elbow']}"
    add_key(problem, PointToPointTask, "elbow", elbow, metavar="KIND")
    motion = f"{words['motion']}: the paper's quartic and quintic, or splines in least time"
    add_key(problem, ModelSection, "motion", motion, metavar="KIND")
    retime = f"{SCENARIOS}; with splines, and where the objective does not depend on time"
    add_key(problem, ModelSection, "retime", "run the plan as fast as the limits allow on its path", default=retime)
    formulation = f"{words['formulation']}: cost (15), or feasible by construction"
    add_key(problem, ModelSection, "formulation", formulation, choices=FORMULATIONS, metavar="KIND")
    redundancy = f"of a path, where IPOPT follows it: {words['knot_redundancy']}"
    add_key(problem, ModelSection, "knot_redundancy", redundancy, metavar="KIND")


def add_search_options(search: Group) -> None:
    """The options that change how it is searched."""
    search.add_argument(
        "--solver",
        metavar="NAME",
        help=f"{listed(SOLVER_CATALOGUE.registry)}, a plug-in, or package.module:Class; settings and a polish may "
        "follow, as in bso(c1=1.5)+polish; an iteration of ipopt is a start [default: the scenario's, else abso with "
        "--polish, in space direct]",
    )
    add_search_keys(search, "population", "iterations", "evaluations", "time_limit", "within", "first", "seed")
    search.add_argument(
        "--polish",
        action="store_true",
        help="refine the best candidate with IPOPT; in space sequential programs always do",
    )
    add_search_keys(search, "polish_starts")
    search.add_argument(
        "--warm-start",
        type=path,
        metavar="RUN",
        help="a run folder of a similar scenario, with which the search begins; a sequence keeps the motions of stages "
        "that are stated as they were [default: none]",
    )


def solve(options: argparse.Namespace) -> int:
    """Plan the scenario of the options, write and print the plan; returns the exit status."""
    if options.list:
        print_scenarios(OutputConsole())
        return Exit.FEASIBLE
    given, evaluation = load(options.scenario, options.allow_outside_files), evaluation_options(options)
    scenario = with_options(given, options)
    earlier = None if options.warm_start is None else read_earlier(options.warm_start)
    output = Output.of(options, partial(run_folder, options, scenario), Path(options.scenario).stem)
    output.check()
    with named(options.scenario), plugin_failures_named(scenario, OutputError, InvalidEvaluation):
        return written(scenario, partial(plan, evaluation=evaluation, warm_start=earlier), output, options)


def written(
    scenario: Scenario, planned: Callable[..., PlannedMotion], output: Output, options: argparse.Namespace
) -> int:
    """Plan, write and print the plan, then draw it; returns the exit status."""
    if output.certificate is not None:
        check_certificate(output.certificate, scenario)
    problem = scenario.problem() if scenario.task.is_searched else None
    with deferred_interrupt() as interruption:
        with _working(problem, options) as progress:
            found, error = best_plan(partial(planned, scenario, progress, problem=problem))
            solution = replace(found, name=output.title)
            folder = output.write(solution, progress)
        try:
            if options.json:
                sys.stdout.write(result_of(solution).to_json())
            elif not options.quiet:
                print_plan(solution, OutputConsole())
                for line in output.told(solution):
                    OutputConsole().say(line)
                OutputConsole().say(f"written to {folder}")
            sys.stdout.flush()
        finally:  # though nobody may listen
            with _working(problem, options) as progress:
                output.add(solution, folder, progress, interruption)
        if error is not None:
            raise_again(error, scenario, what_there_is(solution, folder))
        return exit_status(solution, folder, interruption)


def best_plan(planning: Callable[[], PlannedMotion]) -> tuple[PlannedMotion, BaseException | None]:
    """The plan; or the best until something was raised, and that. Where there is none it passes."""
    try:
        return planning(), None
    except BaseException as error:
        found = best_so_far(error, PlannedMotion)
        if found is None:
            raise
        return found, error


def raise_again(error: BaseException, scenario: Scenario, there_is: str) -> NoReturn:
    """Raise what ended a plan; in one line with what there is, where plug-ins may have raised it."""
    try:
        with plugin_failures_named(scenario, OutputError, InvalidEvaluation):
            raise error
    except ScenarioError as told:
        raise ScenarioError(f"{told}; {there_is}") from error


@contextmanager
def _working(problem: Problem[Any] | None, options: argparse.Namespace) -> Iterator[Progress]:
    """The callbacks that show what is being done, while standard output is kept for the result."""
    with redirect_stdout(sys.stderr), planning_progress(problem, is_silent(options)) as progress:  # of plug-ins
        yield progress


def evaluation_options(options: argparse.Namespace) -> EvaluationOptions:
    """How to evaluate populations: the command line decides, then the environment."""
    return (
        EvaluationOptions(threads=options.threads)
        if options.backend is None
        else EvaluationOptions(options.backend, options.threads)
    )


def exit_status(solution: PlannedMotion, folder: Path | None, interruption: Interruption) -> int:
    """0 feasible, 1 not, 130 interrupted; the last two with a line that says what there is."""
    if interruption.requested:
        print_error(f"interrupted; {what_there_is(solution, folder)}")
        return Exit.INTERRUPTED
    if not solution.feasible:
        if solution.search is None:
            violated = solution.motion.status is CertificateStatus.VIOLATED
            verb = "cannot be run" if violated else "is not proven"
            subject = "motion" if solution.motion.is_stated else "path"
            print_error(f"the {subject} as it is {verb}: its {broken(solution, places=True)}")
        else:
            best = f"the best attempt's {broken(solution)}"
            print_error(f"no feasible plan was found; {best} (try more evaluations or another seed)")
        return Exit.INFEASIBLE
    return Exit.FEASIBLE


def what_there_is(solution: PlannedMotion, folder: Path | None) -> str:
    """The remains of a search that was cut short, and their place."""
    what = f"best plan so far, {summary_of(solution)}," if solution.feasible else "best attempt, not feasible,"
    return f"the {what} is {'printed' if folder is None else f'in {folder}'}"


def broken(solution: PlannedMotion, places: bool = False) -> str:
    """The limits that a plan is not proven to keep: by how much and, if asked for, where."""
    failed = [verdict for verdict in solution.verdicts if not verdict.satisfied]
    return ", ".join(
        f"{verdict.name} is {verdict.worst:.6g} {verdict.unit} where {verdict.bound:.6g} is the limit"
        + (f" ({verdict.where})" if places else "")
        for verdict in failed
    )


def with_options(scenario: Scenario, options: argparse.Namespace) -> Scenario:
    """The scenario with the values of the command line in place of its own; validated anew."""
    if options.links is not None:
        if scenario.arm is None:
            raise ScenarioError("--links: changes an [arm]; this scenario has a [robot]")
        scenario = scenario.replaced(arm=scenario.arm.with_links(options.links))
    solver = None if options.solver is None else named_solver(options.solver, "--solver")
    starts = options.polish_starts
    if options.polish and starts is None and not (scenario.solver.polish_starts or (solver and solver.polish_starts)):
        starts = 1
    return scenario_of(scenario, solver, starts, **{key: getattr(options, key) for key in KEYS})
