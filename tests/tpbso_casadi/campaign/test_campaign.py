"""Campaigns: every run once, whatever happens to workers; the same numbers whoever does them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.waiting import wait_until
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from scipy.stats import false_discovery_control

from tpbso_casadi import builtin
from tpbso_casadi.campaign import (
    ExecutorFactory,
    LostExecutor,
    Outcome,
    Record,
    Relation,
    Run,
    SolverSpec,
    Store,
    campaign_seconds,
    compare_summaries,
    grid,
    judge,
    p_text,
    parse_solver,
    parse_solvers,
    print_tables,
    processes,
    run_campaign,
    summarise,
)
from tpbso_casadi.campaign.runner import run_seconds
from tpbso_casadi.campaign.statistics import holm, with_ties
from tpbso_casadi.cli.progress import State, duration
from tpbso_casadi.scenario import ScenarioError

LIMIT = {"evaluations": 100}


def runs_of(solvers: str, seeds: Sequence[int] = range(1, 5), case: str = "time-2") -> list[Run]:
    specs = [SolverSpec(s.label, s.name, s.settings, s.polish_starts, LIMIT) for s in parse_solvers(solvers)]
    return grid({case: builtin(case)}, specs, seeds)


def threads(workers: int = 2) -> ExecutorFactory:
    return ExecutorFactory(lambda: ThreadPoolExecutor(workers), lambda: ThreadPoolExecutor(1), 2 * workers)


def test_any_executor_gives_the_same_records(tmp_path: Path) -> None:
    runs = runs_of("bso,pso+polish")
    tables = []
    for name, executors in (("threads", threads()), ("one", processes(1)), ("two", processes(2))):
        with Store(tmp_path / name) as store:
            run_campaign(runs, store, executors)
            results = [store.result(run) for run in runs]
        tables.append([result.model_dump(exclude={"seconds": True, "polish": {"seconds"}}) for result in results])
    assert tables[0] == tables[1] == tables[2]


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    runs = runs_of("bso")
    outcomes: list[Outcome] = []
    with Store(tmp_path / "store") as store:
        run_campaign(runs[:3], store, threads(), progress=outcomes.append)
        run_campaign(runs, store, threads(), progress=outcomes.append)
        run_campaign([*runs, *runs], store, threads(), progress=outcomes.append)
        assert len(outcomes) == len(runs) == len(store.records(runs))


def test_a_run_that_raises_is_kept_as_failed_and_the_rest_goes_on(tmp_path: Path) -> None:
    runs = runs_of("helpers.campaign:Raises,bso", range(1, 9))
    with Store(tmp_path / "store") as store:
        run_campaign(runs, store, threads())
        records = store.records(runs)
        failed = [record for record in records if record.error]
        assert len(records) == len(runs)
        assert 0 < len(failed) < 8
        assert {record.error for record in failed} == {"ArithmeticError: this one fails"}
        outcomes: list[Outcome] = []
        run_campaign(runs, store, threads(), progress=outcomes.append)
        assert not outcomes
        run_campaign(runs, store, threads(), retry_failed=True, progress=outcomes.append)
        assert len(outcomes) == len(failed)


@pytest.mark.slow
def test_a_run_that_kills_its_worker_is_found_and_the_rest_goes_on(tmp_path: Path) -> None:
    runs = runs_of("bso,helpers.campaign:Kills", (1, 2))
    with Store(tmp_path / "store") as store:
        run_campaign(runs, store, processes(2))
        records = store.records(runs)
    assert [bool(record.error) for record in records] == [False, True, False, True]
    assert records[1].error == "WorkerDied: 2 times in a row while nothing else ran"


@pytest.mark.slow
def test_a_run_whose_worker_died_once_is_done_again(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    runs = runs_of(f"bso,helpers.campaign:Kills(mark={mark})", (1, 2))
    with Store(tmp_path / "store") as store:
        run_campaign(runs, store, processes(2))
        assert [record.error for record in store.records(runs)] == [""] * 4
    assert mark.exists()


class Cancels(ThreadPoolExecutor):
    """An executor whose scheduler goes away."""

    def submit(self, *_: object, **__: object) -> Future[object]:  # type: ignore[override]
        future: Future[object] = Future()
        future.cancel()
        future.set_running_or_notify_cancel()
        return future


class Refuses(ThreadPoolExecutor):
    """An executor to which nothing connects any more."""

    def submit(self, *_: object, **__: object) -> Future[object]:  # type: ignore[override]
        future: Future[object] = Future()
        future.set_exception(ConnectionResetError("closed"))
        return future


@pytest.mark.parametrize("kind", [Cancels, Refuses])
def test_an_executor_that_is_gone_is_said_in_one_line(kind: type[ThreadPoolExecutor], tmp_path: Path) -> None:
    def gone() -> Executor:
        return kind(1)

    with (
        Store(tmp_path / "store") as store,
        pytest.raises(LostExecutor, match="the workers are gone; completed runs are stored"),
    ):
        run_campaign(runs_of("bso"), store, ExecutorFactory(gone, gone, 2))


def test_ctrl_c_keeps_what_was_begun(tmp_path: Path) -> None:
    runs = runs_of("bso", range(1, 20))

    def interrupt(_: Outcome) -> None:
        if not interrupted:
            interrupted.append(1)
            raise KeyboardInterrupt

    interrupted: list[int] = []
    with Store(tmp_path / "store") as store:
        with pytest.raises(KeyboardInterrupt):
            run_campaign(runs, store, threads(), progress=interrupt)
        kept = store.records(runs)
        assert 1 <= len(kept) < len(runs)
        assert not any(record.error for record in kept)
        run_campaign(runs, store, threads())
        assert len(store.records(runs)) == len(runs)


@pytest.mark.skipif(not Path("/proc").exists(), reason="looks for processes in /proc")
def test_ctrl_c_waits_a_moment_only_for_runs_that_have_begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.campaign.runner.GRACE_SECONDS", 0.0)
    mark = tmp_path / "mark"
    runs = runs_of(f"helpers.campaign:Endless(mark={mark})", (1,)) + runs_of("bso", (1,))

    def interrupt(_: Outcome) -> None:
        wait_until(lambda: mark.exists() and mark.read_text())
        raise KeyboardInterrupt

    with Store(tmp_path / "store") as store:
        with pytest.raises(KeyboardInterrupt):
            run_campaign(runs, store, processes(2), progress=interrupt)
        assert [record.solver for record in store.records(runs)] == ["bso"]
    wait_until(lambda: not Path(f"/proc/{mark.read_text()}").exists())  # the worker is dead


def test_a_run_that_exits_has_failed(tmp_path: Path) -> None:
    runs = runs_of("bso,helpers.campaign:Exits", (1,))
    for name, executors in (("threads", threads()), ("processes", processes(1))):
        with Store(tmp_path / name) as store:
            run_campaign(runs, store, executors)
            assert [record.error for record in store.records(runs)] == ["", "SystemExit: 0"]


class Raised(ThreadPoolExecutor):
    """An executor whose runs end with what a plug-in can raise."""

    error: BaseException

    def submit(self, *_: object, **__: object) -> Future[object]:  # type: ignore[override]
        future: Future[object] = Future()
        future.set_exception(self.error)
        return future


class Unspeakable(Exception):
    def __str__(self) -> str:
        raise ValueError


@pytest.mark.parametrize(
    ("error", "expected"),
    [
        (SystemExit(3), "SystemExit: 3"),
        (KeyboardInterrupt(), "KeyboardInterrupt: "),
        (ValueError("\x1b[2J\udc80\nend"), "ValueError: \\x1b[2J\\udc80 end"),
        (Unspeakable(), "Unspeakable: (its message cannot be read)"),
        (ValueError("x" * 10_000), f"ValueError: {'x' * 285}..."),
    ],
)
def test_whatever_is_raised_is_a_failed_run(error: BaseException, expected: str, tmp_path: Path) -> None:
    def executor() -> Executor:
        raised = Raised(1)
        raised.error = error
        return raised

    runs = runs_of("bso", (1,))
    with Store(tmp_path / "store") as store:
        run_campaign(runs, store, ExecutorFactory(executor, executor, 1))
        [record] = store.records(runs)
    assert record.error == expected.strip()


class Silent(ThreadPoolExecutor):
    """An executor from which nothing comes back."""

    def submit(self, *_: object, **__: object) -> Future[object]:  # type: ignore[override]
        return Future()


def test_workers_that_are_gone_are_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.campaign.runner.CHECK_SECONDS", 0.01)
    looks = []

    def check() -> None:
        looks.append(1)
        if len(looks) == 3:
            raise LostExecutor("no workers")

    def silent() -> Executor:
        return Silent(1)

    with Store(tmp_path / "store") as store, pytest.raises(LostExecutor, match="no workers"):
        run_campaign(runs_of("bso"), store, ExecutorFactory(silent, silent, 2, check=check))
    assert len(looks) == 3


def test_labels_are_printable() -> None:
    [run] = grid({"a\x1b[31m\udcff": builtin("time-2")}, parse_solvers("bso"), (1,))
    assert run.case == "a\\x1b[31m\\udcff"


def test_estimates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.campaign.runner.candidate_seconds", lambda scenario, backend: 1e-4 - 5e-6)
    tables = {
        "bso": {"evaluations": 20_000},  # 2 s
        "pso": {"population": 10, "iterations": 100},  # 3,000 candidates at most
        "ga": {"evaluations": 10**9, "time_limit": 7.0},
        "abso": {"within": 9.0},
        "bso+polish3": {"evaluations": 1000, "settings": {"c1": 1.0}},  # 1,000 candidates and 3 descents
        "ipopt": {"iterations": 2},
    }
    seconds = {}
    for name, table in tables.items():
        spec = replace(parse_solver(name), table=table)
        [run] = grid({"time-2": builtin("time-2")}, [spec], (1,))
        seconds[name] = run_seconds(run)
    descent = 4_000 * (1e-4 - 5e-6)
    expected = {"bso": 2.0, "pso": 0.3, "ga": 7.0, "abso": 9.0, "bso+polish3": 0.1 + 3 * descent, "ipopt": 2 * descent}
    assert seconds == pytest.approx(expected)
    assert campaign_seconds([run] * 10, 4) == pytest.approx(20 * descent / 4)
    assert campaign_seconds([run], 4) == pytest.approx(2 * descent)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.01, "1 s"),
        (90.0, "90 s"),
        (150.0, "2.5 min"),
        (7300.0, "2 h"),
        (86_400 * 30, "30 days"),
        (1e12, "3.17e+04 years"),
    ],
)
def test_durations(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_how_far_a_campaign_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.cli.progress.time.perf_counter", clock := iter([0.0, *[30.0] * 9]).__next__)
    state = State(runs=10, round_size=2, estimate=100.0)
    assert state.left() == 100.0
    state.advance(Outcome("{}", 1.0))
    assert state.left() == 90.0  # one solver has been seen, not the other
    state.advance(Outcome(None, 1.0, "ValueError: no"))
    assert state.line() == "2 of 10 runs after 30 s, 1 failed, about 2 min left"
    assert clock() == 30.0


def test_the_grid_is_a_fair_sample_at_any_time() -> None:
    specs = parse_solvers("bso,pso")
    runs = grid({case: builtin(case) for case in ("time-2", "rotation-2")}, specs, (3, 4))
    labels = [(run.seed, run.case, run.solver) for run in runs]
    assert labels[:4] == [(3, case, solver) for case in ("time-2", "rotation-2") for solver in ("bso", "pso")]
    assert len({run.key for run in runs}) == 8


def test_solvers_are_read() -> None:
    text = "bso, bso(lambda_=0.4,antenna_sign=printed)+polish3, ipopt(max_iterations=50),a.b:C+polish"
    specs = parse_solvers(f"{text},bso(printed,inertia_last=0.9)")
    assert [(s.name, dict(s.settings), s.polish_starts) for s in specs] == [
        ("bso", {}, 0),
        ("bso", {"lambda_": 0.4, "antenna_sign": "printed"}, 3),
        ("ipopt", {"max_iterations": 50}, 0),
        ("a.b:C", {}, 1),
        ("bso", {"inertia_first": 1.0, "inertia_last": 0.9, "antenna_sign": "printed"}, 0),
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("bso,,pso", "solvers: '' is not NAME"),
        ("bso(lambda_)", "solvers: 'bso(lambda_)': 'lambda_' is not setting=value"),
        ("pso(printed)", "solvers: 'pso(printed)': 'printed' is not setting=value"),
        ("a.b:C(printed)", "solvers: 'a.b:C(printed)': 'printed' is not setting=value"),
        ("bso(a=1", "solvers: 'bso(a=1' is not NAME"),
        ("bso+polished", "solvers: 'bso+polished' is not NAME"),
        ("pso,bso,pso", "solvers: pso is there twice"),
    ],
)
def test_solvers_that_cannot_be_read(text: str, expected: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse_solvers(text)
    assert str(caught.value).startswith(expected)


def test_a_scenarios_own_solver_table_counts_for_its_solver_alone() -> None:
    scenario = builtin("time-2")
    table = scenario.solver.model_copy(update={"population": 12, "settings": {"c1": 1.0}, "evaluations": 77})
    scenario = scenario.model_copy(update={"solver": table})
    own, other, descent = (parse_solver(name).applied(scenario, 5).solver for name in ("bso", "pso", "ipopt"))
    assert (own.population, own.settings, own.evaluations, own.seed) == (12, {"c1": 1.0}, 77, 5)
    assert (other.population, other.settings, other.evaluations) == (None, {}, 77)
    assert (descent.population, descent.settings) == (None, {})
    every = {"population": 9, "iterations": 4}
    swarm, descent = (replace(parse_solver(name), table=every).applied(scenario, 5).solver for name in ("bso", "ipopt"))
    assert (swarm.population, swarm.iterations, descent.population, descent.iterations) == (9, 4, None, 4)


def record(solver: str, objective: float | None, error: str = "") -> Record:
    return Record(
        case="case",
        solver=solver,
        seed=1,
        seconds=0.1,
        error=error,
        feasible=objective is not None,
        objective=objective,
        unit="s",
        cost=objective,
        evaluations=10,
        iterations=2,
        stop_reason="evaluations",
    )


def test_summaries_by_hand() -> None:
    records = [record("a", 1.0), record("a", 3.0), record("a", None), record("b", 2.0), record("a", None, "E: x")]
    a, b = summarise(records)
    assert (a.solver, a.mean, a.std, a.best, a.infeasible, a.failed) == ("a", 2.0, np.sqrt(2.0), 1.0, 1, 1)
    assert a.median == 3.0
    assert np.isnan(b.std)
    assert b.rank_key < a.rank_key  # one infeasible run weighs more than any mean
    [nothing] = summarise([record("c", None)])
    assert np.isnan(nothing.mean) and nothing.median == np.inf


def test_comparisons_by_hand() -> None:
    a, b = summarise([*(record("a", value) for value in (1, 2, 3)), *(record("b", value) for value in (2, 5, None))])
    pair = compare_summaries(a, b)
    assert pair.a12 == (3 + 2.5 + 2) / 9.0  # of the nine pairs
    assert pair.ahead and pair.p == pytest.approx(0.3) and pair.smallest_p == 0.1  # twice 3 of 20 partitions
    assert compare_summaries(b, a).a12 == pytest.approx(1.0 - pair.a12)
    same = summarise([record("a", 1.0), record("a", 1.00001), record("b", 1.00005), record("b", 1.0)])
    assert compare_summaries(*same).p == 1.0


def test_what_a_family_of_comparisons_shows() -> None:
    low, high, same = (
        [record(name, start + seed / 100.0) for seed in range(10)]
        for name, start in (("low", 1.0), ("high", 2.0), ("same", 1.0))
    )
    first, second, third = summarise([*low, *high, *same])
    pairs = [compare_summaries(first, second), compare_summaries(second, first), compare_summaries(first, third)]
    judged = judge(pairs)
    assert [one.relation for one in judged] == [Relation.BETTER, Relation.WORSE, Relation.NOT_SHOWN]
    assert [str(one.relation) for one in judged] == ["better", "worse", "no difference shown"]
    assert [p_text(one.p) for one in judged] == ["< 0.001", "< 0.001", "1.000"]


@pytest.mark.parametrize(("runs", "relation"), [(3, Relation.NOT_JUDGED), (4, Relation.BETTER)])
def test_three_runs_show_nothing_not_even_with_ties(runs: int, relation: Relation) -> None:
    """2 / C(6, 3) = 0.1, 2 / C(8, 4) = 0.029: the approximation for large samples gives 0.05 and less."""
    a, b = summarise([record(name, value) for name, value in (("a", 1.0), ("b", 2.0)) for _ in range(runs)])
    pair = compare_summaries(a, b)
    assert pair.p == pytest.approx(pair.smallest_p)
    [one] = judge([pair])
    assert one.relation is relation


def test_a_table_fits_80_columns_whatever_the_labels(capsys: pytest.CaptureFixture[str]) -> None:
    labels = ("bso", "bso(lambda_=0.4,antenna_sign=printed)+polish12", "pso+polish", "bso(printed,lambda_=0.4)")
    records = [
        replace(record(label, 123456.7 + seed + 0.001 * index), evaluations=1_000_000, seconds=1234.5)
        for index, label in enumerate(labels)
        for seed in range(20)
    ]
    for columns in (80, 20):
        print_tables(summarise(records), Console(file=sys.stdout, width=columns))
        text = capsys.readouterr().out
        lines = text.splitlines()
        assert max(map(len, lines)) <= 80
        numbers = ("1.2347e+05", "1000000", "1234.50", "20 of 20")
        assert [text.count(number) for number in numbers] == [4] * 4
        for part in ("lambda_=0.4", "antenna_sign=printed", "+polish12", "no difference shown", "against bso"):
            assert any(part in line for line in lines), part
        assert "…" not in text


def test_objectives_near_the_best_count_as_equal() -> None:
    a, b = with_ties(np.array([1.0, 1.00009, 1.2]), np.array([1.00005, np.inf]))
    assert a.tolist() == [1.0, 1.0, 1.2] and b.tolist() == [1.0, np.inf]


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_holm_lies_between_the_plain_and_bonferroni(p_values: list[float]) -> None:
    corrected = np.array(holm(p_values))
    plain = np.array(p_values)
    assert (corrected >= plain).all() and (corrected <= np.minimum(1.0, plain * plain.size) + 1e-15).all()
    assert (corrected >= false_discovery_control(plain) - 1e-12).all()  # stricter than a false discovery rate
    order = np.argsort(plain, kind="stable")
    assert (np.diff(corrected[order]) >= 0.0).all()


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03, 0.5]) == pytest.approx([0.04, 0.09, 0.09, 0.5])
    assert holm([]) == []
