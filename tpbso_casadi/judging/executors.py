"""Where runs are done: in this process, in processes, on a Dask cluster; and what is done there."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import re
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import connection, get_context, parent_process, resource_tracker
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from problems.evaluation import EvaluationOptions, processors
from solvers import Interruption
from tpbso_casadi.judging.run import Outcome, difference, failed, problem_of
from tpbso_casadi.judging.searches import KEY, SUITE_KEY, search_text, suite_text
from tpbso_casadi.plain import one_line, versions
from tpbso_casadi.planning import SharedSearches, plan
from tpbso_casadi.scenario import ScenarioError, parse_scenario
from tpbso_casadi.storage import result_of

RUN_LOCK = threading.Lock()  # IPOPT's linear solver is not thread-safe, and a cluster's worker may have many threads


class OtherVersions(RuntimeError):
    """A worker has other versions of the packages that decide a result."""


def run_together(scenarios: Sequence[str], expected: dict[str, str], backend: str | None = None) -> list[Outcome]:
    """Do runs that differ in their polish alone: the search that they have in common is made once.

    Each gives what it would give alone. Whatever is raised within one becomes its failed outcome, an exit by a plug-in
    too; Ctrl-C passes. BLAS has one thread meanwhile: other runs have the other processors.

    Args:
        scenarios: JSON; or one statement of the search of a benchmark function or of a suite's problem.
        expected: versions that the campaign is made with.
        backend: evaluates populations; None for that of the environment. It changes no result.
    """
    with RUN_LOCK, threadpool_limits(1, user_api="blas"):
        contents = [json.loads(scenario) for scenario in scenarios]
        starts = [content.get("solver", {}).get("polish_starts", 0) for content in contents]
        shared = SharedSearches(archived=max(starts) > 1)
        return [_outcome(content, expected, backend, shared) for content in contents]


def run_one(scenario: str, expected: dict[str, str], backend: str | None = None) -> Outcome:
    """Do one run, as :func:`run_together` does."""
    [outcome] = run_together([scenario], expected, backend)
    return outcome


def _outcome(content: dict[str, Any], expected: dict[str, str], backend: str | None, shared: SharedSearches) -> Outcome:
    began, saved = time.perf_counter(), shared.seconds_saved
    try:
        result = _result(content, expected, backend, shared)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        return failed(error, time.perf_counter() - began)
    saved = shared.seconds_saved - saved
    return Outcome(result, time.perf_counter() - began + saved, seconds_saved=saved)


def _result(content: dict[str, Any], expected: dict[str, str], backend: str | None, shared: SharedSearches) -> str:
    ours = versions()
    if ours != expected:
        raise OtherVersions(f"{difference(ours, expected)} on this worker")
    if KEY in content:
        return search_text(content)
    if SUITE_KEY in content:
        return suite_text(content)
    stated = parse_scenario(content)
    problem = problem_of(stated)
    evaluation = None if backend is None else EvaluationOptions(backend)
    finished = plan(stated, evaluation=evaluation, problem=problem, shared=shared)
    if finished.interrupted:
        raise InterruptedError("the run was interrupted")
    return result_of(finished).to_json(indent=None)


WORKERS_PER_PROCESSOR = 8  # more only take memory


class ExecutorError(ScenarioError):
    """The workers are not available; the message is one line."""


class LostExecutor(RuntimeError):
    """The executor is gone; the runs that ended before are stored."""


def _nothing_to_check() -> None:
    """Workers of this machine report their own end."""


@dataclass(frozen=True)
class ExecutorFactory:
    """The two functions that make the executors of a campaign.

    Attributes:
        start: makes an executor for all runs, and another when one is broken.
        alone: makes an executor for a single run that may have broken another.
        width: searches submitted at a time, including those that wait for a worker.
        workers: that work at a time.
        backend: evaluates populations there; None for that of a worker's environment. It changes no result.
        check: called now and then while no run ends; raises :class:`LostExecutor` if none can end any more.
    """

    start: Callable[[], Executor]
    alone: Callable[[], Executor]
    width: int
    workers: int = 1
    backend: str | None = None
    check: Callable[[], None] = _nothing_to_check


def processes(workers: int, backend: str | None = None) -> ExecutorFactory:
    """The executors of processes of this machine.

    Raises:
        ExecutorError: so many that they would only take memory.
    """
    most = WORKERS_PER_PROCESSOR * processors()
    if workers > most:
        raise ExecutorError(f"--workers: more than {most}, {WORKERS_PER_PROCESSOR} a processor, only take memory")
    return ExecutorFactory(lambda: _pool(workers), lambda: _pool(1), 2 * workers, workers, backend)


def _pool(workers: int) -> Executor:
    return _Pool(workers, get_context("spawn"), _stay_with_parent)


class _Pool(ProcessPoolExecutor):
    """A process pool whose workers never see Ctrl-C, not even while they start, and end when nobody waits for them."""

    def submit(self, *arguments: Any, **options: Any) -> Future[Any]:
        """Submit a call; worker processes that start here inherit the blocked signal."""
        with _sigint_blocked():
            return super().submit(*arguments, **options)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Free the workers; without ``wait``, end those that are at work."""
        workers = [] if wait else list((self._processes or {}).values())
        super().shutdown(wait, cancel_futures=cancel_futures)
        for worker in workers:
            worker.kill()


