"""Makes ``arm-motions-2``: its files, frozen, from the definitions; then values that are known of its instances.

    python -m benchmarks.suite freeze [NAME ...]           # files and descriptions of what is other than in version 1
    python -m benchmarks.suite collect                     # the descriptions in one file
    python -m benchmarks.suite known 1-5,8 [NAME ...]      # best known values of instances, or best known fronts
    python -m benchmarks.suite descents 1-5 [NAME ...]     # to these the best motions that IPOPT descends to
    python -m benchmarks.suite merge                       # these in one file for each suite, with lower bounds
    python -m benchmarks.suite table                       # the functions, as the manual lists them
    python -m benchmarks.suite differences                 # how far merits are from what their motions are certified at
    python -m benchmarks.suite speed                       # microseconds an evaluation

What stands in a package is frozen: this is how it came about, and how a next suite would. Version 1 was made likewise,
with ``MENDED`` all functions, and instances drawn.
"""

from __future__ import annotations

import json
import sys
import time
import timeit
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.freeze.definitions import DEFINITIONS, MENDED, NEWEST, Definition, Tables
from benchmarks.freeze.freezing import frozen, has_postures, lower_bound
from solvers import LSHADE, Budget, SearchBox, Solver, minimize
from tpbso_casadi.cli.commands.suite import numbers
from tpbso_casadi.judging.searches import search_front
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import SolverSection, find_solver
from tpbso_casadi.suite import SUITE, SUITES, SuiteProblem, suite
from tpbso_casadi.suite.fronts import CORNER
from tpbso_casadi.suite.frozen import DESCRIPTIONS, FunctionContent, content_of, folder_of
from tpbso_casadi.suite.motions import problem_of
from tpbso_casadi.suite.problem import BEST_KNOWN
from tpbso_casadi.trade_off.front import hypervolume

FOLDER = folder_of(NEWEST)
RUNS = Path("runs")  # with a folder for each suite of what is collected and merged in the end
WORK = RUNS / NEWEST
SEARCHES = ("lshade", "abso", "minion")  # each followed by CMA-ES from what it found
SEEDS = (1, 2)  # of searches
SEARCHED, REFINED, STARTS = 30_000, 2_000, 2  # evaluations of both parts; descents of IPOPT
SAME = 1e-4  # relative
FRONT, LONGER, SHOWN = 30_000, 60_000, 24  # evaluations of searches for a front, and of the last; candidates stored
CANDIDATES = 1024
NOTABLE = 0.01  # of a merit: larger differences from a motion's exact objective are counted


def freeze(names: Sequence[str]) -> None:
    FOLDER.mkdir(exist_ok=True)
    WORK.mkdir(parents=True, exist_ok=True)
    for definition in DEFINITIONS:
        if definition.name not in (names or MENDED):
            continue
        began = time.perf_counter()
        description, content = frozen(definition, scenarios_of(definition))
        path_of(definition.name).write_bytes(content)
        forget(definition.name)
        (WORK / f"{definition.name}.part").write_text(json.dumps(description.plain))
        seconds = time.perf_counter() - began
        print(
            f"{definition.name:22} d={description.dimension:2} {len(content) / 1e3:6.0f} kB {seconds:6.1f} s",
            flush=True,
        )


def scenarios_of(definition: Definition) -> Sequence[Tables]:
    """Those of a function's instances in the suite before, or of the fine function; none where they are drawn."""
    if definition.name in MENDED:
        [before] = suite(SUITE, [definition.name], [1])
        return content_of(SUITE, definition.name, before.function.digest).scenarios
    return FunctionContent.read(path_of(definition.fine).read_bytes()).scenarios if definition.fine else ()


def forget(function: str) -> None:
    """What is known of a function's instances, which are others now."""
    known = json.loads((FOLDER / BEST_KNOWN).read_text()) if (FOLDER / BEST_KNOWN).exists() else {}
    write_known(FOLDER, {name: told for name, told in known.items() if name.partition("@")[0] != function})


