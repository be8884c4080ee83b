"""The reproduction: its runs, its rules, its page."""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.browser import fetched, opened
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from rich.console import Console

from solvers import SOLVERS
from tpbso_casadi.cli import campaign
from tpbso_casadi.cli.commands import reproduce
from tpbso_casadi.judging.executors import ExecutorFactory
from tpbso_casadi.judging.run import RunRecord
from tpbso_casadi.reproduction import experiment, page_figures, scaling
from tpbso_casadi.reproduction import scaling as pace_of_searches
from tpbso_casadi.reproduction.claims import CLAIMS
from tpbso_casadi.reproduction.experiment import (
    BASES,
    EVALUATIONS,
    FIGURES,
    FULL,
    ITERATIONS,
    LOW_LAMBDA,
    LOW_LAMBDA_PRINTED_SIGN,
    PATHS,
    PRINTED,
    PRINTED_LOW_LAMBDA,
    PRINTED_SIGN,
    SPACE_ORDERS,
    TABLE_1,
    TIME_ORDERS,
    CostHistory,
    Evidence,
    Size,
    arrival,
    convergence_iteration,
    label,
)
from tpbso_casadi.reproduction.judgements import ClaimOutcome, Finding, interval
from tpbso_casadi.reproduction.page_figures import webp
from tpbso_casadi.reproduction.report import antenna_shares, compare_with_printed
from tpbso_casadi.scenario.cases import TITLES

RUNS = 20
ROUNDS = 15
HISTORIES: dict[str, CostHistory] = {"bso": [9.0, 9.0, 1.0], "pso": [9.0, 9.0, 1.3], "ga": [9.0, 9.0, 1.5]}


def pace(noise: float = 0.01, **seconds: float) -> dict[str, dict[str, dict[str, list[float]]]]:
    """Made up: each solver's time, with noise, in every round."""
    rng = np.random.default_rng(2)
    times = {"bso": 1.0, "pso": 1.2, "ga": 1.5} | seconds
    return {
        basis: {
            "time-3": {name: list(value * np.exp(noise * rng.normal(size=ROUNDS))) for name, value in times.items()}
        }
        for basis in BASES
    }


def scaling_of(orders: dict[str, Any], above: float = 0.0) -> dict[str, Any]:
    return {
        experiment: {
            symbol: {
                solver: {"sizes": [1, 2], "values": [1.0, 2.0], "exponent": power + above}
                for solver in ("bso", "pso", "ga")
            }
            for symbol, power in order.exponents.items()
        }
        for experiment, order in orders.items()
    }


def evidence(
    factors: dict[str, float] | None = None,
    infeasible: dict[str, int] | None = None,
    spread: float = 0.01,
    runs: int = RUNS,
) -> Evidence:
    """Made up: each solver's objectives lie around its factor; some of its runs have no plan."""
    rng = np.random.default_rng(1)
    factor = {"bso": 1.0, "pso": 1.2, "ga": 1.4, PRINTED_SIGN: 1.0, LOW_LAMBDA: 1.1}
    factor |= {LOW_LAMBDA_PRINTED_SIGN: 1.3, PRINTED: 1.3, PRINTED_LOW_LAMBDA: 1.5} | (factors or {})
    records = []
    for case in TITLES:
        for basis in BASES:
            for solver, middle in factor.items():
                width = spread * (1.0 if solver.startswith("bso") else 3.0)
                for seed in range(1, runs + 1):
                    feasible = seed > (infeasible or {}).get(solver, 0)
                    value = middle + width * float(rng.random())
                    name = label(solver, basis)
                    made_up = {"case": case, "solver": name, "seed": seed, "feasible": feasible, "objective": value}
                    records.append(RunRecord(**made_up, seconds=0.1, error="", unit="s", evaluations=10))
    convergence = {
        (case, basis): [(10 if case == "rotation-2" else 50, 200)] * runs for case in TITLES for basis in BASES
    }
    distances = {(case, basis): [0.02] * runs for case in PATHS for basis in BASES}
    histories = {
        (case, solver, basis): [history] * runs
        for case in TITLES
        for basis in BASES
        for solver, history in HISTORIES.items()
    }
    measured = {"time": scaling_of(TIME_ORDERS), "space": scaling_of(SPACE_ORDERS)}
    return Evidence([], records, convergence, distances, histories, measured, pace())


