"""Nothing a test does leaves traces outside its folders, or work behind."""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from problems.base import cache
from problems.core import found_core
from problems.evaluation import population
from problems.library import NoCore

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as for all that a shell runs in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(  # neither the load of the machine nor chance decides
    "unhurried", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("unhurried")


def pytest_collection_finish() -> None:
    """What is collected stays: it is not looked through for garbage again and again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)


@pytest.fixture(scope="session", autouse=True)
def no_compilers_at_work_behind_the_tests() -> Iterator[None]:
    """Of the whole session: fixtures of modules plan too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(population.VARIABLE, "vm")
        yield


@pytest.fixture(scope="session", autouse=True)
def what_needs_the_core_is_skipped_without_it() -> Iterator[None]:
    """On a machine without a compiler, where it is counted instead of failing."""

    def skip(*reason: str) -> None:
        pytest.skip(reason[-1])

    with pytest.MonkeyPatch.context() as patch:
        if found_core() is None:
            patch.setattr(NoCore, "__init__", skip)
        yield


@pytest.fixture(autouse=True)
def plans_are_not_compared_with_an_optimum(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Audits neither descend to an optimum nor judge by its conditions, but in tests with the mark ``optimum``."""
    if request.node.get_closest_marker("optimum") is None:
        for name in ("nearest_optimum", "optimality_of"):
            monkeypatch.setattr(f"tpbso_casadi.audit_report.{name}", lambda *arguments: None)


@pytest.fixture
def only_the_path_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """One figure stands for all that are drawn of a plan."""
    from tpbso_casadi.figures.path import path_figure  # noqa: PLC0415 (matplotlib is slow to load)

    monkeypatch.setattr("tpbso_casadi.figures.run.drawings_of", lambda plan: {"path": partial(path_figure, plan)})


@pytest.fixture
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv(cache.VARIABLE, str(folder))
    return folder


@pytest.fixture
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The working folder is an empty one."""
    monkeypatch.chdir(tmp_path)