def write_known(folder: Path, known: Mapping[str, Any]) -> None:
    lines = ",\n".join(f"{json.dumps(name)}: {json.dumps(told)}" for name, told in known.items())
    (folder / BEST_KNOWN).write_text(f"{{\n{lines}\n}}\n" if known else "{}\n")


def path_of(function: str) -> Path:
    return FOLDER / f"{function}.npz.xz"


def collect(_: Sequence[str] = ()) -> None:
    paths = [WORK / f"{definition.name}.part" for definition in DEFINITIONS]
    lines = ",\n".join(json.dumps(json.loads(path.read_text())) for path in paths if path.exists())
    head = f'"suite": "{NEWEST}", "extends": "{SUITE}"'
    (FOLDER / DESCRIPTIONS).write_text(f'{{{head}, "functions": [\n{lines}\n]}}\n')


def known(arguments: Sequence[str]) -> None:
    for problem in problems_of(arguments):
        place = known_place(problem)
        if place.exists():
            continue
        if len(problem.objectives) > 1:
            front = best_front_of(problem)
            place.write_text(json.dumps(front))
            print(f"{problem.name} {front['ways']}", flush=True)
            continue
        keep(problem, list(searched(problem)))


def problems_of(arguments: Sequence[str]) -> Iterator[SuiteProblem]:
    """All functions, or some, of the first of some instances before those of the next."""
    stated, *names = arguments
    for instance in numbers(stated):
        yield from suite(NEWEST, names or None, [instance])


def descents(arguments: Sequence[str]) -> None:
    for problem in problems_of(arguments):
        place = known_place(problem)
        best = json.loads(place.read_text()) if place.exists() and len(problem.objectives) == 1 else None
        if best is not None and best["descended_value"] is None:
            best["descended_value"] = descended(problem)
            place.write_text(json.dumps(best))
            print(f"{problem.name} {best['value']:.8g} {best['descended_value']}", flush=True)


def keep(problem: SuiteProblem, runs: Sequence[Way]) -> None:
    """Write down the best of some runs, until it is merged."""
    best = best_of(problem, runs)
    known_place(problem).write_text(json.dumps(best))
    told = "no feasible candidate" if best is None else f"{best['value']:.8g} {best['ways']} {best['certified']}"
    print(f"{problem.name} {told}", flush=True)


def known_place(problem: SuiteProblem) -> Path:
    """Where what is found of a problem lies until it is merged; of another instance of that number elsewhere."""
    check, folder = problem.function.checks[problem.instance - 1], RUNS / problem.suite
    folder.mkdir(parents=True, exist_ok=True)
    return folder / f"{problem.function.name}@{problem.instance}-{check[:8]}.known"


Way = tuple[str, float, np.ndarray]  # how a candidate was found, its merit, itself


def best_of(problem: SuiteProblem, runs: Sequence[Way]) -> dict[str, Any] | None:
    """The best candidate of some runs, whether its motion is certified, and how often each way comes near it."""
    _, value, x = min(runs, key=lambda run: run[1])
    if value > problem.feasible_merit:
        return None
    found, before, least = problem.decode(x), problem.best_known, value + SAME * abs(value)
    ways = {way: [0, 0] for way, *_ in runs}
    for way, merit, _ in runs:
        ways[way] = [ways[way][0] + (merit <= least), ways[way][1] + 1]
    earlier = {} if before is None else before.ways
    for way in (way for way in earlier if way not in ways):  # of which the best alone is known
        near, count = earlier[way]
        ways[way] = [near if before is not None and before.value <= least else 0, count]
    return {
        "value": value,
        "x": x.tolist(),
        "certified": found.certified,
        "motion_value": found.objective,
        "ways": ways,
        "descended_value": None if before is None else before.descended_value,
    }


def searched(problem: SuiteProblem) -> Iterator[Way]:
    """Each search, refined; and what was known before."""
    for way in SEARCHES:
        solver = find_solver(way)()
        assert isinstance(solver, Solver)
        for seed in SEEDS:
            found = minimize(problem.merit, SearchBox(*problem.bounds), solver, Budget(evaluations=SEARCHED), seed)
            yield refined(problem, way, float(found.cost), found.x)
    if problem.best_known is not None:
        yield "known before", problem.best_known.value, problem.best_known.x


