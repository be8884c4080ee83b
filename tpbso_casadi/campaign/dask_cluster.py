"""The workers of a Dask scheduler as executors of runs; whatever else answers, or nobody, is found out in seconds."""

from __future__ import annotations

import asyncio
import logging
import re
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial
from threading import Thread
from typing import Any, TypeVar

from tpbso_casadi.campaign.executors import ExecutorError, ExecutorFactory, LostExecutor
from tpbso_casadi.campaign.run import difference, one_line
from tpbso_casadi.storage.versions import versions

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
        check_versions(address, _versions_there(address, client))
        start = partial(client.get_executor, pure=False)
        yield ExecutorFactory(start, start, QUEUE_LENGTH, backend, _watch(address))


def check_address(address: str) -> None:
    """Make sure that it is one.

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
    """What a call returns that knows no time limit of its own.

    Raises:
        TimeoutError: it takes longer; it goes on in a thread that does not keep the process alive.
    """
    future: Future[T] = Future()

    def work() -> None:
        try:
            future.set_result(call())
        except BaseException as error:
            future.set_exception(error)

    Thread(target=work, daemon=True).start()
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
