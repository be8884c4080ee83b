"""Folders that are replaced as a whole."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tpbso_casadi.storage import files as staging
from tpbso_casadi.storage.files import replacing


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def write(folder: Path, *files: str) -> None:
    with replacing(folder) as staged:
        for file in files:
            (staged / file).write_text(file)


@pytest.mark.parametrize("exchangeable", [True, False], ids=["exchanged", "renamed twice"])
def test_a_folder_is_replaced(exchangeable: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not exchangeable:
        monkeypatch.setattr(staging, "_exchange", lambda one, other: False)
    folder = tmp_path / "deep" / "run"
    write(folder, "a", "b")
    write(folder, "b", "c")
    assert names(folder) == ["b", "c"]
    assert names(folder.parent) == ["run"]


def test_a_failure_leaves_it_as_it_was(tmp_path: Path) -> None:
    write(tmp_path / "run", "a")
    with pytest.raises(OSError, match="full"), replacing(tmp_path / "run") as staged:
        (staged / "b").write_text("half")
        raise OSError("full")
    assert (names(tmp_path / "run"), names(tmp_path)) == (["a"], ["run"])


def test_whoever_looks_sees_the_old_folder_until_the_new_one_is_complete(tmp_path: Path) -> None:
    write(tmp_path / "run", "old")
    with replacing(tmp_path / "run") as staged:
        (staged / "new").write_text("new")
        assert names(tmp_path / "run") == ["old"]
    assert names(tmp_path / "run") == ["new"]


def test_a_link_to_a_folder_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "run").symlink_to(tmp_path / "there")
    write(tmp_path / "run", "a")
    assert (tmp_path / "run").is_symlink()
    assert names(tmp_path / "there") == ["a"]


def test_what_a_killed_process_left_is_removed(tmp_path: Path) -> None:
    child = os.fork()
    if not child:
        with replacing(tmp_path / "run"):
            os._exit(0)
    os.waitpid(child, 0)
    assert len(names(tmp_path)) == 1
    with replacing(tmp_path / "run") as staged:
        assert names(tmp_path) == [staged.name]  # of this process, which is alive
        write(tmp_path / "run", "a")
        assert staged.exists()
    assert names(tmp_path) == ["run"]


def test_permissions_are_those_of_any_new_folder(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    write(tmp_path / "run", "a")
    assert (tmp_path / "run").stat().st_mode == (tmp_path / "other").stat().st_mode
