"""Runs judged, against numbers computed by hand."""

from __future__ import annotations

import re
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.judging.page import RANKS, SUITE_PAGE, SUMMARY, suite_page, suite_rows, write_suite
from tpbso_casadi.judging.referee import Referee, convergence_of
from tpbso_casadi.suite import Recording, SuiteProblem
from tpbso_casadi.suite.problem import BestKnown

SUITE = tp.suite()


class Known(SuiteProblem):
    """A problem of which a value of 2 is known, or none."""

    value: float | None = 2.0

    @property
    def best_known(self) -> BestKnown | None:  # type: ignore[override]
        if self.value is None:
            return None
        x = np.zeros(self.dimension)
        return BestKnown(
            value=self.value, x=x, certified=True, motion_value=2.0, ways={"way": (1, 1)}, descended_value=None
        )


class Unknown(Known):
    value = None


def problem(name: str = "spline-2@1", kind: type[Known] = Known) -> SuiteProblem:
    each = SUITE[name]
    return kind(each.suite, each.function, each.instance)


BOUND = problem().feasible_merit


def run(solver: str, course: list[tuple[int, float]], done: int, of: SuiteProblem, number: int = 1) -> Recording:
    evaluations, merits = [n for n, _ in course], [m for _, m in course]
    return Recording(of, solver, number, evaluations, merits, done)


def two() -> Referee:
    """One problem of 16 variables whose best value is 2; two runs of each of two solvers."""
    of = problem()
    return Referee(
        [
            run("a", [(1, BOUND + 5), (16, 4.0), (32, 2.2), (80, 2.0)], 160, of, 1),
            run("a", [(1, BOUND + 1), (48, 3.0)], 160, of, 2),
            run("b", [(1, BOUND + 2)], 320, of, 1),
            run("b", [(8, 2.02)], 160, of, 2),
        ]
    )


def test_evaluations_needed() -> None:
    first, _ = two().of(two().problems[0].name, "a")
    targets = np.array([1.5, 1.0, 0.5, 0.1, 1e-4])
    assert first.needed(2.0, targets).tolist() == [16, 16, 32, 32, 80]
    assert first.needed(inf, targets).tolist() == [inf] * 5
    assert two().needed(convergence_of(two().runs[2]), targets).tolist() == [inf] * 5


def test_expected_running_times_are_all_evaluations_over_successes() -> None:
    referee = two()
    [name] = [each.name for each in referee.problems]
    assert referee.expected_running_time("a", {name: 1.0}) == (16 + 48) / 16 / 2
    assert referee.expected_running_time("a", {name: 0.1}) == (32 + 160) / 16 / 1
    assert referee.expected_running_time("b", {name: 0.01}) == (320 + 8) / 16 / 1
    assert referee.expected_running_time("b", {name: 1e-3}) == inf


def test_a_target_is_where_the_best_quarter_of_all_runs_ends() -> None:
    (_, a), (_, b) = two().overall  # gaps of 0, 0.01, 0.5 and inf: the first of four, and no less than 0.01 %
    assert two().quarters == {two().problems[0].name: pytest.approx(1e-4)}
    assert (a.to_quarter, b.to_quarter) == ((80 + 160) / 16, inf)
    problems = [problem("spline-2@1"), problem("spline-2@2")]
    runs = [run(solver, [(4, 2.0 + gap)], 16, problems[0]) for solver, gap in (("a", 0.2), ("b", 0.4), ("c", 0.6))]
    lost = [run(solver, [(4, BOUND + 2.0)], 16, problems[1]) for solver in ("a", "b")]
    found = Referee([*runs, *lost, run("c", [(8, 3.0)], 16, problems[1])])
    assert list(found.quarters.values()) == [pytest.approx(0.1), 0.5]
    ended = [run(f"{k}", [(4, BOUND + 2.0)], 16, problems[1]) for k in range(4)]
    few = Referee([*ended, run("c", [(8, 3.0)], 16, problems[1])])
    assert list(few.quarters.values()) == [inf]
    assert few.expected_running_time("c", few.quarters) == 0.5
    assert few.expected_running_time("0", few.quarters) == inf


def test_shares_of_runs_and_targets() -> None:
    referee = two()
    evaluations, shares = referee.shares("b", referee.problems)
    assert evaluations.tolist() == [0.5]  # 8 evaluations of 16 variables
    reached = sum(target >= 0.01 * (1 - 1e-12) for target in 10.0 ** np.linspace(1.0, -4.0, 51))
    assert shares.tolist() == [reached / 102]
    assert referee.shares("nobody", referee.problems)[1].size == 0


def test_scores_ranks_and_constraints() -> None:
    referee = two()
    assert referee.scores.tolist() == [[0.25, inf]]  # medians of (0, 0.5) and of (inf, 0.01)
    assert referee.ranking.solvers == ("a", "b") and referee.ranking.ranks.tolist() == [1.0, 2.0]
    (_, a), (_, b) = referee.overall
    assert (a.solver, a.feasible, a.runs, a.first) == ("a", 2, 2, 3.0)
    assert (b.solver, b.feasible, b.runs, b.first) == ("b", 1, 2, inf)
    assert b.reached == referee.shares("b", referee.problems)[1][-1]
    assert referee.too_few == "2 solvers, where the test needs 3"