def finding_of(statement: str, sample: Evidence, basis: str = ITERATIONS) -> Finding:
    [claim] = [claim for claim in CLAIMS if statement in claim.statement]
    findings = claim.findings(sample)
    return findings[basis] if basis in findings else findings[""]


def outcomes(sample: Evidence) -> dict[str, ClaimOutcome]:
    return {claim.statement: finding_of(claim.statement, sample).outcome for claim in CLAIMS}


def test_a_world_in_which_the_paper_is_right() -> None:
    sample = evidence({"ga": 1.04, "pso": 1.04}, spread=0.001)
    right = [says for says, outcome in outcomes(sample).items() if outcome is ClaimOutcome.REPRODUCED]
    others = {says: outcome for says, outcome in outcomes(sample).items() if says not in right}
    assert set(others.values()) == {ClaimOutcome.NOT_TESTABLE, ClaimOutcome.NOT_REPRODUCED}
    assert [says for says in others if others[says] is ClaimOutcome.NOT_REPRODUCED] == [
        "PSO is close to TPBSO in execution time but poor in joint rotation.",
        "GA is just the opposite: close in joint rotation, poor in execution time.",
    ]  # of which one cannot hold while all cases are alike


def test_a_world_in_which_it_is_wrong() -> None:
    sample = evidence({"ga": 0.8, "pso": 0.7}, infeasible={"bso": 1}, spread=0.02)
    sample.scaling["time"] = scaling_of(TIME_ORDERS, above=0.3)
    sample.pace.update(pace(pso=0.8, ga=2.0))
    sample.distances.update({(case, basis): [0.05] * RUNS for case in PATHS for basis in BASES})
    sample = replace(sample, histories=dict.fromkeys(sample.histories, [[9.0, 9.0]] * RUNS))
    assert [says for says, outcome in outcomes(sample).items() if outcome is ClaimOutcome.REPRODUCED] == [
        claim.statement for claim in CLAIMS if re.search("variance|avoids|iterations|Memory", claim.statement)
    ]
    assert "worse in 8" in finding_of("best execution time", sample).evidence
    assert "0 of 30" in finding_of("Time grows", sample).evidence
    assert "57 of 60 runs certified" in finding_of("avoids", sample).evidence


def test_being_ahead_by_chance_is_not_enough() -> None:
    """Each mean of TPBSO is lower by a thousandth, a fiftieth of what the runs differ by."""
    records = [
        replace(record, objective=record.seed * 0.05 + 0.001 * (record.solver.partition(",")[0] in ("pso", "ga")))
        for record in evidence().records
    ]
    best = finding_of("best execution time", replace(evidence(), records=records))
    assert best == Finding(
        ClaimOutcome.NOT_REPRODUCED, "ahead in 8 of 8 comparisons; significantly better in 0, worse in 0"
    )


def test_few_runs_decide_nothing() -> None:
    few = evidence(runs=3)
    best = finding_of("best execution time", few)
    assert best.outcome is ClaimOutcome.NOT_JUDGED
    assert best.evidence.startswith("3 runs are too few; ahead in 8 of 8")
    judged = {claim.statement for claim in CLAIMS if claim.bases} - {"The numbers themselves."}
    assert {says for says, outcome in outcomes(few).items() if outcome is ClaimOutcome.NOT_JUDGED} == judged
    assert {row["conclusion"] for row in compare_with_printed(few)} == {"not judged"}


def test_one_solver_measured_once_does_not_decide_growth() -> None:
    sample = evidence()
    for symbols in sample.scaling["time"].values():
        for row in symbols.values():
            del row["ga"]
    assert finding_of("Time grows", sample).outcome is ClaimOutcome.NOT_JUDGED
    assert finding_of("Memory grows", sample).outcome is ClaimOutcome.REPRODUCED


@pytest.mark.parametrize(
    ("noise", "pso", "outcome"),
    [
        (0.02, 1.2, ClaimOutcome.REPRODUCED),
        (0.02, 0.95, ClaimOutcome.REPRODUCED),  # within the margin
        (0.02, 0.85, ClaimOutcome.NOT_REPRODUCED),
        (0.6, 0.9, ClaimOutcome.NOT_JUDGED),  # drowned in noise
    ],
)
def test_being_fast_has_a_margin_for_noise(noise: float, pso: float, outcome: ClaimOutcome) -> None:
    sample = evidence()
    sample.pace.update(pace(noise, pso=pso))
    assert finding_of("fast", sample).outcome is outcome


