"""Campaigns on Dask: a real scheduler and real workers on loopback."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

distributed = pytest.importorskip("distributed")

from tpbso_casadi.campaign import ExecutorError, run_one  # noqa: E402
from tpbso_casadi.campaign.executors import check_versions  # noqa: E402
from tpbso_casadi.cli.compare import main  # noqa: E402
from tpbso_casadi.storage.versions import versions  # noqa: E402

CAMPAIGN = ["time-2", "rotation-3", "--solvers", "bso,pso+polish", "--runs", "4", "--evaluations", "2000", "--no-plots"]
CAMPAIGN += ["--quiet"]
CLUSTER = """
import os
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=2, dashboard_address=None, host="127.0.0.1") as cluster:
        pids = [worker.pid for worker in cluster.workers.values()]
        print(cluster.scheduler_address, os.getpid(), *pids, flush=True)
        sys.stdin.read()
"""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[str]]:
    """A scheduler's address, its process id, and those of what watches its two workers, which have two threads each."""
    folder = tmp_path_factory.mktemp("cluster")
    script = folder / "cluster.py"
    script.write_text(CLUSTER)
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        cwd=folder,
    )
    assert process.stdout is not None
    yield process.stdout.readline().split()
    process.communicate()


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Dask's own sockets and loops
        yield


def test_two_workers_of_a_cluster_give_the_same_table(cluster: list[str], tmp_path: Path) -> None:
    assert main([*CAMPAIGN, "--dask", cluster[0], "--out", str(tmp_path / "dask")]) == 0
    assert main([*CAMPAIGN, "--workers", "1", "--out", str(tmp_path / "here")]) == 0
    assert (tmp_path / "dask/summary.csv").read_bytes() == (tmp_path / "here/summary.csv").read_bytes()


def test_a_killed_worker_costs_nothing(cluster: list[str], tmp_path: Path) -> None:
    threading.Timer(1.0, os.kill, (int(cluster[2]), signal.SIGKILL)).start()
    runs = [*CAMPAIGN, "--runs", "10", "--solvers", "bso,pso"]
    assert main([*runs, "--dask", cluster[0], "--out", str(tmp_path / "dask")]) == 0
    assert main([*runs, "--workers", "2", "--out", str(tmp_path / "here")]) == 0
    assert (tmp_path / "dask/summary.csv").read_bytes() == (tmp_path / "here/summary.csv").read_bytes()


def test_a_scheduler_that_goes_away_is_one_line_and_what_is_done_is_kept(cluster: list[str], tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tpbso_casadi.compare", *CAMPAIGN, "--runs", "500"]
    command += ["--dask", cluster[0], "--out", str(tmp_path / "dask")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    store = tmp_path / "dask/runs.sqlite"
    deadline = time.monotonic() + 60.0
    while not (store.exists() and store.stat().st_size > 100_000) and time.monotonic() < deadline:
        time.sleep(0.1)
    os.kill(int(cluster[1]), signal.SIGKILL)
    _, error = process.communicate(timeout=90)
    assert process.returncode == 2
    assert error == "error: the workers are gone; completed runs are stored\n"


def test_nobody_answers(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.campaign.executors.CONNECT_TIMEOUT", 1.0)
    assert main([*CAMPAIGN, "--dask", "tcp://127.0.0.1:1", "--out", str(tmp_path)]) == 2
    assert capsys.readouterr().err == "error: --dask tcp://127.0.0.1:1: no scheduler answers there (OSError)\n"


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
