"""``python -m tpbso_casadi.solve``: plan one motion and write its files and figures."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path
from typing import Any, get_args

from problems import OBJECTIVES
from problems.encodings import FORMULATIONS
from problems.evaluation import BACKENDS, EvaluationOptions, InvalidEvaluation
from problems.tasks.elbow import Elbow
from problems.tasks.paths.path_following import KnotRedundancy
from solvers.driver.interruption import Interruption, deferred_interrupt
from tpbso_casadi.cli.common import (
    Exit,
    OneLineParser,
    add_input_options,
    natural,
    positive_float,
    print_error,
    whole_number,
    word,
)
from tpbso_casadi.cli.display.console import OutputConsole
from tpbso_casadi.cli.display.plan_tables import print_plan, print_scenarios, summary_of
from tpbso_casadi.cli.display.planning_progress import planning_progress
from tpbso_casadi.cli.output import Output, add_output_options
from tpbso_casadi.cli.run_name import run_folder
from tpbso_casadi.planning.plan import plan
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.scenario import overriding
from tpbso_casadi.scenario.cases.builtin import DEFAULT
from tpbso_casadi.scenario.catalogues import SOLVER_CATALOGUE
from tpbso_casadi.scenario.loading import load
from tpbso_casadi.scenario.motions import FAMILIES
from tpbso_casadi.scenario.scenario import Scenario, plugin_failures_named
from tpbso_casadi.scenario.section import (
    MOST_EVALUATIONS,
    MOST_ITERATIONS,
    MOST_LINKS,
    MOST_MEMBERS,
    MOST_POLISH_STARTS,
    ScenarioError,
)
from tpbso_casadi.storage.content import result_of
from tpbso_casadi.storage.files import OutputError

MOST_THREADS = 256


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = parser().parse_args(arguments)
    try:
        if options.list:
            print_scenarios(OutputConsole())
            return Exit.FEASIBLE
        return solve(options)
    except (ScenarioError, OutputError, InvalidEvaluation) as error:
        print_error(str(error))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        print_error("interrupted before there was a plan; nothing was written")
        return Exit.INTERRUPTED


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    command_line = OneLineParser("python -m tpbso_casadi.solve", description="Plan the motion of a robot arm.")
    command_line.add_argument(
        "scenario", nargs="?", default=DEFAULT, help=f"TOML file or built-in name; {DEFAULT} by default"
    )
    command_line.add_argument("--list", action="store_true", help="list the built-in scenarios")
    add_input_options(command_line)
    problem = command_line.add_argument_group("the problem, overriding the scenario")
    problem.add_argument(
        "--links", type=whole_number(1, MOST_LINKS), metavar="K", help="the same reach with K equal links"
    )
    problem.add_argument(
        "--objective", type=word, metavar="NAME", help=f"{', '.join(OBJECTIVES)}, a plug-in, or package.module:Class"
    )
    problem.add_argument("--elbow", choices=get_args(Elbow), help="branch of inverse kinematics at both ends")
    problem.add_argument("--motion", choices=FAMILIES, help="the paper's quartic and quintic, or splines in least time")
    problem.add_argument(
        "--retime",
        action=argparse.BooleanOptionalAction,
        help="run the plan as fast as the limits allow on its path; by default with splines, and where the objective "
        "does not depend on time",
    )
    problem.add_argument("--formulation", choices=FORMULATIONS, help="cost (15), or feasible by construction")
    problem.add_argument(
        "--knot-redundancy", choices=get_args(KnotRedundancy), help="of a path, where IPOPT follows it"
    )
    search = command_line.add_argument_group("the search, overriding the scenario")
    search.add_argument(
        "--solver",
        type=word,
        metavar="NAME",
        help=f"{', '.join(SOLVER_CATALOGUE.registry)}, a plug-in, or package.module:Class; without it and without one "
        f"in the scenario, {overriding.DEFAULT_SOLVER} with --polish",
    )
    search.add_argument("--population", type=whole_number(0, MOST_MEMBERS), metavar="M", help="members of the swarm")
    search.add_argument(
        "--iterations",
        type=whole_number(1, MOST_ITERATIONS),
        metavar="N",
        help="stop after N iterations, or starts with gradients",
    )
    search.add_argument(
        "--evaluations", type=whole_number(1, MOST_EVALUATIONS), metavar="N", help="stop after N evaluations"
    )
    search.add_argument("--time-limit", type=positive_float, metavar="S", help="stop after S seconds")
    search.add_argument(
        "--within", type=positive_float, metavar="S", help="the best plan in S seconds: search and polish repeatedly"
    )
    search.add_argument("--seed", type=natural, help="same seed, same result")
    search.add_argument(
        "--polish",
        action="store_true",
        help="refine the best candidate with IPOPT; in space sequential programs always do",
    )
    search.add_argument(
        "--polish-starts",
        type=whole_number(1, MOST_POLISH_STARTS),
        metavar="N",
        help="refine N good candidates that lie apart, keep the best",
    )
    speed = command_line.add_argument_group("the machine; these change how long it takes, not the result")
    speed.add_argument("--backend", choices=BACKENDS, help="evaluates populations; auto by default")
    speed.add_argument(
        "--threads", type=whole_number(1, MOST_THREADS), default=1, metavar="N", help="for populations of thousands"
    )
    add_output_options(command_line, "runs/SCENARIO-SOLVER-SEED...")
    return command_line


def solve(options: argparse.Namespace) -> int:
    """Plan the scenario of the options, write and print the plan; returns the exit status."""
    given, evaluation = load(options.scenario, options.allow_outside_files), evaluation_options(options)
    scenario = overridden(given, options)
    output = Output.of(options, partial(run_folder, options, scenario), Path(options.scenario).stem)
    output.check()
    try:
        with plugin_failures_named(scenario, OutputError, InvalidEvaluation):
            return written(scenario, evaluation, output, options)
    except ScenarioError as error:
        raise ScenarioError(f"{options.scenario}: {error}") from error


def written(
    scenario: Scenario, evaluation: EvaluationOptions | None, output: Output, options: argparse.Namespace
) -> int:
    """Plan, then write and print the plan; returns the exit status."""
    problem = scenario.problem() if scenario.task.is_searched else None
    with deferred_interrupt() as interruption:
        foreign_output = redirect_stdout(sys.stderr)  # of plug-ins: standard output is for the result
        with foreign_output, planning_progress(problem, options.quiet) as progress:
            solution = plan(scenario, progress, evaluation, problem)
            folder = output.write(solution, progress, interruption)
        if options.json:
            sys.stdout.write(result_of(solution).to_json())
        elif not options.quiet:
            print_plan(solution, OutputConsole())
            OutputConsole().say(f"written to {folder}")
        return exit_status(solution, folder, interruption)


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
        what = f"best plan so far, {summary_of(solution)}," if solution.feasible else "best attempt, not feasible,"
        print_error(f"interrupted; the {what} is {'printed' if folder is None else f'in {folder}'}")
        return Exit.INTERRUPTED
    if not solution.feasible:
        broken = ", ".join(
            f"{verdict.name} is {verdict.worst:.6g} {verdict.unit} where {verdict.bound:.6g} is the limit"
            for verdict in solution.verdicts
            if not verdict.satisfied
        )
        if solution.searched is None:
            print_error(f"the path as it is cannot be run: its {broken}")
        else:
            print_error(
                f"no feasible plan was found; the best attempt's {broken} (try more evaluations or another seed)"
            )
        return Exit.INFEASIBLE
    return Exit.FEASIBLE


def overridden(scenario: Scenario, options: argparse.Namespace) -> Scenario:
    """The scenario with the values of the command line in place of its own; validated anew."""
    arm = None
    if options.links is not None:
        if scenario.arm is None:
            raise ScenarioError("--links: changes an [arm]; this scenario has a [robot]")
        arm = scenario.arm.with_links(options.links).model_dump()
    search = stated(options, "population", "iterations", "evaluations", "time_limit", "within", "seed", "polish_starts")
    return overriding.overridden(
        scenario,
        arm=arm,
        task=stated(options, "objective", "elbow"),
        model=stated(options, "motion", "retime", "formulation", "knot_redundancy"),
        solver=search if options.solver is None else {**search, "name": options.solver},
        polish=options.polish,
    )


def stated(options: argparse.Namespace, *keys: str) -> dict[str, Any]:
    """Those options that the command line states."""
    return {key: getattr(options, key) for key in keys if getattr(options, key) is not None}