def test_gaps_within_a_hundredth_of_a_percent_are_none() -> None:
    of = problem()
    referee = Referee([run("a", [(1, 2.0002)], 2, of), run("b", [(1, 2.0001)], 2, of), run("c", [(1, 2.001)], 2, of)])
    assert referee.scores.tolist() == [[0.0, 0.0, pytest.approx(5e-4)]]
    assert referee.ranking.ranks.tolist() == [1.5, 1.5, 3.0]
    assert referee.too_few == "1 problems, where 7 are needed"


def test_where_nothing_is_known_the_best_run_is_the_reference_and_that_is_said() -> None:
    of = problem(kind=Unknown)
    referee = Referee([run("a", [(1, 5.0)], 9, of), run("b", [(1, 4.0)], 9, of)])
    assert referee.references == {of.name: 4.0} and referee.unknown == [of.name] and referee.improved == []
    assert referee.scores.tolist() == [[0.25, 0.0]]
    lost = Referee([run("a", [(1, BOUND + 5)], 9, of)])
    assert lost.references == {of.name: inf} and lost.scores.tolist() == [[inf]]
    assert "no best value is known" in suite_page(referee, [], "tpbso suite")


def test_better_than_the_best_known_is_said() -> None:
    of = problem()
    referee = Referee([run("a", [(3, 1.9)], 9, of), run("b", [(3, 2.0)], 9, of)])
    assert referee.improved == [(of.name, "a", 1.9, 2.0)]
    assert referee.references == {of.name: 1.9}
    assert referee.scores.tolist() == [[0.0, pytest.approx(0.1 / 1.9)]]  # they do not share a rank
    assert [row[3] for row in suite_rows(referee)] == ["best of these runs"] * 2
    assert "a found 1.9, better than 2, the best known" in suite_page(referee, [], "tpbso suite")
    assert not Referee([run("a", [(3, 2.0 - 1e-7)], 9, of)]).improved


def test_classes_hold_every_problem_once_of_each_kind() -> None:
    problems = [problem(name) for name in ("spline-2@1", "spline-2@2", "constrained-3@1", "spline-7@1", "star-time@1")]
    referee = Referee([run("a", [(1, 3.0)], 9, each) for each in problems])
    sizes = {name: len(of) for name, of in referee.classes().items()}
    assert sizes == {
        **{"all problems": 5, "spline": 3, "constrained": 1, "path": 1},
        **{"1 to 10 variables": 1, "11 to 30 variables": 3, "31 to 60 variables": 1},
    }


def test_the_page_says_what_was_judged(tmp_path: Path) -> None:
    problems = [problem(f"spline-2@{k}") for k in range(1, 9)]
    runs = [run(s, [(4, 2.0 + gap)], 9, p) for p in problems for s, gap in (("a", 0.0), ("b<i>", 0.2), ("c", 1.0))]
    referee = Referee(runs)
    assert referee.too_few == "" and referee.ranking.p < 0.05
    write_suite(tmp_path, referee, "tpbso suite report here")
    text = (tmp_path / SUITE_PAGE).read_text()
    assert "24 runs" in text and "tpbso suite report here" in text and text.count("<svg") == 2
    assert "b&lt;i&gt;" in text and "b<i>" not in text
    lines = (tmp_path / SUMMARY).read_text().splitlines()
    assert len(lines) == 1 + 24 and lines[2].startswith("arm-motions-1/spline-2@1,16,2.0,best known,b<i>,0.1")
    assert [of.solver for _, of in referee.overall] == ["a", "b<i>", "c"]
    assert [of.times[1] for _, of in referee.overall] == [4 / 16, 4 / 16, inf]
    named = re.findall(r'<th scope="row">([^<]+)</th><td>8</td>', text)
    assert named == [name for name in ("all problems", "spline", "11 to 30 variables") for _ in range(3)]
    assert len(suite_rows(replace(referee))) == 24


def test_unequal_budgets_are_said() -> None:
    of = problem()
    equal = Referee([run("a", [(1, 3.0)], 160, of), run("b", [(1, 4.0)], 170, of)])
    assert equal.budgets == {"a": 10.0, "b": 170 / 16} and equal.unequal == ""
    referee = Referee([run("a", [(1, 3.0)], 1600, of), run("b", [(1, 4.0)], 160, of)])
    assert referee.unequal == "10 of b, 100 of a"
    assert "ranks compare budgets too: 10 of b, 100 of a" in suite_page(referee, [], "tpbso suite")


def test_who_a_solver_is_joined_with(tmp_path: Path) -> None:
    problems = [problem(f"spline-2@{k}") for k in range(1, 16)]
    gaps = {"first": 0.0, "as good": 0.0, "behind": 0.5, "last": 1.0}
    runs = [run(s, [(1, 2.0 + g)], 9, p) for p in problems for s, g in gaps.items()]
    referee = Referee(runs)
    assert referee.joined == {"first": "", "as good": "first", "behind": "", "last": ""}
    write_suite(tmp_path, referee, "tpbso suite", pictures=False)
    lines = (tmp_path / RANKS).read_text().splitlines()
    assert lines[0].startswith("solver,mean rank,joined with,evaluations by variables,runs,targets reached,expected")
    assert [line.split(",")[:3] for line in lines[1:3]] == [["first", "1.5", ""], ["as good", "1.5", "first"]]
