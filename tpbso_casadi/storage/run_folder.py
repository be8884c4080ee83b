"""The folder of a run: its files written, replaced and read."""

from __future__ import annotations

import logging
import shutil
from collections.abc import Callable, Sequence
from functools import partial
from hashlib import file_digest
from pathlib import Path
from typing import Any, NoReturn, Protocol, Self, TypeAlias

from problems.base import FloatArray, tell_step
from solvers import Interruption
from tpbso_casadi.plain import BrokenSeal, NotJSON, check_seal, parsed_json
from tpbso_casadi.planning import JudgedMotion, PlannedMotion
from tpbso_casadi.scenario import ScenarioError, read_text
from tpbso_casadi.storage.files import TEMPORARY, OutputError, check_writable, replacing, write_text, writing
from tpbso_casadi.storage.motion_tables import PIECES, write_motion, write_pieces, write_stages
from tpbso_casadi.storage.result import folder_result

LOG = logging.getLogger(__name__)
Writer: TypeAlias = Callable[[Path], object]  # writes files into a folder
LARGEST_RESULT = 100_000_000  # bytes of a result.json
SUFFIXES = (".json", ".csv", ".npz", ".png", ".pdf", ".svg", ".gif", ".mp4", ".html", ".yaml")  # of the files of a run


class FolderResult(Protocol):
    """The content of a ``result.json``, with digests of the other files in its folder: ``files``."""

    def replaced(self, **values: Any) -> Self:
        """The result with other fields."""

    def to_json(self) -> str:
        """The text with its seal."""


class OtherPlan(OutputError):
    """A folder that holds a run of another scenario."""


def check_run_folder(folder: Path) -> None:
    """Make sure that a run can be written there: it replaces the whole folder, and so nothing else may be in it.

    Raises:
        OutputError: the folder cannot be written, is the working folder, or holds anything but a run, unchanged.
    """
    check_writable(folder)
    with writing(folder, make=False):
        target = folder.resolve()
        check_writable(target.parent)
        if Path.cwd().is_relative_to(target):
            raise OutputError(f"{folder}: is the working folder, which cannot be replaced; say another")
        if target.exists():
            check_replaceable(folder, target)


def check_replaceable(folder: Path, place: Path) -> dict[str, Any]:
    """Make sure that a folder is empty or holds a run as it was written, and nothing else.

    Args:
        folder: its name in messages.
        place: where it is.

    Returns:
        What its ``result.json`` holds; nothing where it is empty.

    Raises:
        OutputError: something in it would be lost.
        OSError: it cannot be read.
    """
    names = sorted(path.name for path in place.iterdir())
    content = stored_content(place)
    digests = content.get("files")
    expected = {} if not isinstance(digests, dict) else digests
    for name in names:
        path = place / name
        ours = path.is_file() and not path.is_symlink() and (content if name == "result.json" else name in expected)
        if not ours or (name != "result.json" and digest_of(path) != expected[name]):
            raise OutputError(
                f"{folder}: holds {name}, which is not of a run, or was changed; a run replaces its whole folder, "
                "say another"
            )
    return content


def stored_content(folder: Path) -> dict[str, Any]:
    """The content of the sealed ``result.json`` in a folder; nothing where there is none, or it was changed."""
    try:
        content = parsed_json(read_text(folder / "result.json", LARGEST_RESULT))
        check_seal(content)
    except (ScenarioError, NotJSON, BrokenSeal):
        return {}
    return content


def write_plan(
    folder: Path,
    plan: PlannedMotion,
    further: Sequence[Writer] = (),
    interruption: Interruption | None = None,
    same_plan_only: bool = False,
) -> list[str]:
    """Write ``result.json``, ``trajectory.csv`` and further files of a plan in place of everything in the folder.

    Args:
        folder: of the run.
        plan: to be written.
        further: each writes files into the folder that it is given.
        interruption: after its request, further files that are not complete yet are left out.
        same_plan_only: whether a run in the folder has to be of the same scenario.

    Returns:
        The names of the files.

    Raises:
        OutputError: the folder cannot be written, or holds anything but a run; it is left as it was. Or a further file
            cannot be; the plan is written without it.
        OtherPlan: it holds the run of another scenario, where that must not be; it is left as it was.
    """

    def check(held: dict[str, Any]) -> None:
        if same_plan_only and held.get("scenario") not in (None, plan.scenario.table()):
            raise OtherPlan(f"{folder}: holds another plan")

    return replace_folder(
        folder,
        needed=tables_of(plan.motion, plan.times),
        further=further,
        result=folder_result(plan),
        interruption=interruption,
        check=check,
    )


