"""Nothing a test does leaves traces outside its folders, or work behind."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from problems.evaluation import cache, population

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as for all that a shell runs in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(  # neither the load of the machine nor chance decides
    "unhurried", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("unhurried")


@pytest.fixture(autouse=True)
def no_compilers_at_work_behind_the_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(population.VARIABLE, "vm")


@pytest.fixture
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv(cache.VARIABLE, str(folder))
    return folder


@pytest.fixture
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The working folder is an empty one."""
    monkeypatch.chdir(tmp_path)
