"""Files written whole or not at all; folders replaced in one step."""

from __future__ import annotations

import csv
import ctypes
import os
import platform
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp
from typing import IO

TEMPORARY = ".incomplete-"  # what the names of incomplete files begin with


class OutputError(ValueError):
    """A file or folder that cannot be written; the message is one line."""


def check_writable(folder: Path) -> None:
    """Make sure that a folder can be made and written to, without making it.

    Raises:
        OutputError: it or its nearest existing parent is a file, or not writable.
    """
    try:
        nearest = folder
        while not _is_there(nearest) and nearest != nearest.parent:
            nearest = nearest.parent
        if not nearest.is_dir():
            raise OutputError(f"{folder}: {nearest} is a file, not a folder")
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror}") from error


def _is_there(path: Path) -> bool:
    """Whether something has that name, if only a link to nowhere."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def check_file(path: Path) -> None:
    """Make sure that a file of that name can be written: there is none, or one that is replaced.

    Raises:
        OutputError: there is a folder, a device or a pipe of that name, or there can be no such name.
    """
    try:
        path.lstat()
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise OutputError(f"{path}: cannot be written: {getattr(error, 'strerror', error)}") from error
    if not path.is_file():
        raise OutputError(f"{path}: is {'a folder' if path.is_dir() else 'no regular file'}, and would be replaced")


@contextmanager
def writing(folder: Path, make: bool = True) -> Iterator[None]:
    """Make the folder if it does not exist, and report errors of the system while files are written in one line.

    Args:
        folder: of the files.
        make: False where whoever writes them makes it.

    Raises:
        OutputError: a file or the folder cannot be written.
    """
    try:
        if make:
            folder.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror}") from error


def write_text(path: Path, write: Callable[[IO[str]], object]) -> Path:
    """Write a text file under a temporary name in the same folder, then rename it.

    Raises:
        OSError: it cannot be written; an older file of that name is kept.
    """
    with tempfile.NamedTemporaryFile(
        "w", prefix=TEMPORARY, dir=path.parent, delete=False, encoding="utf-8", newline=""
    ) as file:
        temporary = Path(file.name)
        try:
            write(file)
            file.flush()
        except BaseException:
            temporary.unlink()
            raise
    return _renamed(temporary, path)


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> Path:
    """Write a table with round-trip precision, None as an empty cell, like :func:`write_text`."""

    def write(file: IO[str]) -> None:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)

    return write_text(path, write)


def write_with(path: Path, write: Callable[[Path], object]) -> Path:
    """Let a library write a file under a temporary name with the same suffix, then rename it.

    Raises:
        OSError: it cannot be written; an older file of that name is kept.
    """
    handle, name = tempfile.mkstemp(prefix=TEMPORARY, dir=path.parent, suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        write(temporary)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return _renamed(temporary, path)


def _renamed(temporary: Path, path: Path) -> Path:
    temporary.chmod(0o666 & ~umask())
    return temporary.replace(path)


def umask() -> int:
    """The permissions that new files of this process do not get."""
    os.umask(mask := os.umask(0))
    return mask


AT_FDCWD, RENAME_EXCHANGE = -100, 2  # Linux: paths relative to the working folder; exchange two files
STAGED = "staged"  # suffix of a folder that is being written


@contextmanager
def replacing(folder: Path, check: Callable[[Path], object] = lambda old: None) -> Iterator[Path]:
    """An empty folder to write in, which takes the place of ``folder`` at the end; a failure leaves that as it was.

    On systems that cannot exchange two folders (all but Linux) the old one lies beside its place for the moment
    between two renamings.

    Args:
        folder: of which everything is replaced; it need not exist.
        check: gets the old folder, when nobody can find it any more; if it raises, that is put back.

    Raises:
        OSError: it cannot be written.
    """
    target = folder.resolve()
    target.parent.mkdir(parents=True, exist_ok=True)
    _remove_abandoned(target)
    staged = Path(mkdtemp(prefix=f"{_mark(target)}{os.getpid()}-", suffix=f".{STAGED}", dir=target.parent))
    try:
        yield staged
        staged.chmod(0o777 & ~umask())
        _put_in_place(staged, target)
        if staged.exists():
            _checked(staged, target, check)
    finally:
        shutil.rmtree(staged, ignore_errors=True)  # the old content, or what was not completed


def _checked(old: Path, target: Path, check: Callable[[Path], object]) -> None:
    """Exchange the folders again if the old one does not pass."""
    try:
        check(old)
    except BaseException:
        _put_in_place(old, target)
        raise


def _mark(target: Path) -> str:
    """The beginning of the names of folders that are written on this machine to replace ``target``."""
    return f".{target.name[:100]}-{platform.node()[:50].replace('/', '_')}-"


def _put_in_place(staged: Path, target: Path) -> None:
    """Let ``target`` be the staged folder; the old one, if any, is at ``staged`` afterwards."""
    if not target.exists():
        staged.rename(target)
        return
    if _exchange(staged, target):
        return
    aside = staged.with_suffix(".old")
    target.rename(aside)
    try:
        staged.rename(target)
    except OSError:
        aside.rename(target)
        raise
    aside.rename(staged)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two folders in one step; False where the system cannot."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, TypeError, AttributeError):
        return False
    rename.argtypes = (ctypes.c_int, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_uint)
    failed: int = rename(AT_FDCWD, os.fsencode(one), AT_FDCWD, os.fsencode(other), RENAME_EXCHANGE)
    return not failed


def _remove_abandoned(target: Path) -> None:
    """Remove what processes of this machine have left that were killed while they wrote."""
    mark = _mark(target)
    for path in target.parent.iterdir():
        if path.name.startswith(mark) and path.suffix == f".{STAGED}" and not _is_alive(path.name[len(mark) :]):
            shutil.rmtree(path, ignore_errors=True)


def _is_alive(name: str) -> bool:
    """Whether the process still exists that ``PID-...`` names; True where that cannot be known."""
    process = name.partition("-")[0]
    if os.name != "posix" or not process.isdecimal():
        return True
    try:
        os.kill(int(process), 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True
