"""The reproduction: its runs, its rules, its page."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.browser import fetched, opened
from hypothesis import given
from hypothesis import strategies as st

from tpbso_casadi.campaign import Record
from tpbso_casadi.cli import reproduce
from tpbso_casadi.reproduction import experiment, scaling
from tpbso_casadi.reproduction.antenna_sign import compare_signs
from tpbso_casadi.reproduction.claims import CLAIMS
from tpbso_casadi.reproduction.evidence import Evidence, convergence_iteration
from tpbso_casadi.reproduction.experiment import (
    BASES,
    EVALUATIONS,
    FULL,
    ITERATIONS,
    LOW_LAMBDA,
    LOW_LAMBDA_PRINTED_SIGN,
    PRINTED_SIGN,
    Size,
    label,
)
from tpbso_casadi.reproduction.paper import FIGURES, PATHS, SPACE_ORDERS, TABLE_1, TIME_ORDERS
from tpbso_casadi.reproduction.rules import ClaimOutcome, Finding, smallest_p
from tpbso_casadi.scenario.builtin import TITLES

RUNS = 20
PACE = {basis: {"bso": 1.0, "pso": 1.2, "ga": 1.5} for basis in BASES}


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
    factor = {"bso": 1.0, "pso": 1.2, "ga": 1.4, PRINTED_SIGN: 1.0, LOW_LAMBDA: 1.1, LOW_LAMBDA_PRINTED_SIGN: 1.3} | (
        factors or {}
    )
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
                    records.append(Record(**made_up, seconds=0.1, error="", unit="s", evaluations=10))
    convergence = {
        (case, basis): [(10 if case == "rotation-2" else 50, 200)] * runs for case in TITLES for basis in BASES
    }
    accuracy = {(case, basis): 0.05 for case in PATHS for basis in BASES}
    measured = {"time": scaling_of(TIME_ORDERS), "space": scaling_of(SPACE_ORDERS), "pace": PACE}
    return Evidence([], records, convergence, accuracy, measured)


def finding_of(statement: str, sample: Evidence, basis: str = ITERATIONS) -> Finding:
    [claim] = [claim for claim in CLAIMS if statement in claim.statement]
    findings = claim.findings(sample)
    return findings[basis] if basis in findings else findings[""]


def outcomes(sample: Evidence) -> dict[str, ClaimOutcome]:
    return {
        claim.statement: claim.findings(sample).get(ITERATIONS, claim.findings(sample).get("")).outcome
        for claim in CLAIMS
    }  # type: ignore[union-attr]


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
    sample.scaling["pace"] = {basis: {"bso": 1.0, "pso": 0.9, "ga": 2.0} for basis in BASES}
    assert [says for says, outcome in outcomes(sample).items() if outcome is ClaimOutcome.REPRODUCED] == [
        claim.statement for claim in CLAIMS if re.search("variance|avoids|iterations|Memory", claim.statement)
    ]
    assert "worse in 8" in finding_of("best execution time", sample).evidence
    assert "0 of 30" in finding_of("Time grows", sample).evidence
    assert "57 of 60 runs certified" in finding_of("avoids", sample).evidence


def test_being_ahead_by_chance_is_not_enough() -> None:
    sample = evidence({"pso": 1.0001, "ga": 1.0001}, spread=0.05)
    best = finding_of("best execution time", sample)
    assert best.outcome is ClaimOutcome.NOT_REPRODUCED or "significantly better in 8" in best.evidence


def test_few_runs_decide_nothing() -> None:
    best = finding_of("best execution time", evidence(runs=3))
    assert best.outcome is ClaimOutcome.NOT_TESTABLE
    assert best.evidence.startswith("3 runs are too few for any test; ahead in 8 of 8")
    assert smallest_p(3) == pytest.approx(0.1)


def test_a_run_without_a_plan_weighs_more_than_the_mean() -> None:
    sample = evidence(infeasible={"bso": 2})
    assert finding_of("best execution time", sample).outcome is ClaimOutcome.NOT_REPRODUCED
    assert finding_of("converge well", sample).evidence.startswith("16 runs without a plan")


def test_the_sign_of_28() -> None:
    rows = compare_signs(evidence())
    assert [(row.basis, row.conclusion) for row in rows] == [
        (ITERATIONS, "no significant difference"),
        (EVALUATIONS, "no significant difference"),
        (EVALUATIONS, "descending is better"),
    ]
    assert (rows[2].ahead, rows[2].behind, rows[2].better, rows[2].worse) == (15, 0, 15, 0)
    assert [row.conclusion for row in compare_signs(evidence({LOW_LAMBDA_PRINTED_SIGN: 0.9}))][
        2
    ] == "the printed sign is better"


def test_when_a_search_has_converged() -> None:
    assert convergence_iteration([9.0, 2.0, 1.005, 1.0, 1.0], objective_upper_bound=5.0) == (2, 4)
    assert convergence_iteration([9.0, None], objective_upper_bound=5.0) is None
    assert convergence_iteration([9.0, 8.0], objective_upper_bound=5.0) is None


def test_what_the_paper_prints() -> None:
    assert dict(zip(TITLES, range(2, 17), strict=True)) == FIGURES
    assert sum(len(case) for case in TABLE_1.values()) == 12
    assert TABLE_1["closed-curve-time"]["bso"].std == 0.0043
    rotation = TABLE_1["closed-curve-rotation"]
    assert rotation["bso"].std > rotation["ga"].std > rotation["pso"].std  # against the paper's own words


def test_the_runs_of_the_full_reproduction() -> None:
    runs = experiment.campaign(FULL)
    assert len(runs) == len({run.key for run in runs}) == 15 * 13 * 20
    budgets = {run.solver: run.scenario.solver for run in runs}
    for solver in ("bso", PRINTED_SIGN, "pso", "ga"):
        fair, paper = budgets[label(solver, EVALUATIONS)], budgets[label(solver, ITERATIONS)]
        assert (fair.evaluations, fair.iterations) == (30_000, None)
        assert (paper.evaluations, paper.iterations, paper.population) == (None, 200, 50)
    assert budgets[label(PRINTED_SIGN, ITERATIONS)].settings == {"antenna_sign": "printed"}
    assert budgets[label("bso+polish", EVALUATIONS)].polish_starts == 1
    assert budgets[label("ipopt", EVALUATIONS)].budget().iterations == 20


@given(st.floats(0.2, 2.0), st.floats(0.1, 50.0), st.floats(0.01, 10.0))
def test_exponents_of_growth(power: float, fixed: float, scale: float) -> None:
    sizes = (10.0, 40.0, 160.0)
    values = [scale * size**power for size in sizes]
    assert scaling.exponent(sizes, values) == pytest.approx(power)
    assert scaling.exponent_above(sizes, [fixed + value for value in values]) == pytest.approx(power, abs=1e-6)
    assert scaling.exponent_above(sizes, [fixed] * 3) == 0.0


TINY = Size(runs=1, iterations=2, population=6, evaluations=40, extensions=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole reproduction, with the smallest runs there are."""
    folder = tmp_path_factory.mktemp("reproduction")
    sizes = {"n_i": (2, 4, 8), "n_p": (20, 40, 80), "n_d": (6, 10, 14), "n_o": (10, 20, 40)}
    few = {experiment: {symbol: sizes[symbol] for symbol in row} for experiment, row in scaling.TIME_SIZES.items()}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TPBSO_CASADI_BACKEND", "vm")
        patch.setattr(reproduce, "QUICK", TINY)
        patch.setattr(scaling, "TIME_SIZES", few)
        assert reproduce.main(["--quick", "--quiet", "--out", str(folder), "--export", str(folder / "runs.csv")]) == 0
    return folder