def refined(problem: SuiteProblem, way: str, merit: float, x: np.ndarray) -> Way:
    """What CMA-ES finds near a candidate (d,)."""
    from solvers.external.cma_es import CMAES  # noqa: PLC0415 (optional)

    budget = Budget(evaluations=REFINED)
    near = minimize(problem.merit, SearchBox(*problem.bounds), CMAES(sigma=0.02), budget, SEEDS[0], known=x[None])
    return (f"{way}+cma", float(near.cost), near.x) if near.cost < merit else (f"{way}+cma", merit, x)


def descended(problem: SuiteProblem) -> float | None:
    """The objective of the best certified motion of a few descents by IPOPT; None where there is none."""
    model = problem_of(problem.scenario, problem.suite)
    if not model.has_program:
        return None
    solver = SolverSection(name="ipopt", iterations=STARTS)
    found = plan(problem.scenario.replaced(solver=solver), problem=model)
    value = float(found.objective)
    return value if found.motion.feasible and isfinite(value) else None


class Archive:
    """All feasible candidates that no other one dominates, of the searches of a problem with two objectives.

    Called as a :class:`tpbso_casadi.suite.Recording` is, which needs a front that is known already.
    """

    def __init__(self, problem: SuiteProblem) -> None:
        self.problem, self.done = problem, 0
        self.values, self.x = np.empty((0, 2)), np.empty((0, problem.dimension))

    def of_population(self, candidates: np.ndarray) -> np.ndarray:
        """Merits (m, 2) of candidates (m, d), which are kept where they belong to the front."""
        merits = self.problem.merit(candidates)
        self.done += len(merits)
        feasible = merits[:, 0] <= self.problem.feasible_merit
        self.add(merits[feasible], candidates[feasible])
        return merits

    def add(self, values: np.ndarray, x: np.ndarray) -> None:
        """More objectives (m, 2) and candidates (m, d), all feasible."""
        values, x = np.vstack([self.values, values]), np.vstack([self.x, x])
        order = np.lexsort(values.T[::-1])
        lowest = np.minimum.accumulate(np.concatenate([[np.inf], values[order, 1]]))
        front = order[values[order, 1] < lowest[:-1]]
        self.values, self.x = values[front], x[front]

    def rows(self, count: int) -> np.ndarray:
        """Rows of so many candidates, or of all, from one end of the front to the other."""
        return np.unique(np.linspace(0, len(self.x) - 1, count).round().astype(int))

    def hypervolume(self, ideal: np.ndarray, nadir: np.ndarray) -> float:
        """Where objectives are 0 at the one and 1 at the other, up to the corner."""
        return hypervolume((self.values - ideal) / (nadir - ideal), (CORNER, CORNER))


def best_front_of(problem: SuiteProblem) -> dict[str, Any]:
    """The front of weighted sums, of NSGA-II, and of NSGA-II from there on; what share of it each has."""
    from solvers.external.pymoo_solvers import Pymoo  # noqa: PLC0415 (optional)

    together, nsga2 = Archive(problem), Pymoo(population=100, algorithm="nsga2")
    ways, found = {"weighted lshade": LSHADE(), "nsga2": nsga2, "nsga2 from both": nsga2}, {}
    for way, solver in ways.items():
        found[way] = Archive(problem)
        is_last = way == "nsga2 from both"
        known = together.x[together.rows(nsga2.population)] if is_last else None
        search_front(found[way], solver, LONGER if is_last else FRONT, SEEDS[0], known)
        together.add(found[way].values, found[way].x)
    ideal, nadir = together.values.min(axis=0), together.values.max(axis=0)
    whole = together.hypervolume(ideal, nadir)
    shown = together.rows(SHOWN)
    return {
        "ideal": ideal.tolist(),
        "nadir": nadir.tolist(),
        "hypervolume": whole,
        "x": together.x[shown].tolist(),
        "values": together.values[shown].tolist(),
        "ways": {way: each.hypervolume(ideal, nadir) / whole for way, each in found.items()},
    }