def test_the_interval_of_a_median_and_arriving_near_the_best_known() -> None:
    assert interval([float(value) for value in range(15)]) == (3.0, 7.0, 11.0)  # 3.5 % lie outside: binomial, n = 15
    assert interval([2.0]) == (0.0, 2.0, np.inf)
    assert arrival([9.0, 1.2, 1.1, 1.0, 1.0], 1.1) == 0.5
    assert arrival([9.0, None], 1.1) == np.inf
    assert arrival([1.0], 1.1) == 0.0
    assert convergence_iteration([9.0, 2.0, 1.005, 1.0, 1.0], objective_upper_bound=5.0) == (2, 4)
    assert convergence_iteration([9.0, None], objective_upper_bound=5.0) is None
    assert convergence_iteration([9.0, 8.0], objective_upper_bound=5.0) is None


def test_pace_is_compared_within_a_round() -> None:
    sample = evidence()
    sample.pace[ITERATIONS] = {
        "one": {"bso": [1.0, 10.0], "pso": [2.0, 20.0]},  # the machine was ten times slower in the second round
        "two": {"bso": [1.0, 1.0], "pso": [8.0, 8.0]},
    }
    assert sample.pace_ratios("pso", ITERATIONS) == pytest.approx([4.0, 4.0])


@pytest.mark.parametrize(("distance", "holds"), [(0.034, True), (0.035, False)])
def test_following_well_can_fail(distance: float, holds: bool) -> None:
    """2 % of 1.71 m, the width of the pentagram, are 34 mm."""
    sample = evidence()
    for case in ("pentagram-time", "pentagram-rotation"):
        sample.distances[case, ITERATIONS] = [0.001] * 9 + [distance] * 11
    assert (finding_of("follows", sample).outcome is ClaimOutcome.REPRODUCED) is holds


def test_speed_is_about_arriving_sooner() -> None:
    sample = evidence()
    assert finding_of("good speed", sample).evidence.startswith("significantly sooner in 30 of 30")
    histories = {key: [HISTORIES["bso"]] * RUNS for key in sample.histories}
    histories |= {key: [[1.0, 1.0]] * RUNS for key in histories if key[1] == "ga"}
    slow = finding_of("good speed", replace(sample, histories=histories))
    assert slow.outcome is ClaimOutcome.NOT_REPRODUCED
    assert slow.evidence.startswith("significantly sooner in 0 of 30 comparisons, later in 15")


def test_robustness_counts_runs_without_a_plan_first() -> None:
    assert finding_of("robustness", evidence()).outcome is ClaimOutcome.REPRODUCED
    worse = finding_of("robustness", evidence(infeasible={"bso": 2, "pso": 1}))
    assert worse.outcome is ClaimOutcome.NOT_REPRODUCED
    assert worse.evidence.startswith("runs without a plan: TPBSO 30, PSO 15, GA 0")
    assert finding_of("robustness", evidence(infeasible={"pso": 1, "ga": 1})).outcome is ClaimOutcome.REPRODUCED


def test_a_run_without_a_plan_weighs_more_than_the_mean() -> None:
    sample = evidence(infeasible={"bso": 2})
    assert finding_of("best execution time", sample).outcome is ClaimOutcome.NOT_REPRODUCED
    assert finding_of("converge well", sample).evidence.startswith("16 runs without a plan")


def test_the_algorithm_as_printed() -> None:
    rows = compare_with_printed(evidence())
    assert [(row["lambda_"], row["basis"], row["conclusion"]) for row in rows] == [
        (0.95, ITERATIONS, "no difference shown"),
        (0.95, EVALUATIONS, "no difference shown"),
        (0.4, EVALUATIONS, "ours is better"),
        (0.95, ITERATIONS, "ours is better"),
        (0.95, EVALUATIONS, "ours is better"),
        (0.4, EVALUATIONS, "ours is better"),
    ]
    assert [rows[2][key] for key in ("ahead", "behind", "better", "worse", "a12")] == [15, 0, 15, 0, 1.0]
    reverse = compare_with_printed(evidence({LOW_LAMBDA_PRINTED_SIGN: 0.9}))
    assert reverse[2]["conclusion"] == "as printed is better"