def test_the_page_holds_everything(folder: Path, tmp_path: Path) -> None:
    text = (folder / "report.html").read_text()
    assert fetched(text) == []
    document = opened(folder / "report.html", tmp_path / "profile")
    for number in range(2, 17):
        assert f"Fig. {number}: " in document
    assert document.count("<canvas") == 15
    assert document.count(" s</output>") == 15  # every player ran
    assert document.count('src="data:image/webp') == 11 * 3 + 4 * 4 + 1 + 1
    assert "the same objective to the last bit" in document
    assert "ANOTHER OBJECTIVE" not in document
    for claim in CLAIMS:
        assert claim.where in document
    assert (
        len(re.findall(r'class="(?:not-)?(?:reproduced|testable)">(?:not )?(?:reproduced|testable)<', document)) == 28
    )
    for printed in ("0.7139", "24.1952", "O(n_i n_p n_d n_o)"):
        assert printed in document
    assert "A quick look, not evidence" in document


def test_every_anchor_leads_somewhere(folder: Path) -> None:
    text = (folder / "report.html").read_text()
    identifiers = re.findall(r'id="([^"]+)"', text)
    assert len(identifiers) == len(set(identifiers))
    assert set(re.findall(r'href="#([^"]+)"', text)) <= set(identifiers)
    assert all(re.search(r'alt="[^"]+"', image) for image in re.findall(r"<img[^>]+>", text))


def test_its_tables_for_programs(folder: Path) -> None:
    with (folder / "summary.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 15 * 8
    assert {row["runs"] for row in rows} == {"1"}
    with (folder / "runs.csv").open(newline="") as file:
        assert len(list(csv.DictReader(file))) == 15 * 8


@pytest.mark.slow
def test_the_quick_reproduction(tmp_path: Path) -> None:
    assert reproduce.main(["--quick", "--quiet", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "report.html").stat().st_size > 1_000_000