def merge(_: Sequence[str] = ()) -> None:
    for name in SUITES:
        merge_own([problem for problem in suite(name) if problem.suite == name])


def merge_own(problems: Sequence[SuiteProblem]) -> None:
    """What is known of the problems of a suite that come from no other one."""
    folder, everything = folder_of(problems[0].suite), {}
    stored = json.loads((folder / BEST_KNOWN).read_text())
    for problem in problems:
        name, place = f"{problem.function.name}@{problem.instance}", known_place(problem)
        told = stored.get(name, {})
        best = json.loads(place.read_text()) if place.exists() else None
        if best is not None:
            told |= {"best" if len(problem.objectives) == 1 else "front": best}
        content = content_of(problem.suite, problem.function.name, problem.function.digest)
        tables = content.scenarios[problem.instance - 1]
        if len(problem.objectives) == 1 and "lower_bound" not in told and has_postures(tables):
            least = lower_bound(tables, problem_of(problem.scenario, problem.suite))
            told |= {} if least is None else {"lower_bound": least}
        if told:
            everything[name] = told
    write_known(folder, everything)


def table_lines() -> Iterator[str]:
    """The functions as a table in Markdown."""
    yield "| function | group | variables | minimised | constraints | what it is |"
    yield "|---|---|---|---|---|---|"
    for function in suite(SUITE).functions:
        objectives = ", ".join(f"{name} ({unit})" if unit != "1" else name for name, unit in function.objectives)
        constraints = ", ".join(function.constraints)
        yield (
            f"| `{function.name}` | {function.group} | {function.dimension} | {objectives} | {constraints} | "
            f"{function.title} |"
        )


def table(_: Sequence[str] = ()) -> None:
    print("\n".join(table_lines()))


def differences_of(problem: SuiteProblem, every: int = 1) -> np.ndarray:
    """By how much, relatively, the exact objectives of motions are above the merits of the best known candidates, (n,).

    Of two objectives the one that differs more counts; of a front one candidate in ``every`` is looked at.
    """
    known, front = problem.best_known, problem.best_front
    if known is not None:
        return np.array([known.motion_value / known.value - 1.0])
    assert front is not None
    exact = [[value for *_, value in problem.decode(x).motion.objective_parts] for x in front.x[::every]]
    apart = np.array(exact) / front.values[::every] - 1.0
    return apart[np.arange(len(apart)), np.abs(apart).argmax(axis=1)]


def difference_line(function: str) -> str:
    """Of a function the largest difference, and of how many known candidates it is above 1 %, in each suite."""
    found: dict[str, str] = {}  # by the suite that has it as its own
    for problems in (suite(name, [function]) for name in SUITES):
        if problems[0].suite not in found:
            apart = np.concatenate([differences_of(problem) for problem in problems])
            worst, many = apart[np.abs(apart).argmax()], int((np.abs(apart) > NOTABLE).sum())
            found[problems[0].suite] = f"{100.0 * worst:+.2f} %, {many} of {len(apart)}"
    columns = [found.get(name, "the same") for name in SUITES]
    return f"| `{function}` | {' | '.join(columns)} |"


def differences(names: Sequence[str] = ()) -> None:
    print("| function | " + " | ".join(f"`{name}`" for name in SUITES) + " |")
    print("|---|" + "---|" * len(SUITES))
    for problem in suite(SUITE, names or None, [1]):
        print(difference_line(problem.function.name), flush=True)


def speed(_: Sequence[str] = ()) -> None:
    """Microseconds an evaluation, of 1,024 candidates at once, the best of seven."""
    for problem in suite(NEWEST, instances=[1]):
        candidates = np.random.default_rng(0).uniform(*problem.bounds, (CANDIDATES, problem.dimension))
        seconds = min(timeit.repeat(lambda p=problem, x=candidates: p.merit(x), number=1, repeat=7))
        print(f"{problem.function.name:26} {1e6 * seconds / CANDIDATES:6.1f}")


if __name__ == "__main__":
    commands = {each.__name__: each for each in (freeze, collect, known, descents, merge, table, differences, speed)}
    commands[sys.argv[1]](sys.argv[2:])