def tables_of(motion: JudgedMotion, times: FloatArray) -> list[Writer]:
    """Writers of ``trajectory.csv``, with rows at times (n,) in s, and of what a sequence has beside."""
    found: list[Writer] = [lambda staged: write_motion(staged / "trajectory.csv", motion, times)]
    if motion.stages:
        found.append(lambda staged: write_stages(staged / "stages.csv", motion))
        found.append(lambda staged: write_pieces(staged / PIECES, motion.trajectory))
    return found


def add_to_plan(
    folder: Path, plan: PlannedMotion, further: Sequence[Writer] = (), interruption: Interruption | None = None
) -> list[str]:
    """Write further files of a plan beside those that :func:`write_plan` has written.

    Args:
        folder: of its run.
        plan: that was written there.
        further: as of :func:`write_plan`.
        interruption: likewise.

    Returns:
        The names of all files.

    Raises:
        OutputError: as of :func:`write_plan`; or the folder does not hold that run any more.
    """
    result = folder_result(plan)
    written = stored_content(folder)
    own = parsed_json(_text_of(result, written.get("files", {})))

    def check(held: dict[str, Any]) -> None:
        if held != own:
            raise OutputError(f"{folder}: another run was written there meanwhile; further files are left out")

    def copy(staged: Path) -> None:
        check(written)
        for name in written["files"]:
            shutil.copyfile(folder / name, staged / name)

    return replace_folder(
        folder,
        needed=[copy],
        further=further,
        result=result,
        interruption=interruption,
        check=check,
    )


def replace_folder(
    folder: Path,
    *,
    needed: Sequence[Writer],
    further: Sequence[Writer],
    result: FolderResult,
    interruption: Interruption | None = None,
    check: Callable[[dict[str, Any]], object] = lambda held: None,
) -> list[str]:
    """Write files in place of everything in a folder: at every moment it holds one run, complete.

    Args:
        folder: of the run.
        needed: each writes files into the folder that it is given.
        further: likewise; they are left out where they fail, and after a request to stop.
        result: for ``result.json``, which gets the digests of all other files by name.
        interruption: whose request it is.
        check: is given what the ``result.json`` holds that is replaced, and raises where that must not be.

    Returns:
        The names of the files.

    Raises:
        OutputError: as :func:`write_plan`.
    """
    check_run_folder(folder)
    failures: list[Exception] = []

    def check_old(old: Path) -> None:
        check(check_replaceable(folder, old))

    with writing(folder, make=False), replacing(folder, check_old) as staged:
        total = len(needed) + len(further)
        for number, write in enumerate(needed):
            tell_step("writing", number, total)
            write(staged)
        for number, write in enumerate(further, start=len(needed)):
            tell_step("writing", number, total)
            try:
                (interruption or Interruption()).attempt(partial(write, staged))
            except Exception as error:  # no reason to lose the rest
                failures.append(error)
        files = _digests(staged)
        write_text(staged / "result.json", lambda file: file.write(_text_of(result, files)))
    LOG.info("written: %s, %d files", folder, 1 + len(files))
    if failures:
        _report(folder, failures[0])
    return ["result.json", *files]


def _text_of(result: FolderResult, files: dict[str, str]) -> str:
    """The text of ``result.json`` beside files with these digests."""
    return result.replaced(files=files).to_json()


def _report(folder: Path, failure: Exception) -> NoReturn:
    """Raise what kept a figure or a further file from being written."""
    if isinstance(failure, (OSError, OutputError)):
        reason = failure.strerror if isinstance(failure, OSError) else failure
        raise OutputError(f"{folder}: the run is written, but not all of its files: {reason}") from failure
    raise failure


def _digests(folder: Path) -> dict[str, str]:
    """SHA-256 of every complete file, by name; incomplete ones are removed."""
    for path in folder.glob(f"{TEMPORARY}*"):
        path.unlink()
    return {path.name: digest_of(path) for path in sorted(folder.iterdir())}


def digest_of(path: Path) -> str:
    """SHA-256 of a file.

    Raises:
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        return file_digest(file, "sha256").hexdigest()
