"""Compiled libraries, covers, looks and functions, kept between processes: found by key, written whole or not at all.

The least recently used of each kind are forgotten.

A library is code that will run with the rights of the user, so that nothing is loaded which somebody else could have
written: the folder and the file belong to the user and only the user may write them, and the file ends with a digest
of its content and of its name. What fails a check is treated as absent, and replaced. The folder is checked before
anything in it is opened, no link is followed, and no file that is there already is written to.
"""

from __future__ import annotations

import os
import re
import stat
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from secrets import token_hex

from platformdirs import user_cache_path

VARIABLE = "TPBSO_CASADI_CACHE"
MOST_FILES = {
    "so": 200,
    "cover": 500,
    "look": 100,
    "fun": 1000,
    "pairs": 200,
}  # by the ending of their names; the least recently used go
CLAIM_SECONDS = 60.0  # after which a process that announced to make a library is taken for dead
NAME = re.compile(rf"[0-9a-f]{{64}}\.({'|'.join(MOST_FILES)})")
NEVER_FOLLOW = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)


def folder() -> Path:
    """The folder of all cached files: ``$TPBSO_CASADI_CACHE``, or the user's cache directory."""
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
    """The library stored under a key, if it is whole and no other user could have written it."""
    return None if _found(key, "so") is None else _place(key, "so")


def find_text(key: str, ending: str) -> str | None:
    """The text stored under a key, of any kind but libraries, if it is whole."""
    content = _found(key, ending)
    return None if content is None else content.decode()


def _found(key: str, ending: str) -> bytes | None:
    try:
        with _opened() as home, _opened_file(f"{key}.{ending}", os.O_RDONLY, home) as file:
            content = _content(file)
            if not _sealed(content, key):
                return None
            with suppress(OSError):  # it has been used
                os.utime(file)
    except OSError:
        return None
    return content[:-SEAL]


def store(key: str, content: bytes, ending: str = "so") -> Path:
    """Store a library, or a text, in one step: other processes see all of it or nothing.

    Raises:
        OSError: the folder cannot be written.
        PermissionError: others may write it.
    """
    temporary = f".{token_hex(16)}"
    with _opened(create=True) as home:
        try:
            with _opened_file(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, home) as file:
                _write(file, content + _seal(content, key))
            os.replace(temporary, f"{key}.{ending}", src_dir_fd=home, dst_dir_fd=home)
        finally:
            with suppress(FileNotFoundError):
                os.unlink(temporary, dir_fd=home)
        with suppress(FileNotFoundError):
            os.unlink(f".{key}", dir_fd=home)
        _forget_oldest(home, ending)
    return _place(key, ending)


def claim(key: str) -> bool:
    """Whether this process may make what has a key: no other has announced it for the last minute.

    Raises:
        OSError: the folder cannot be written, or others may write it.
    """
    with _opened(create=True) as home:
        try:
            with _opened_file(f".{key}", os.O_WRONLY | os.O_CREAT | os.O_EXCL, home):
                return True
        except FileExistsError:
            mark = os.stat(f".{key}", dir_fd=home, follow_symlinks=False)
            free = not 0.0 <= time.time() - mark.st_mtime <= CLAIM_SECONDS
            if free:
                os.utime(f".{key}", dir_fd=home, follow_symlinks=False)
            return free


@contextmanager
def compile_lock() -> Iterator[bool]:
    """Whether no other process is compiling; if so this one holds the lock, until its end at the latest.

    Raises:
        OSError: the folder cannot be written, or others may write it.
    """
    import fcntl  # noqa: PLC0415 (not on every system, nor is compiling)

    with _opened(create=True) as home, _opened_file(".turn", os.O_RDWR | os.O_CREAT, home) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
        else:
            yield True


def scratch() -> Path | None:
    """The cache folder, from which code may be loaded even where the temporary folder forbids it; else None."""
    with suppress(OSError), _opened(create=True):
        return folder() if os.access(folder(), os.W_OK) else None
    return None


def writable() -> bool:
    """Whether a library could be stored in the cache."""
    with suppress(OSError):
        if folder().exists():
            with _opened():
                return os.access(folder(), os.W_OK)
        nearest = next(path for path in folder().parents if path.exists())
        return nearest.is_dir() and os.access(nearest, os.W_OK)
    return False


def _place(key: str, ending: str) -> Path:
    return folder() / f"{key}.{ending}"


@contextmanager
def _opened(create: bool = False) -> Iterator[int]:
    """A descriptor of the folder: whatever is done in it is done in the folder that was checked.

    Raises:
        OSError: it is not there, or it is a link.
        PermissionError: it belongs to somebody else, or others may write it.
    """
    if create:
        folder().mkdir(mode=0o700, parents=True, exist_ok=True)
    home = os.open(folder(), os.O_RDONLY | os.O_DIRECTORY | NEVER_FOLLOW)
    try:
        if not _private(os.fstat(home)):
            raise PermissionError(f"{folder()} can be written by others")
        yield home
    finally:
        os.close(home)


@contextmanager
def _opened_file(name: str, flags: int, home: int) -> Iterator[int]:
    """A descriptor of a file in the folder, which is never emptied.

    Raises:
        OSError: it cannot be opened, or it is a link.
        PermissionError: it is no plain file, belongs to somebody else, or others may write it.
    """
    file = os.open(name, flags | NEVER_FOLLOW | os.O_NONBLOCK, 0o600, dir_fd=home)
    try:
        status = os.fstat(file)
        if not (stat.S_ISREG(status.st_mode) and _private(status)):
            raise PermissionError(f"{folder() / name} is not this user's own file")
        yield file
    finally:
        os.close(file)


def _private(status: os.stat_result) -> bool:
    return status.st_uid == os.geteuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _content(file: int) -> bytes:
    with os.fdopen(file, "rb", closefd=False) as opened:
        return opened.read()


def _write(file: int, content: bytes) -> None:
    with os.fdopen(file, "wb", closefd=False) as opened:
        opened.write(content)


SEAL = 32  # bytes


def _seal(content: bytes, key: str) -> bytes:
    return sha256(key.encode() + content).digest()


def _sealed(content: bytes, key: str) -> bool:
    return content[-SEAL:] == _seal(content[:-SEAL], key)


def _forget_oldest(home: int, ending: str) -> None:
    with suppress(OSError):  # another process may be doing the same
        names = [name for name in os.listdir(home) if NAME.fullmatch(name) and name.endswith(ending)]
        oldest = sorted(names, key=lambda name: os.stat(name, dir_fd=home, follow_symlinks=False).st_mtime)
        for name in oldest[: -MOST_FILES[ending]]:
            os.unlink(name, dir_fd=home)