def test_the_share_of_the_antennae() -> None:
    """First: 0.05 * 2 / (0.95 + 0.05 * 2), and 0.6 * 2 / (0.4 + 0.6 * 2)."""
    ours, low = antenna_shares()
    assert (ours["first"], low["first"]) == (pytest.approx(0.1 / 1.05), pytest.approx(0.75))
    delta = 2.0 * 0.95**50
    assert ours["later"] == pytest.approx(0.05 * delta / (0.95 + 0.05 * delta))
    assert (round(ours["mean"], 3), round(low["mean"], 3)) == (0.01, 0.137)


def test_what_the_paper_prints() -> None:
    assert dict(zip(TITLES, range(2, 17), strict=True)) == FIGURES
    assert sum(len(case) for case in TABLE_1.values()) == 12
    assert TABLE_1["closed-curve-time"]["bso"].std == 0.0043
    rotation = TABLE_1["closed-curve-rotation"]
    assert rotation["bso"].std > rotation["ga"].std > rotation["pso"].std  # against the paper's own words


def test_the_runs_of_the_full_reproduction() -> None:
    runs = experiment.campaign(replace(FULL, runs=2))
    assert len(runs) == len({run.key for run in runs}) == 15 * 17 * 2
    assert FULL.runs == 20
    budgets = {run.solver: run.scenario.solver for run in runs}
    for solver in ("bso", PRINTED_SIGN, PRINTED, PRINTED_LOW_LAMBDA, "pso", "ga"):
        fair, paper = budgets[label(solver, EVALUATIONS)], budgets[label(solver, ITERATIONS)]
        assert (fair.evaluations, fair.iterations) == (30_000, None)
        assert (paper.evaluations, paper.iterations, paper.population) == (None, 200, 50)
    assert budgets[label(PRINTED_SIGN, ITERATIONS)].settings == {"antenna_sign": "printed"}
    printed = {"inertia_first": 1.0, "inertia_last": 1.0, "antenna_sign": "printed"}
    assert budgets[label(PRINTED, EVALUATIONS)].settings == printed
    assert budgets[label(PRINTED_LOW_LAMBDA, ITERATIONS)].settings == {**printed, "lambda_": 0.4}
    assert budgets[label("bso+polish", EVALUATIONS)].polish_starts == 1
    assert budgets[label("ipopt", EVALUATIONS)].budget().iterations == 20


@settings(max_examples=30)
@given(st.floats(0.2, 2.0), st.floats(0.1, 50.0), st.floats(0.01, 10.0))
def test_exponents_of_growth(power: float, fixed: float, scale: float) -> None:
    sizes = (10.0, 40.0, 160.0)
    values = [scale * size**power for size in sizes]
    assert scaling.exponent(sizes, values) == pytest.approx(power)
    assert scaling.exponent_above(sizes, [fixed + value for value in values]) == pytest.approx(power, abs=1e-6)
    assert scaling.exponent_above(sizes, [fixed] * 3) == 0.0


WHOLE = pytest.mark.process  # some seconds of processor time
TINY = Size(runs=1, iterations=2, population=6, evaluations=40, extensions=False)


