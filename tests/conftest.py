"""Nothing a test does leaves traces outside its folders, or work behind."""

from __future__ import annotations

from pathlib import Path

import pytest

from problems.evaluation import population
from problems.evaluation.native import cache


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