@contextmanager
def _sigint_blocked() -> Iterator[None]:
    """Block SIGINT in this thread; one that arrives is delivered at the end. Has no effect on Windows."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # it would unblock the signal when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _stay_with_parent() -> None:
    """Leave, in a worker, Ctrl-C to the parent process, and end when that has ended, for whatever reason."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class InProcess(Executor):
    """Executor in this process: for classes that only this process knows, or where a process costs more than it saves.

    Args:
        interruption: of the campaign; a run that Ctrl-C cut short is not handed out.
    """

    def __init__(self, interruption: Interruption) -> None:
        self._interruption = interruption

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        """Call the function now.

        Raises:
            KeyboardInterrupt: Ctrl-C.
        """
        future: Future[Any] = Future()
        future.set_running_or_notify_cancel()
        future.set_result(function(*arguments, **options))
        if self._interruption.requested:
            raise KeyboardInterrupt
        return future


def in_process(interruption: Interruption, backend: str | None = None) -> ExecutorFactory:
    """The executors that do one run after the other in this process."""
    return ExecutorFactory(lambda: InProcess(interruption), lambda: InProcess(interruption), 1, backend=backend)


T = TypeVar("T")
Workers = Mapping[str, Any]  # by address, what the scheduler says of them

ADDRESS = re.compile(r"(?:(?P<scheme>\w+)://)?(\[[^]\s]+\]|[^:/\s]+):(?P<port>[0-9]{1,5})")
SCHEMES = ("tcp", "tls", "ws", "wss", "ucx")
DASK_LOGGERS = ("distributed", "tornado")
QUEUE_LENGTH = 100_000  # runs: the scheduler distributes them itself
ANSWER_SECONDS = 10.0  # for a scheduler to answer
WORKERS_SECONDS = 30.0  # for a worker to join, or to answer
POLL_SECONDS = 0.5


@contextmanager
def cluster(address: str, backend: str | None = None) -> Iterator[ExecutorFactory]:
    """The workers of a Dask scheduler, including those that join later.

    Args:
        address: as ``tcp://host:port``.
        backend: evaluates populations there.

    Raises:
        ExecutorError: Dask is not installed, no scheduler answers within 10 s, none of its workers within 30 s, or a
            worker has other versions than this process.
    """
    try:
        from distributed import Client  # noqa: PLC0415 (optional, and slow to load)
    except ImportError as error:
        raise ExecutorError("--dask needs the package distributed: pip install 'tpbso-casadi[dask]'") from error
    check_address(address)
    for name in [name for name in logging.root.manager.loggerDict if name.split(".")[0] in DASK_LOGGERS]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are reported in one line
    wait_for_workers(address)
    try:
        client = Client(address, timeout=ANSWER_SECONDS, set_as_default=False)
    except Exception as error:
        raise _refused(address, "the scheduler does not take clients", error) from error
    with client:
        installed = _versions_there(address, client)
        check_versions(address, installed)
        start = partial(client.get_executor, pure=False)
        yield ExecutorFactory(start, start, QUEUE_LENGTH, max(1, len(installed)), backend, _watch(address))


