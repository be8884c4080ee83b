"""Campaigns: every run once, whatever happens to workers; the same numbers whoever does them."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import line_of
from helpers.waiting import wait_until
from threadpoolctl import threadpool_info, threadpool_limits

from solvers import Result, minimize
from solvers.budget import Interruption
from tpbso_casadi import builtin
from tpbso_casadi.cli.campaign import State, duration
from tpbso_casadi.judging.campaign import (
    DESCENT_CANDIDATES,
    PROCESS_SECONDS,
    campaign_seconds,
    run_campaign,
    seconds_of,
)
from tpbso_casadi.judging.executors import ExecutorFactory, LostExecutor, in_process, processes, run_one
from tpbso_casadi.judging.grid import SolverSpec, function_grid, grid, parse_solver, parse_solvers
from tpbso_casadi.judging.run import PLAN_SECONDS, Outcome, Run
from tpbso_casadi.judging.searches import FunctionRun
from tpbso_casadi.judging.store import RunStore

LIMIT = {"evaluations": 100}


def runs_of(solvers: str, seeds: Sequence[int] = range(1, 5), case: str = "time-2") -> list[Run]:
    specs = [SolverSpec(s.label, s.name, s.settings, s.polish_starts, LIMIT) for s in parse_solvers(solvers)]
    return grid({case: builtin(case)}, specs, seeds)


def functions_of(solvers: str, seeds: Sequence[int] = range(1, 5)) -> list[FunctionRun]:
    """Searches of a benchmark function, which take no time."""
    specs = [SolverSpec(s.label, s.name, s.settings, s.polish_starts, LIMIT) for s in parse_solvers(solvers)]
    return function_grid(["sphere-2"], specs, seeds)


def threads(workers: int = 2) -> ExecutorFactory:
    return ExecutorFactory(lambda: ThreadPoolExecutor(workers), lambda: ThreadPoolExecutor(1), 2 * workers)


def records_by(executors: ExecutorFactory, path: Path) -> list[dict[str, object]]:
    runs = runs_of("bso,pso+polish", (1, 2))
    with RunStore(path) as store:
        run_campaign(runs, store, executors)
        results = [store.result(run) for run in runs]
    tables = [result.table() | {"seconds": 0.0} for result in results]
    return [table | {"polish": (table.get("polish") or {}) | {"seconds": 0.0}} for table in tables]


@pytest.mark.parametrize(
    "executors", [in_process(Interruption()), *(pytest.param(processes(n), marks=pytest.mark.process) for n in (1, 2))]
)
def test_any_executor_gives_the_same_records(executors: ExecutorFactory, tmp_path: Path) -> None:
    assert records_by(executors, tmp_path / "these") == records_by(threads(), tmp_path / "threads")


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    runs = functions_of("bso")
    outcomes: list[Outcome] = []
    with RunStore(tmp_path / "store") as store:
        run_campaign(runs[:3], store, threads(), progress=lambda _, outcome: outcomes.append(outcome))
        run_campaign(runs, store, threads(), progress=lambda _, outcome: outcomes.append(outcome))
        run_campaign([*runs, *runs], store, threads(), progress=lambda _, outcome: outcomes.append(outcome))
        assert len(outcomes) == len(runs) == len(store.records(runs))


def test_a_run_that_raises_is_kept_as_failed_and_the_rest_goes_on(tmp_path: Path) -> None:
    runs = functions_of("helpers.campaign:Raises,bso", range(1, 9))
    with RunStore(tmp_path / "store") as store:
        run_campaign(runs, store, threads())
        records = store.records(runs)
        failed = [record for record in records if record.error]
        assert len(records) == len(runs)
        assert 0 < len(failed) < 8
        assert {record.error for record in failed} == {"ArithmeticError: this one fails"}
        outcomes: list[Outcome] = []
        run_campaign(runs, store, threads(), progress=lambda _, outcome: outcomes.append(outcome))
        assert not outcomes
        run_campaign(runs, store, threads(), retry_failed=True, progress=lambda _, outcome: outcomes.append(outcome))
        assert len(outcomes) == len(failed)


@pytest.mark.process
@pytest.mark.slow
def test_a_run_that_kills_its_worker_is_found_and_the_rest_goes_on(tmp_path: Path) -> None:
    runs = functions_of("bso,helpers.campaign:Kills", (1, 2))
    with RunStore(tmp_path / "store") as store:
        run_campaign(runs, store, processes(2))
        records = store.records(runs)
    assert [bool(record.error) for record in records] == [False, True, False, True]
    assert records[1].error == "WorkerDied: 2 times in a row while nothing else ran"


@pytest.mark.process
@pytest.mark.slow
def test_a_run_whose_worker_died_once_is_done_again(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    runs = functions_of(f"bso,helpers.campaign:Kills(mark={mark})", (1, 2))
    with RunStore(tmp_path / "store") as store:
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
            RunStore(tmp_path / f"store-{number}") as store,
            pytest.raises(LostExecutor, match="the workers are gone; completed runs are stored"),
        ):
            run_campaign(functions_of("bso"), store, ExecutorFactory(gone, gone, 2))


def test_a_search_and_its_polishes_are_one_search_with_the_results_of_three(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    searched: list[tuple[object, ...]] = []

    def counted(*arguments: object, **options: object) -> Result:
        searched.append(arguments)
        return minimize(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr("tpbso_casadi.planning.planning.minimize", counted)
    runs = runs_of("pso,pso+polish,pso+polish3,bso", (1,))
    alone = [comparable(run_one(*run.task)) for run in runs]
    assert len(searched) == 4
    outcomes: dict[str, Outcome] = {}
    with RunStore(tmp_path / "store") as store:
        run_campaign(
            runs, store, in_process(Interruption()), progress=lambda run, outcome: outcomes.update({run.key: outcome})
        )
        records = store.records(runs)
    assert len(searched) == 4 + 2
    assert [comparable(outcomes[run.key]) for run in runs] == alone
    assert [bool(outcomes[run.key].seconds_saved) for run in runs] == [False, True, True, False]
    for record, content in zip(records, alone, strict=True):
        polish = content["polish"]["evaluations"] if "polish" in record.solver else 0
        assert record.evaluations == content["evaluations"] + polish and bool(polish) == ("polish" in record.solver)
    assert [record.search for record in records] == [runs[index].key for index in (0, 0, 0, 3)]


def comparable(outcome: Outcome) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(outcome.result or "")
    for table in (content, content.get("polish") or {}, content.get("retiming") or {}):
        table.pop("seconds", None)
    content.pop("seal")  # which holds for the seconds too
    return content


def test_a_search_that_its_polish_finds_stored_is_not_shared(tmp_path: Path) -> None:
    runs = runs_of("pso,pso+polish", (1,))
    outcomes: list[Outcome] = []
    with RunStore(tmp_path / "store") as store:
        run_campaign(runs[:1], store, threads())
        run_campaign(runs, store, threads(), progress=lambda _, outcome: outcomes.append(outcome))
        assert len(store.records(runs)) == 2
    assert [outcome.seconds_saved for outcome in outcomes] == [0.0]


def test_a_polish_within_a_time_has_a_search_of_its_own() -> None:
    runs = runs_of("pso,pso+polish", (1,))
    within = [run.section.replaced(within=1.0) for run in runs]
    timed = [
        replace(run, scenario=run.scenario.replaced(solver=solver)) for run, solver in zip(runs, within, strict=True)
    ]
    assert runs[0].search == runs[1].search != timed[1].search != timed[0].search


def test_ctrl_c_keeps_what_was_begun(tmp_path: Path) -> None:
    runs = functions_of("bso", range(1, 20))

    def interrupt(_: FunctionRun, outcome: Outcome) -> None:
        if not interrupted:
            interrupted.append(1)
            raise KeyboardInterrupt

    interrupted: list[int] = []
    with RunStore(tmp_path / "store") as store:
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
    monkeypatch.setattr("tpbso_casadi.judging.campaign.GRACE_SECONDS", 0.0)
    mark = tmp_path / "mark"
    runs = functions_of(f"helpers.campaign:Endless(mark={mark})", (1,)) + functions_of("bso", (1,))

    def interrupt(_: FunctionRun, outcome: Outcome) -> None:
        wait_until(lambda: mark.exists() and mark.read_text())
        raise KeyboardInterrupt

    with RunStore(tmp_path / "store") as store:
        with pytest.raises(KeyboardInterrupt):
            run_campaign(runs, store, processes(2), progress=interrupt)
        assert [record.solver for record in store.records(runs)] == ["bso"]
    wait_until(lambda: not Path(f"/proc/{mark.read_text()}").exists())  # the worker is dead


@pytest.mark.parametrize("executors", [threads(), pytest.param(processes(1), marks=pytest.mark.process)])
def test_a_run_that_exits_has_failed(executors: ExecutorFactory, tmp_path: Path) -> None:
    runs = functions_of("bso,helpers.campaign:Exits", (1,))
    with RunStore(tmp_path / "store") as store:
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
    runs = functions_of("bso", range(len(RAISED)))
    with RunStore(tmp_path / "store") as store:
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
    monkeypatch.setattr("tpbso_casadi.judging.campaign.CHECK_SECONDS", 0.01)
    looks = []

    def check() -> None:
        looks.append(1)
        if len(looks) == 3:
            raise LostExecutor("no workers")

    with RunStore(tmp_path / "store") as store, pytest.raises(LostExecutor, match="no workers"):
        run_campaign(
            functions_of("bso"), store, ExecutorFactory(partial(Silent, 1), partial(Silent, 1), 2, check=check)
        )
    assert len(looks) == 3


def test_labels_are_printable() -> None:
    [run] = grid({"a\x1b[31m\udcff": builtin("time-2")}, parse_solvers("bso"), (1,))
    assert run.case == "a\\x1b[31m\\udcff"


def test_estimates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.judging.campaign.candidate_seconds", lambda scenario, backend: 1e-4 - 5e-6)
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
        seconds[name] = seconds_of([run], 4_000)
    descent = 4_000 * (1e-4 - 5e-6)
    expected = {"bso": 2.0, "pso": 0.3, "ga": 7.0, "abso": 9.0, "bso+polish3": 0.1 + 3 * descent, "ipopt": 2 * descent}
    assert seconds == pytest.approx({name: each + PLAN_SECONDS * (name != "abso") for name, each in expected.items()})
    both = [seconds_of([run], candidates) for candidates in DESCENT_CANDIDATES]
    ten = [replace_seed(run, seed) for seed in range(10)]
    expected = [process + 10 * one / 4 for process, one in zip(PROCESS_SECONDS, both, strict=True)]
    assert campaign_seconds(ten, 4) == pytest.approx(expected)
    assert campaign_seconds([run, run], 4) == pytest.approx(np.add(PROCESS_SECONDS, both))
    searches = runs_of("bso,bso+polish,bso+polish2", (1,))
    assert seconds_of(searches, 4_000) == pytest.approx(100 * 1e-4 + 3 * PLAN_SECONDS + 3 * descent)


def replace_seed(run: Run, seed: int) -> Run:
    solver = run.scenario.solver.replaced(seed=seed)
    return replace(run, scenario=run.scenario.replaced(solver=solver))


def test_durations() -> None:
    shown = {0.01: "1 s", 90.0: "90 s", 150.0: "2.5 min", 7300.0: "2 h", 86_400 * 30: "30 days", 1e12: "3.17e+04 years"}
    assert {seconds: duration(seconds) for seconds in shown} == shown


def test_how_far_a_campaign_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.cli.progress.time.perf_counter", iter([0.0, *[30.0] * 9]).__next__)
    runs = runs_of("bso,bso+polish,pso")  # of four seeds
    state = State(runs, workers=1)
    for run in runs[:3]:  # the first search compiles; the second is that of another solver
        state.advance(run, Outcome("{}", 50.0))
    assert state.line() == "3 of 12 runs after 30 s"
    for run, seconds, saved in zip(runs[3:6], (3.0, 7.0, 9.0), (0.0, 2.0, 0.0), strict=True):
        state.advance(run, Outcome("{}", seconds, seconds_saved=saved))
    assert state.left() == 2 * (3.0 + 5.0 + 9.0)
    state.advance(runs[6], Outcome(None, 1.0, "ValueError: no"))
    assert state.line() == "7 of 12 runs after 30 s, 1 failed, about 29 s left"  # 1 + 2 * 5 + 2 * 9
    two = State(runs, workers=2)
    for run in runs[:5]:
        two.advance(run, Outcome("{}", 4.0))
    assert two.left() is None  # nothing of pso, in a worker that had been at work
    two.advance(runs[5], Outcome("{}", 4.0))
    assert two.left() == 6 * 4.0 / 2


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
    "bso+polished": "'bso+polished' is not NAME",
    "pso,bso,pso": "pso is there twice",
}


def test_solvers_that_cannot_be_read() -> None:
    for text, expected in UNREAD.items():
        assert line_of(partial(parse_solvers, text)).startswith(f"solvers: {expected}")


def test_a_scenarios_own_solver_table_counts_for_its_solver_alone() -> None:
    scenario = builtin("time-2")
    table = scenario.solver.replaced(population=12, settings={"c1": 1.0}, evaluations=77)
    scenario = scenario.replaced(solver=table)
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

    monkeypatch.setattr("tpbso_casadi.judging.executors._result", told)
    with threadpool_limits(2, user_api="blas"):
        assert run_one("{}", {}).result == "{}"
    assert threads == {1}
