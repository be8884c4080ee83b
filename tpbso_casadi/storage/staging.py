"""A folder that is replaced as a whole: whoever looks sees the old one or the new one, complete."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import mkdtemp

from tpbso_casadi.storage.files import umask

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
    """What the names of folders begin with that are written on this machine to replace ``target``."""
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
