"""Solvers compared on ``arm-motions-1``, and what each part of the paper's swarm is worth.

    python -m benchmarks.judged run [BUDGET ...]    # hours; the same command resumes; runs/judged-100 and so on
    python -m benchmarks.judged elsewhere           # the same for solvers that need an older NumPy, with that
    python -m benchmarks.judged keep                # the runs, thinned, as benchmarks/results/judged-*.csv.xz
    python -m benchmarks.judged known               # better values than known ones, for `benchmarks.suite merge`
    python -m benchmarks.judged tables              # what the manual shows of these, in Markdown
    python -m benchmarks.judged picture FILE        # and its picture
    python -m benchmarks.judged overhead            # CPU time of each solver itself
    python -m benchmarks.judged report FOLDER       # all with 1,000 as `tpbso suite report` shows it

Anybody's solver is judged beside them without running them: ``tpbso suite report mine --runs mine.csv --runs
benchmarks/results/judged-100.csv.xz``.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite
from pathlib import Path

import numpy as np

from benchmarks.suite import keep as keep_best
from benchmarks.suite import refined
from solvers import Budget, SearchBox, Solver, minimize
from tpbso_casadi.cli.commands.suite import main as suite_command
from tpbso_casadi.cli.commands.suite import numbers
from tpbso_casadi.judging.grid import parse_solver, parse_solvers, suite_grid
from tpbso_casadi.judging.page import RUNS
from tpbso_casadi.judging.referee import BEATEN, Referee, on_common_problems
from tpbso_casadi.judging.results import recordings
from tpbso_casadi.judging.searches import SuiteRun
from tpbso_casadi.judging.statistics import holm, p_text, ranking, signed_rank
from tpbso_casadi.judging.store import STORE, RunStore
from tpbso_casadi.scenario import find_solver
from tpbso_casadi.suite import SUITE, Recording, SuiteProblem, read_runs, suite, write_runs

RESULTS = Path(__file__).with_name("results")
SLOW = ("moving-5", "ur5e-box", "panda-boxes", "panda-payload")  # 57 to 85 us an evaluation

SOLVERS = {  # by label in the tables
    "abso": "abso",
    "L-SHADE": "lshade",
    "PSO": "pso",
    "GA": "ga",
    "BSO": "bso",
    "BSO as printed": "bso(printed)",
    "BAS": "bas",
    "random search": "random",
    "CMA-ES (cma)": "cma",
    "DE (SciPy)": "scipy-de",
    "DIRECT (SciPy)": "scipy-direct",
    "dual annealing (SciPy)": "annealing",
    "PSO (pymoo)": "pymoo",
    "DE (pymoo)": "pymoo(algorithm=de)",
    "GA (pymoo)": "pymoo(algorithm=ga)",
    "SaDE (pygmo)": "pygmo",
    "DE 1220 (pygmo)": "pygmo(algorithm=de1220)",
    "ARRDE (Minion)": "minion",
    "jSO (Minion)": "minion(algorithm=jSO)",
    "NL-SHADE-RSP (Minion)": "minion(algorithm=NLSHADE_RSP)",
    "GWO (mealpy)": "mealpy(algorithm=GWO.OriginalGWO)",
}
NEED_OLDER_NUMPY = {"NGOpt (nevergrad)": "nevergrad(optimizer=NGOpt)"}  # than 2.4, with which a store is of its own
ONE_BY_ONE = (  # whose candidates are evaluated one at a time, or that take long themselves: with 100 a variable alone
    *("BAS", "DIRECT (SciPy)", "dual annealing (SciPy)", "PSO (pymoo)", "GA (pymoo)", "SaDE (pygmo)"),
    *("DE 1220 (pygmo)", "GWO (mealpy)"),
)
LEFT_BEHIND = ("BSO as printed", "random search", "DE (pymoo)")  # that are far behind with 1,000: not with 10,000
PARTS = {  # of BSO, one changed at a time
    "BSO": "bso",
    "no antennae: the swarm alone": (
        "pso(population=30,c1=1.7,c2=1.7,inertia_first=0.9,inertia_last=0.4,velocity_range=0.1)"
    ),
    "antennae evaluated, but no step towards them": "bso(lambda_=1.0)",
    "no swarm term: the step of the antennae alone": "bso(lambda_=0.0)",
    "no pull to the swarm's best": "bso(c2=0.0)",
    "no step schedule": "bso(eta=1.0)",
    "no inertia, (27) as printed": "bso(inertia_first=1.0,inertia_last=1.0)",
    "sign of (28) as printed": "bso(antenna_sign=printed)",
    "both as printed": "bso(printed)",
    "a larger share of the antennae: λ = 0.4": "bso(lambda_=0.4)",
    "the same, both as printed": "bso(printed,lambda_=0.4)",
}


@dataclass(frozen=True, kw_only=True)
class Stage:
    """What runs with one budget.

    Attributes:
        budget: evaluations for each variable.
        parts: of the suite, functions and instances.
        solvers: by label.
        elsewhere: those of another environment; or none.
        variants: of BSO, by label; or none.
    """

    budget: int
    parts: tuple[tuple[tuple[str, ...], str], ...]
    solvers: dict[str, str]
    elsewhere: dict[str, str]
    variants: dict[str, str]

    @property
    def folder(self) -> Path:
        """Of the campaign."""
        return Path("runs", f"judged-{self.budget}")

    @property
    def folder_elsewhere(self) -> Path:
        """Of the campaign in another environment."""
        return Path("runs", f"judged-{self.budget}-elsewhere")

    @property
    def results(self) -> Path:
        """The runs of the solvers, as they are kept."""
        return RESULTS / f"judged-{self.budget}.csv.xz"

    @property
    def results_of_variants(self) -> Path:
        """Those of the variants of BSO, itself left out."""
        return RESULTS / f"judged-{self.budget}-bso.csv.xz"

    @property
    def stated(self) -> str:
        """All solvers, as ``tpbso suite run`` takes them."""
        return ",".join(dict.fromkeys([*self.solvers.values(), *self.variants.values()]))

    @property
    def problems(self) -> list[SuiteProblem]:
        """Of all parts."""
        return [each for functions, instances in self.parts for each in suite(SUITE, functions, numbers(instances))]

    def runs(self, problems: Sequence[SuiteProblem]) -> list[SuiteRun]:
        """Of all solvers."""
        return suite_grid(problems, parse_solvers(self.stated), 1, self.budget)


def stages() -> tuple[Stage, Stage, Stage]:
    every = tuple(each.name for each in suite().functions if len(each.objectives) == 1)
    faster = tuple(name for name in every if name not in SLOW)
    quick = {label: stated for label, stated in SOLVERS.items() if label not in ONE_BY_ONE}
    quickest = {label: stated for label, stated in quick.items() if label not in LEFT_BEHIND}
    return (
        Stage(budget=100, parts=((every, "6-15"),), solvers=SOLVERS, elsewhere=NEED_OLDER_NUMPY, variants=PARTS),
        Stage(budget=1000, parts=((every, "6"), (faster, "7-15")), solvers=quick, elsewhere={}, variants=PARTS),
        Stage(budget=10_000, parts=((faster, "6-7"),), solvers=quickest, elsewhere={}, variants={}),
    )


def run(*budgets: str) -> None:
    for stage in stages():
        if not budgets or str(stage.budget) in budgets:
            run_stage(stage, stage.stated, stage.folder)


def elsewhere() -> None:
    for stage in stages():
        if stage.elsewhere:
            run_stage(stage, ",".join(stage.elsewhere.values()), stage.folder_elsewhere)


def run_stage(stage: Stage, solvers: str, folder: Path) -> None:
    for functions, instances in stage.parts:
        what = ["--functions", ",".join(functions), "--instances", instances, "--solvers", solvers]
        suite_command(["run", *what, "--budget", str(stage.budget), "--out", str(folder), "--no-plots"])


FEWEST_STEPS = 1.02  # evaluations of a line that is kept, over those of the one before
DIGITS = 9  # of merits


def keep() -> None:
    RESULTS.mkdir(exist_ok=True)
    for stage in stages():
        with RunStore(stage.folder / STORE) as store:
            runs = [thinned(each) for each in recordings(stage.runs(stage.problems), store)]
        if stage.elsewhere:
            runs += [thinned(each) for each in read_runs(stage.folder_elsewhere / RUNS)]
        variants = {label: stated for label, stated in stage.variants.items() if label not in stage.solvers}
        for path, solvers in ((stage.results, stage.solvers | stage.elsewhere), (stage.results_of_variants, variants)):
            labels = {stated: label for label, stated in solvers.items()}
            named = [replace(each, solver=labels[each.solver]) for each in runs if each.solver in labels]
            if named:
                write_runs(path, named)


def thinned(run: Recording) -> Recording:
    """A run with the last of all improvements that come within 2 % of the evaluations; its ends are exact."""
    kept: list[tuple[int, float]] = []
    bound = run.problem.feasible_merit
    for evaluations, merit in zip(run.evaluations, run.merits, strict=True):
        infeasible = bool(kept) and kept[-1][1] > bound >= merit
        if len(kept) > 1 and not infeasible and evaluations < FEWEST_STEPS * kept[-2][0]:
            kept.pop()
        rounded = float(f"{merit:.{DIGITS}g}")
        kept.append((evaluations, rounded if (rounded <= bound) == (merit <= bound) else merit))
    return replace(run, evaluations=[n for n, _ in kept], merits=[merit for _, merit in kept])


WAYS = 3  # solvers whose best runs are refined


def known() -> None:
    for problem in {each.name: each for stage in stages() for each in stage.problems}.values():
        ways = sorted(found_by_each(problem).items(), key=lambda way: way[1][0])[:WAYS]
        best = problem.best_known
        if ways and (best is None or ways[0][1][0] < best.value - BEATEN * abs(best.value)):
            keep_best(problem, [refined(problem, f"judged {solver}", *best) for solver, best in ways])


def found_by_each(problem: SuiteProblem) -> dict[str, tuple[float, np.ndarray]]:
    """The lowest merit of all runs of each solver, and its candidate (d,)."""
    best: dict[str, tuple[float, np.ndarray]] = {}
    for stage in stages():
        with RunStore(stage.folder / STORE) as store:
            for run, text in store.texts(stage.runs([problem])):
                result = {} if text is None else json.loads(text)
                if result and (run.solver not in best or result["cost"] < best[run.solver][0]):
                    best[run.solver] = result["cost"], np.array(result["x"])
    return best


def referee(stage: Stage, solvers: dict[str, str]) -> Referee:
    """Of the runs that are kept; on the problems alone on which all have run."""
    files = [stage.results, *([stage.results_of_variants] if stage.variants else [])]
    runs = [each for file in files for each in read_runs(file) if each.solver in solvers]
    return Referee(on_common_problems(runs))


BEST = 6  # solvers that are compared with one another


def tables() -> None:
    for stage in stages():
        judged = referee(stage, stage.solvers | stage.elsewhere)
        print(f"\n## {stage.budget:,} evaluations for each variable\n\n{len(judged.problems)} problems\n")
        print("\n".join(overall(judged)), "\n")
        print("\n".join(by_group(judged)), "\n")
        print("\n".join(pairs(judged)))
    print("\n".join(parts([(stage.budget, referee(stage, stage.variants)) for stage in stages() if stage.variants])))


def overall(judged: Referee) -> Iterator[str]:
    """Solvers, the best first: rank, targets, expected running times, runs that keep all constraints."""
    heads = ("solver", "mean rank", "joined with", "targets", "best quarter", "10 %", "1 %", "feasible", "median gap")
    yield f"| {' | '.join(heads)} |"
    yield f"|{'---|' * len(heads)}"
    for rank, of in judged.overall:
        middle = float(np.median(judged.scores[:, judged.solvers.index(of.solver)]))
        cells = [f"{rank:.1f}", judged.joined[of.solver], f"{100.0 * of.reached:.0f} %"]
        cells += [f"{time:,.0f}" if isfinite(time) else "never" for time in (of.to_quarter, *of.times[1:3])]
        cells += [f"{100.0 * of.feasible / of.runs:.0f} %", percent(middle) if middle < inf else "infeasible"]
        yield f"| {of.solver} | {' | '.join(cells)} |"


def percent(gap: float) -> str:
    """Two digits, and all before the point."""
    return f"{100.0 * gap:.2g} %" if gap < 0.995 else f"{100.0 * gap:.0f} %"


def by_group(judged: Referee) -> Iterator[str]:
    """The mean rank within each group; the least is bold."""
    groups = list(dict.fromkeys(problem.group for problem in judged.problems))
    rows = {group: [k for k, problem in enumerate(judged.problems) if problem.group == group] for group in groups}
    ranks = {group: ranks_of(judged, rows[group]) for group in groups}
    yield f"| solver | {' | '.join(f'{group} ({len(rows[group])})' for group in groups)} |"
    yield "|---|" + "---|" * len(groups)
    for solver in judged.ranking.solvers:
        cells = []
        for group in groups:
            rank = ranks[group][judged.solvers.index(solver)]
            cells.append(f"**{rank:.1f}**" if rank <= ranks[group].min() + 1e-9 else f"{rank:.1f}")
        yield f"| {solver} | {' | '.join(cells)} |"


def ranks_of(judged: Referee, rows: Sequence[int]) -> np.ndarray:
    """Mean ranks over some problems, (solvers,)."""
    found = ranking(judged.solvers, judged.scores[rows])
    return np.array([found.ranks[found.solvers.index(solver)] for solver in judged.solvers])


def pairs(judged: Referee) -> Iterator[str]:
    """On how many problems each of the best is better than the next ones, and worse; runs without a plan by group."""
    best = judged.ranking.solvers[:BEST]
    columns = {label: judged.scores[:, judged.solvers.index(label)] for label in judged.solvers}
    for number, one in enumerate(best):
        for other in best[number + 1 :]:
            better, worse = (columns[one] < columns[other]).sum(), (columns[one] > columns[other]).sum()
            p = signed_rank(columns[one], columns[other])
            yield f"* {one} is better than {other} on {better}, worse on {worse}, p {p_text(p)} uncorrected"
    for name, problems in judged.classes().items():
        ended = [(of.runs - of.feasible, of.solver) for of in (judged.tally(each, problems) for each in judged.solvers)]
        told = ", ".join(f"{solver} {count}" for count, solver in sorted(ended) if count)
        yield f"* {name} ({len(problems)}), runs that end without a feasible candidate: {told or 'none'}"


def parts(judged: Sequence[tuple[int, Referee]]) -> Iterator[str]:
    """BSO without each of its parts: on how many problems it is better, and worse; Wilcoxon's test, Holm."""
    heads = "".join(f" {budget:,}: better, worse | p | targets |" for budget, _ in judged)
    yield f"| variant |{heads}"
    yield f"|---|{'---|' * 3 * len(judged)}"
    compared = [compared_with_whole(of) for _, of in judged]
    for label in PARTS:
        yield f"| {label} | {' | '.join(cells[label] for cells in compared)} |"


