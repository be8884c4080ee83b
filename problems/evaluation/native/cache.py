"""Keep compiled libraries, named by everything they were made from.

A library is code that will run with the rights of the user, so that nothing is loaded which somebody else could have
written: the folder and the file belong to the user and only the user may write them, and the file ends with a digest
of its content and of its name. What fails a check is treated as absent, and overwritten.
"""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from tempfile import NamedTemporaryFile

from platformdirs import user_cache_path

VARIABLE = "TPBSO_CASADI_CACHE"
MAX_LIBRARIES = 200  # the least recently used go
CLAIM_SECONDS = 60.0  # after which a process that announced to make a library is taken for dead


def folder() -> Path:
    """Where libraries lie: ``$TPBSO_CASADI_CACHE``, or the user's cache directory."""
    path = os.environ.get(VARIABLE)
    return Path(path) if path else user_cache_path("tpbso-casadi")


def key_of(*parts: str) -> str:
    """The name of what is made from these parts and from nothing else."""
    digest = sha256()
    for part in parts:
        encoded = part.encode()
        digest.update(len(encoded).to_bytes(8, "big") + encoded)
    return digest.hexdigest()


def find(key: str) -> Path | None:
    """The library of that key, if it is whole and no other user could have written it."""
    path = _place(key)
    try:
        whole = _private(path.parent) and _private(path) and _sealed(path.read_bytes(), key)
    except OSError:
        return None
    if whole:
        with suppress(OSError):  # it has been used
            os.utime(path)
    return path if whole else None


def keep(key: str, library: bytes) -> Path:
    """Store a library in one step: other processes see all of it or nothing.

    Raises:
        OSError: the folder cannot be written.
        PermissionError: others may write it.
    """
    home = folder()
    home.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not _private(home):
        raise PermissionError(f"{home} can be written by others")
    with NamedTemporaryFile(dir=home, prefix=".", delete=False) as file:
        temporary = Path(file.name)
        try:
            file.write(library + _seal(library, key))
            file.close()
            temporary.replace(_place(key))
            _claim(key).unlink(missing_ok=True)
        finally:
            temporary.unlink(missing_ok=True)
    _forget_oldest(home)
    return _place(key)


def claim(key: str) -> bool:
    """Whether to make that library: no other process has announced that for the last minute.

    Raises:
        OSError: the folder cannot be written.
    """
    mark = _claim(key)
    mark.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    free = not mark.exists() or time.time() - mark.stat().st_mtime > CLAIM_SECONDS
    mark.touch()
    return free


@contextmanager
def compile_lock() -> Iterator[bool]:
    """Whether no other process is compiling; if so this one holds the lock, until its end at the latest.

    Raises:
        OSError: the folder cannot be written.
    """
    import fcntl  # noqa: PLC0415 (not on every system, nor is compiling)

    folder().mkdir(mode=0o700, parents=True, exist_ok=True)
    with (folder() / ".turn").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
        else:
            yield True


def scratch() -> Path | None:
    """The folder itself, from which code may be loaded even where the system's temporary one forbids it; else None."""
    with suppress(OSError):
        folder().mkdir(mode=0o700, parents=True, exist_ok=True)
        return folder() if _private(folder()) and os.access(folder(), os.W_OK) else None
    return None


def writable() -> bool:
    """Whether a library could be kept."""
    nearest = next(path for path in (folder(), *folder().parents) if path.exists())
    return os.access(nearest, os.W_OK)


def _place(key: str) -> Path:
    return folder() / f"{key}.so"


def _claim(key: str) -> Path:
    return folder() / f".{key}"


def _private(path: Path) -> bool:
    status = path.stat()
    return status.st_uid == os.geteuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _seal(library: bytes, key: str) -> bytes:
    return sha256(key.encode() + library).digest()


def _sealed(content: bytes, key: str) -> bool:
    return content[-32:] == _seal(content[:-32], key)


def _forget_oldest(home: Path) -> None:
    with suppress(OSError):  # another process may be doing the same
        files = sorted(home.glob(f"{'[0-9a-f]' * 64}.so"), key=lambda path: path.stat().st_mtime)
        for path in files[:-MAX_LIBRARIES]:
            path.unlink()
