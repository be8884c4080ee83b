"""Files that are written completely or not at all, in folders that are checked beforehand."""

from __future__ import annotations

import csv
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
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
