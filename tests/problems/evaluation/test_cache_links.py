"""What others may have planted in the cache: nothing is followed, emptied, or written."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from problems.base import cache

KEY = cache.key_of("library")
pytestmark = pytest.mark.skipif(os.name != "posix", reason="links and owners")


def lock(key: str) -> None:
    with cache.compile_lock():
        pass


USES: dict[str, Callable[[str], object]] = {
    "find": cache.find,
    "keep": lambda key: cache.store(key, b"library"),
    "claim": cache.claim,
    "lock": lock,
}


OWN = {"find": f"{KEY}.so", "keep": f"{KEY}.so", "claim": f".{KEY}", "lock": ".turn"}  # what each opens


@pytest.fixture
def victim(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A whole library of that key, which would be found where a link to it were followed."""
    with monkeypatch.context() as patch:
        patch.setenv(cache.VARIABLE, str(tmp_path / "elsewhere"))
        path = cache.store(KEY, b"precious").rename(tmp_path / "victim")
        (tmp_path / "elsewhere").rmdir()
    os.utime(path, (1e9, 1e9))
    return path


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("kind", ["link", "dangling link", "fifo", "folder"])
def test_nothing_planted_is_touched(kind: str, use: str, victim: Path, cache_folder: Path) -> None:
    cache_folder.mkdir(mode=0o700)
    precious, planted = victim.read_bytes(), cache_folder / OWN[use]
    if kind == "fifo":
        os.mkfifo(planted)
    elif kind == "folder":
        planted.mkdir()
    else:
        planted.symlink_to(victim if kind == "link" else victim.parent / "created")
    if use == "lock" or (use, kind) == ("keep", "folder"):
        with pytest.raises(OSError, match=rf"{OWN[use]}|Too many levels|[Ii]s a directory"):
            USES[use](KEY)
    elif use == "keep":  # takes the place of what was planted
        assert USES[use](KEY) == planted == cache.find(KEY)
        assert planted.is_file() and not planted.is_symlink()
    else:
        assert not USES[use](KEY)
    assert (victim.read_bytes(), victim.stat().st_mtime) == (precious, 1e9)
    assert sorted(path.name for path in victim.parent.iterdir()) == sorted({"victim", cache_folder.name})
    assert [path.name for path in cache_folder.iterdir()] == [OWN[use]]


def test_the_victim_is_found_where_no_link_is_needed(victim: Path, cache_folder: Path) -> None:
    cache_folder.mkdir(mode=0o700)
    assert cache.find(KEY) is None
    victim.rename(cache_folder / f"{KEY}.so")
    assert cache.find(KEY) == cache_folder / f"{KEY}.so"


@pytest.mark.parametrize("use", USES.values(), ids=USES)
@pytest.mark.parametrize("why", ["any may write", "a group may write", "it is somebody else's"])
def test_nothing_is_made_where_others_may_write(
    why: str, use: Callable[[str], object], victim: Path, cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache_folder.mkdir()
    cache_folder.chmod({"any may write": 0o777, "a group may write": 0o770}.get(why, 0o700))
    if why == "it is somebody else's":
        monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    (cache_folder / ".turn").symlink_to(victim)
    precious = victim.read_bytes()
    if use is cache.find:
        assert use(KEY) is None
    else:
        with pytest.raises(PermissionError, match="can be written by others"):
            use(KEY)
    assert victim.read_bytes() == precious
    assert [path.name for path in cache_folder.iterdir()] == [".turn"]
    assert cache.scratch() is None
    assert not cache.writable()


def test_the_folder_itself_is_no_link(tmp_path: Path, cache_folder: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    cache_folder.symlink_to(elsewhere)
    with pytest.raises(OSError, match="cache"):
        cache.store(KEY, b"library")
    assert cache.find(KEY) is None
    assert not list(elsewhere.iterdir())


def test_a_mark_of_the_future_holds_nobody_up(cache_folder: Path) -> None:
    assert cache.claim(KEY)
    assert not cache.claim(KEY)
    os.utime(cache_folder / f".{KEY}", (4e9, 4e9))
    assert cache.claim(KEY)
    assert not cache.claim(KEY)
