"""Campaigns: every run once, whatever happens to workers; the same numbers whoever does them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from helpers.running import line_of
from helpers.waiting import wait_until
from threadpoolctl import threadpool_info, threadpool_limits

from solvers.budget import Interruption
from tpbso_casadi import builtin
from tpbso_casadi.campaign import (
    ExecutorFactory,
    LostExecutor,
    Outcome,
    Run,
    SolverSpec,
    Store,
    campaign_seconds,
    grid,
    in_process,
    parse_solver,
    parse_solvers,
    processes,
    run_campaign,
)
from tpbso_casadi.campaign.run import PLAN_SECONDS, run_one
from tpbso_casadi.campaign.runner import PROCESS_SECONDS, run_seconds
from tpbso_casadi.cli.campaign import State, duration

LIMIT = {"evaluations": 100}


def runs_of(solvers: str, seeds: Sequence[int] = range(1, 5), case: str = "time-2") -> list[Run]:
    specs = [SolverSpec(s.label, s.name, s.settings, s.polish_starts, LIMIT) for s in parse_solvers(solvers)]
    return grid({case: builtin(case)}, specs, seeds)


def threads(workers: int = 2) -> ExecutorFactory:
    return ExecutorFactory(lambda: ThreadPoolExecutor(workers), lambda: ThreadPoolExecutor(1), 2 * workers)


def records_by(executors: ExecutorFactory, path: Path) -> list[dict[str, object]]:
    runs = runs_of("bso,pso+polish", (1, 2))
    with Store(path) as store:
        run_campaign(runs, store, executors)
        results = [store.result(run) for run in runs]
    return [result.model_dump(exclude={"seconds": True, "polish": {"seconds"}}) for result in results]


@pytest.mark.parametrize(
    "executors", [in_process(Interruption()), *(pytest.param(processes(n), marks=pytest.mark.process) for n in (1, 2))]
)
def test_any_executor_gives_the_same_records(executors: ExecutorFactory, tmp_path: Path) -> None:
    assert records_by(executors, tmp_path / "these") == records_by(threads(), tmp_path / "threads")


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


@pytest.mark.process
@pytest.mark.slow
def test_a_run_that_kills_its_worker_is_found_and_the_rest_goes_on(tmp_path: Path) -> None:
    runs = runs_of("bso,helpers.campaign:Kills", (1, 2))
    with Store(tmp_path / "store") as store:
        run_campaign(runs, store, processes(2))
        records = store.records(runs)
    assert [bool(record.error) for record in records] == [False, True, False, True]
    assert records[1].error == "WorkerDied: 2 times in a row while nothing else ran"


@pytest.mark.process
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


def test_an_executor_that_is_gone_is_said_in_one_line(tmp_path: Path) -> None:
    executors: list[Callable[[], Executor]] = [partial(Cancels, 1), partial(Raised, ConnectionResetError("closed"))]
    for number, gone in enumerate(executors):
        with (
            Store(tmp_path / f"store-{number}") as store,
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


@pytest.mark.process
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


@pytest.mark.parametrize("executors", [threads(), pytest.param(processes(1), marks=pytest.mark.process)])
def test_a_run_that_exits_has_failed(executors: ExecutorFactory, tmp_path: Path) -> None:
    runs = runs_of("bso,helpers.campaign:Exits", (1,))
    with Store(tmp_path / "store") as store:
        run_campaign(runs, store, executors)
        assert [record.error for record in store.records(runs)] == ["", "SystemExit: 0"]


class Raised(ThreadPoolExecutor):
    """An executor whose runs end with what a plug-in can raise."""

    def __init__(self, error: BaseException) -> None:
        super().__init__(1)
        self.error = error

    def submit(self, *_: object, **__: object) -> Future[object]:  # type: ignore[override]
        future: Future[object] = Future()
        future.set_exception(self.error)
        return future


class Unspeakable(Exception):
    def __str__(self) -> str:
        raise ValueError


RAISED: list[tuple[BaseException, str]] = [
    (SystemExit(3), "SystemExit: 3"),
    (KeyboardInterrupt(), "KeyboardInterrupt:"),
    (ValueError("\x1b[2J\udc80\nend"), "ValueError: \\x1b[2J\\udc80 end"),
    (Unspeakable(), "Unspeakable: (its message cannot be read)"),
    (ValueError("x" * 10_000), f"ValueError: {'x' * 285}..."),
]


def test_whatever_is_raised_is_a_failed_run(tmp_path: Path) -> None:
    runs = runs_of("bso", range(len(RAISED)))
    with Store(tmp_path / "store") as store:
        for run, (error, expected) in zip(runs, RAISED, strict=True):
            raised = partial(Raised, error)
            run_campaign([run], store, ExecutorFactory(raised, raised, 1))
            [record] = store.records([run])
            assert record.error == expected


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

    with Store(tmp_path / "store") as store, pytest.raises(LostExecutor, match="no workers"):
        run_campaign(runs_of("bso"), store, ExecutorFactory(partial(Silent, 1), partial(Silent, 1), 2, check=check))
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
    assert seconds == pytest.approx({name: each + PLAN_SECONDS * (name != "abso") for name, each in expected.items()})
    one = 2 * descent + PLAN_SECONDS
    assert campaign_seconds([run] * 10, 4) == pytest.approx(PROCESS_SECONDS + 10 * one / 4)
    assert campaign_seconds([run], 4) == pytest.approx(PROCESS_SECONDS + one)


def test_durations() -> None:
    shown = {0.01: "1 s", 90.0: "90 s", 150.0: "2.5 min", 7300.0: "2 h", 86_400 * 30: "30 days", 1e12: "3.17e+04 years"}
    assert {seconds: duration(seconds) for seconds in shown} == shown


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


UNREAD = {
    "bso,,pso": "'' is not NAME",
    "bso(lambda_)": "'bso(lambda_)': 'lambda_' is not setting=value",
    "pso(printed)": "'pso(printed)': 'printed' is not setting=value",
    "a.b:C(printed)": "'a.b:C(printed)': 'printed' is not setting=value",
    "bso(a=1": "'bso(a=1' is not NAME",
    "bso+polished": "'bso+polished' is not NAME",
    "pso,bso,pso": "pso is there twice",
}


def test_solvers_that_cannot_be_read() -> None:
    for text, expected in UNREAD.items():
        assert line_of(partial(parse_solvers, text)).startswith(f"solvers: {expected}")


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


def test_a_run_has_one_thread_of_blas(monkeypatch: pytest.MonkeyPatch) -> None:
    threads = set()

    def told(*_: object) -> str:
        threads.update(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
        return "{}"

    monkeypatch.setattr("tpbso_casadi.campaign.run._result", told)
    with threadpool_limits(2, user_api="blas"):
        assert run_one("{}", {}).result == "{}"
    assert threads == {1}