def compared_with_whole(judged: Referee) -> dict[str, str]:
    """By variant of BSO its cells with one budget."""
    [whole, *others] = PARTS
    columns = {label: judged.scores[:, judged.solvers.index(label)] for label in PARTS}
    corrected = holm([signed_rank(columns[whole], columns[label]) for label in others])
    reached = {label: f"{100.0 * judged.tally(label, judged.problems).reached:.0f} %" for label in PARTS}
    found = {whole: f" | | {reached[whole]}"}
    for label, p in zip(others, corrected, strict=True):
        better, worse = (columns[label] < columns[whole]).sum(), (columns[label] > columns[whole]).sum()
        found[label] = f"{better}, {worse} | {p_text(p)} | {reached[label]}"
    return found


HIGHLIGHTED = (
    *("abso", "L-SHADE", "ARRDE (Minion)", "jSO (Minion)", "CMA-ES (cma)", "PSO", "BSO", "BSO as printed"),
    *("GA", "random search"),
)


def picture(path: str) -> None:
    """Shares of targets over evaluations with 1,000 for each variable, by all solvers and by the variants of BSO."""
    import matplotlib as mpl  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415 (slow)

    from tpbso_casadi.figures.palette import line_of  # noqa: PLC0415
    from tpbso_casadi.figures.style import RC  # noqa: PLC0415

    stage = stages()[1]
    with mpl.rc_context(RC):
        figure = Figure(figsize=(9.5, 5.2), layout="constrained")
        panels = figure.subplots(1, 2, sharey=True)
        for axes, solvers, title in zip(
            panels, (stage.solvers, PARTS), ("solvers", "BSO without one of its parts"), strict=True
        ):
            judged = referee(stage, solvers)
            named = [label for label in judged.ranking.solvers if solvers is PARTS or label in HIGHLIGHTED]
            for label in judged.solvers:
                evaluations, shares = (np.append(each, each[-1]) for each in judged.shares(label, judged.problems))
                evaluations[-1] = stage.budget
                style = line_of(named.index(label)) if label in named else {"color": "0.85"}
                legend = label if label in named else None
                axes.plot(
                    evaluations, shares, **style, drawstyle="steps-post", label=legend, zorder=2 + (label in named)
                )
            axes.set(xscale="log", xlim=(1.0, stage.budget), ylim=(0.0, None), xlabel="evaluations / variables")
            axes.set_title(f"{title}, {len(judged.problems)} problems", loc="left")
            lines = {line.get_label(): line for line in axes.get_lines()}
            axes.legend([lines[label] for label in named], named, loc="upper left")
        panels[0].set_ylabel("share of runs and targets reached")
        figure.savefig(path, dpi=140)


VARIABLES, TIMED = 30, 10_000


def overhead() -> None:
    """CPU time of a solver itself for an evaluation, us: a search whose cost function takes no time."""
    box = SearchBox(np.zeros(VARIABLES), np.ones(VARIABLES))
    for label, stated in SOLVERS.items():
        spec = parse_solver(stated)
        solver = find_solver(spec.name)(**spec.settings)  # type: ignore[arg-type]
        assert isinstance(solver, Solver)
        for evaluations in (TIMED // 10, TIMED):  # first what it loads
            began = time.process_time()
            minimize(lambda x: ((x - 0.3) ** 2).sum(axis=1), box, solver, Budget(evaluations), 1)
        print(f"| {label} | {1e6 * (time.process_time() - began) / TIMED:.1f} |", flush=True)


def report(folder: str) -> None:
    suite_command(["report", folder, "--runs", str(stages()[1].results)])


if __name__ == "__main__":
    commands = {each.__name__: each for each in (run, elsewhere, keep, known, tables, picture, overhead, report)}
    commands[sys.argv[1]](*sys.argv[2:])
