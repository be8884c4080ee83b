"""Campaigns on Dask: a real scheduler and real workers on loopback."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from helpers.stores import stored_rows, wait_for_rows
from helpers.waiting import PATIENCE, wait_until

distributed = pytest.importorskip("distributed")

from tpbso_casadi.cli.commands.compare import main  # noqa: E402
from tpbso_casadi.judging.executors import ExecutorError, check_versions, run_one, within  # noqa: E402
from tpbso_casadi.plain import versions  # noqa: E402

pytestmark = pytest.mark.process

CAMPAIGN = ["time-2", "rotation-3", "--solvers", "bso,pso+polish", "--runs", "4", "--evaluations", "2000", "--no-plots"]
CAMPAIGN += ["--quiet"]
CLUSTER = """
import os
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    options = {"n_workers": int(sys.argv[1]), "threads_per_worker": 2, "dashboard_address": None, "host": "127.0.0.1"}
    with LocalCluster(**options) as cluster:
        pids = [worker.pid for worker in cluster.workers.values()]
        print(cluster.scheduler_address, os.getpid(), *pids, flush=True)
        sys.stdin.read()
"""


@contextmanager
def running_cluster(folder: Path, workers: int) -> Iterator[list[str]]:
    """A scheduler's address, its process id, and those of its workers, which have two threads each."""
    script = folder / "cluster.py"
    script.write_text(CLUSTER)
    process = subprocess.Popen(
        [sys.executable, str(script), str(workers)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=folder,
    )
    assert process.stdout is not None
    yield process.stdout.readline().split()
    process.communicate()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[str]]:
    with running_cluster(tmp_path_factory.mktemp("cluster"), 2) as started:
        yield started


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Dask's own sockets and loops
        yield


def test_two_workers_of_a_cluster_give_the_same_table(cluster: list[str], tmp_path: Path) -> None:
    assert main([*CAMPAIGN, "--dask", cluster[0], "--out", str(tmp_path / "dask")]) == 0
    assert main([*CAMPAIGN, "--workers", "1", "--out", str(tmp_path / "here")]) == 0
    assert (tmp_path / "dask/summary.csv").read_bytes() == (tmp_path / "here/summary.csv").read_bytes()


@pytest.mark.slow
def test_a_killed_worker_costs_nothing(cluster: list[str], tmp_path: Path) -> None:
    def kill_after_the_first_run() -> None:
        wait_until(lambda: stored_rows(tmp_path / "dask/runs.sqlite") or ended.is_set())
        os.kill(int(cluster[2]), signal.SIGKILL)

    ended = threading.Event()
    killer = threading.Thread(target=kill_after_the_first_run)
    killer.start()
    runs = [*CAMPAIGN, "--runs", "10", "--solvers", "bso,pso"]
    try:
        assert main([*runs, "--dask", cluster[0], "--out", str(tmp_path / "dask")]) == 0
    finally:
        ended.set()
        killer.join()
    assert main([*runs, "--workers", "2", "--out", str(tmp_path / "here")]) == 0
    assert (tmp_path / "dask/summary.csv").read_bytes() == (tmp_path / "here/summary.csv").read_bytes()


@pytest.mark.slow
def test_a_scheduler_that_goes_away_is_one_line_and_what_is_done_is_kept(cluster: list[str], tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tpbso_casadi", "compare", *CAMPAIGN, "--runs", "500"]
    command += ["--dask", cluster[0], "--out", str(tmp_path / "dask")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    wait_for_rows(process, tmp_path / "dask/runs.sqlite", 1)
    os.kill(int(cluster[1]), signal.SIGKILL)
    _, error = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert error == "error: the workers are gone; completed runs are stored\n"
    assert stored_rows(tmp_path / "dask/runs.sqlite") >= 1


def nothing_is_said(connection: socket.socket) -> None:
    """Keep the connection open."""


def rubbish_is_said(connection: socket.socket) -> None:
    with suppress(OSError):
        connection.sendall(b"\x01" + bytes(7) + b"\xff" * 1000)


def the_web_is_said(connection: socket.socket) -> None:
    with suppress(OSError):
        connection.sendall(b"HTTP/1.0 400 Bad Request\r\n\r\n")
        connection.close()


@pytest.mark.parametrize("answer", [nothing_is_said, rubbish_is_said, the_web_is_said])
def test_a_port_that_is_something_else_takes_one_line_and_a_moment(
    answer: Callable[[socket.socket], None],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tpbso_casadi.judging.executors.ANSWER_SECONDS", 0.5)
    connections = []

    def serve() -> None:
        with suppress(OSError):
            while True:
                connections.append(server.accept()[0])
                answer(connections[-1])

    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=serve)
        thread.start()
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        assert main([*CAMPAIGN, "--dask", address, "--out", str(tmp_path)]) == 2
        server.shutdown(socket.SHUT_RDWR)  # ends the waiting for connections
        thread.join()
    for connection in connections:
        connection.close()
    error = capsys.readouterr().err
    assert error.startswith(f"error: --dask {address}: no scheduler answers there within 0.5 s (")
    assert error.count("\n") == 1


def test_a_scheduler_without_workers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tpbso_casadi.judging.executors.WORKERS_SECONDS", 0.1)
    with running_cluster(tmp_path, 0) as (address, *_):
        assert main([*CAMPAIGN, "--dask", address, "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"error: --dask {address}: the scheduler has had no workers for 0.1 s\n"


def test_a_call_without_an_end_is_left_behind() -> None:
    ended = threading.Event()
    with pytest.raises(TimeoutError):
        within(0.01, ended.wait)
    ended.set()
    assert within(60.0, lambda: 3) == 3
    with pytest.raises(ZeroDivisionError):
        within(60.0, lambda: 1 / 0)


def test_workers_with_other_versions_are_refused() -> None:
    theirs: dict[str, Any] = {"tcp://first:1": versions(), "tcp://second:2": versions() | {"casadi": "3.0"}}
    with pytest.raises(ExecutorError, match=r"--dask here:1: casadi 3.0 where .* is needed on tcp://second:2"):
        check_versions("here:1", theirs)
    theirs["tcp://second:2"] = ModuleNotFoundError("No module named 'tpbso_casadi'")
    with pytest.raises(
        ExecutorError, match=r"--dask here:1: tcp://second:2 cannot do it: ModuleNotFoundError: No module"
    ):
        check_versions("here:1", theirs)
    check_versions("here:1", {"tcp://first:1": versions(), "tcp://gone:3": OSError("closed")})
    outcome = run_one("{}", versions() | {"numpy": "1.0"})
    assert outcome.error.startswith("OtherVersions: numpy") and outcome.result is None