class InThisProcess(Executor):
    """Does what is submitted at once: a worker would import everything first."""

    def submit(self, call: Callable[..., Any], /, *arguments: Any, **keys: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(call(*arguments, **keys))
        return future


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole reproduction, with the smallest runs there are, and one picture for all."""
    folder = tmp_path_factory.mktemp("reproduction")
    sizes = {"n_i": (2, 4, 8), "n_p": (20, 40, 80), "n_d": (6, 10, 14), "n_o": (5, 10, 15)}
    drawn = list[bytes]()

    def drawn_once(figure: Figure) -> bytes:
        drawn.append(drawn[0] if drawn else webp(figure))
        return drawn[-1]

    few = {experiment: {symbol: sizes[symbol] for symbol in row} for experiment, row in scaling.TIME_SIZES.items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TPBSO_CASADI_BACKEND", "vm")
        patch.setattr(reproduce, "QUICK", TINY)
        patch.setattr(pace_of_searches, "PACE_CASES", ("time-3",))
        patch.setattr(scaling, "TIME_SIZES", few)
        patch.setattr(page_figures, "webp", drawn_once)
        here = ExecutorFactory(InThisProcess, InThisProcess, 1)
        patch.setattr(campaign, "processes", lambda workers, backend=None: replace(here, backend=backend))
        assert reproduce.main(["--quick", "--quiet", "--out", str(folder), "--table", str(folder / "runs.csv")]) == 0
    return folder


@WHOLE
def test_every_player_of_the_page_runs(folder: Path, tmp_path: Path) -> None:
    assert opened(folder / "report.html", tmp_path / "profile").count(" s</output>") == 15


@WHOLE
def test_the_page_holds_everything(folder: Path) -> None:
    text = (folder / "report.html").read_text()
    assert fetched(text) == []
    for number in range(2, 17):
        assert f"Fig. {number}: " in text
    assert text.count('<canvas class="scene"') == 15
    assert text.count('src="data:image/webp') == 11 * 3 + 4 * 4 + 1 + 1
    assert "the same objective to the last bit" in text
    assert "ANOTHER OBJECTIVE" not in text
    for stated in (*(claim.where for claim in CLAIMS), "0.7139", "24.1952", "O(n_i n_p n_d n_o)"):
        assert stated in text
    assert "A quick look, not evidence" in text


@WHOLE
def test_a_quick_page_judges_nothing(folder: Path) -> None:
    text = (folder / "report.html").read_text()
    assert set(re.findall(r'<span class="([a-z-]+)">', text)) == {"not-judged", "not-testable"}
    assert text.count('<span class="not-judged">') == 2 * (len(CLAIMS) - 3) + 2  # but Table 1, and growth only once
    cells = re.findall(r'<td class="([a-z-]+)">[^<]+<br><small>A12', text)
    assert set(cells) == {"not-judged"} and len(cells) == 15 * 5 * 2
    assert "not shown to differ" not in text and "no difference shown" not in text


@WHOLE
def test_the_page_states_every_parameter(folder: Path) -> None:
    text = (folder / "report.html").read_text()
    section = text[text.index('id="parameters"') : text.index("<h2>Figures 2 to 16")]
    named = {field.name for solver in ("bso", "pso", "ga") for field in fields(SOLVERS[solver]())}  # type: ignore[arg-type]
    for stated in (
        *(f"<tr><td>{name}</td>" for name in (*named, *TITLES)),
        "max speed 4, max acceleration 20",
        "center (0.8, 0.8), semi axes (0.15, 0.25)",
        "radius 0.9",
        "waves 6",
        "<tr><td>joint speed</td><td>(11), (16)</td><td>(21), (16)</td></tr>",
        "inertia weight w that falls linearly from 0.9 to 0.4",
    ):
        assert stated in section
    chart = text[text.index('<svg class="flowchart"') : text.index("</svg>")]
    lines = ["line 1", "(15) or (25)", "(27)", "(29)-(31)", "(28)", "(26)", "(15) or (25)", "(32)", "(3)-(7)"]
    assert re.findall(r'class="equation">([^<]*)<', chart)[1:] == lines  # it goes through Algorithm 1


def test_claims_are_printed_in_80_columns(capsys: pytest.CaptureFixture[str]) -> None:
    reproduce.print_claims(evidence(), Console(file=sys.stdout, width=80))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert not any(line.lstrip().startswith("%") for line in lines)
    assert sum("not testable" in line for line in lines) == 2


@WHOLE
def test_every_anchor_leads_somewhere_and_tables_are_complete(folder: Path) -> None:
    text = (folder / "report.html").read_text()
    identifiers = re.findall(r'id="([^"]+)"', text)
    assert len(identifiers) == len(set(identifiers))
    assert set(re.findall(r'href="#([^"]+)"', text)) <= set(identifiers)
    assert all(re.search(r'alt="[^"]+"', image) for image in re.findall(r"<img[^>]+>", text))
    tables = ((folder / f"{name}.csv").read_text().splitlines() for name in ("summary", "runs"))
    summary, runs = (list(csv.DictReader(lines)) for lines in tables)
    assert len(summary) == len(runs) == 15 * 12
    assert {row["runs"] for row in summary} == {"1"}