def check_address(address: str) -> None:
    """Make sure that an address is one.

    Raises:
        ExecutorError: it is not.
    """
    match = ADDRESS.fullmatch(address)
    if match is None or int(match["port"]) > 65_535:
        raise ExecutorError(f"--dask {one_line(address) or repr(address)}: is not an address like tcp://host:port")
    if (match["scheme"] or "tcp") not in SCHEMES:
        raise ExecutorError(f"--dask {address}: {match['scheme']} is none of {', '.join(SCHEMES)}")


def workers_of(address: str) -> Workers:
    """The workers of a scheduler, asked over a connection of its own.

    Raises:
        ExecutorError: no scheduler answers within 10 s.
    """
    from distributed.core import rpc  # noqa: PLC0415 (optional, and slow to load)

    async def identity() -> Mapping[str, Any]:
        async with rpc(address, timeout=ANSWER_SECONDS) as scheduler:
            return dict(await scheduler.identity(n_workers=-1))

    try:
        answer = asyncio.run(asyncio.wait_for(identity(), ANSWER_SECONDS))
    except Exception as error:  # whatever listens there may make Dask raise anything
        raise _refused(address, f"no scheduler answers there within {ANSWER_SECONDS:g} s", error) from error
    if answer.get("type") != "Scheduler":
        raise ExecutorError(f"--dask {address}: that is no scheduler, but a {one_line(str(answer.get('type')))}")
    workers: Workers = answer["workers"]
    return workers


def wait_for_workers(address: str) -> None:
    """Return when a scheduler has workers.

    Raises:
        ExecutorError: it does not answer within 10 s, or has none for 30 s.
    """
    deadline = time.monotonic() + WORKERS_SECONDS
    while not workers_of(address):
        if time.monotonic() > deadline:
            raise ExecutorError(f"--dask {address}: the scheduler has had no workers for {WORKERS_SECONDS:g} s")
        time.sleep(POLL_SECONDS)


def _watch(address: str) -> Callable[[], None]:
    """A check that the scheduler still answers, and has workers."""

    def check() -> None:
        try:
            wait_for_workers(address)
        except ExecutorError as error:
            raise LostExecutor(f"{error}; completed runs are stored") from error

    return check


def _versions_there(address: str, client: Any) -> Mapping[str, dict[str, str] | Exception]:
    """The versions on each worker."""
    try:
        answers: Mapping[str, dict[str, str] | Exception] = within(
            WORKERS_SECONDS, lambda: client.run(versions, on_error="return")
        )
    except Exception as error:
        raise _refused(address, f"not all workers answer within {WORKERS_SECONDS:g} s", error) from error
    return answers


def within(seconds: float, call: Callable[[], T]) -> T:
    """The result of a call that knows no time limit of its own.

    Raises:
        TimeoutError: it takes longer; it goes on in a thread that does not keep the process alive.
    """
    future: Future[T] = Future()

    def work() -> None:
        try:
            future.set_result(call())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=work, daemon=True).start()
    return future.result(seconds)


def check_versions(address: str, by_worker: Mapping[str, dict[str, str] | Exception]) -> None:
    """Compare the versions of each worker with those of this process; a worker that has just left does not matter.

    Raises:
        ExecutorError: naming the first that differs.
    """
    for worker, installed in by_worker.items():
        if isinstance(installed, OSError):
            continue
        if isinstance(installed, Exception):
            reason = f"{type(installed).__name__}: {installed}"
            raise ExecutorError(one_line(f"--dask {address}: {worker} cannot do it: {reason}"))
        if installed != versions():
            raise ExecutorError(f"--dask {address}: {difference(installed, versions())} on {worker}")


def _refused(address: str, what: str, error: BaseException) -> ExecutorError:
    return ExecutorError(one_line(f"--dask {address}: {what} ({type(error).__name__}: {error})"))
