"""The files of a run: result.json, trajectory.csv, the figures and exports, written together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from hashlib import file_digest
from pathlib import Path
from typing import Any, NoReturn

from solvers.driver.interruption import Interruption
from tpbso_casadi.planning.plan import Plan
from tpbso_casadi.scenario.input_files import read_text
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.content import result_of
from tpbso_casadi.storage.files import TEMPORARY, OutputError, check_writable, write_text, writing
from tpbso_casadi.storage.motion_table import write_motion
from tpbso_casadi.storage.plain import NotJSON, parsed_json
from tpbso_casadi.storage.staging import replacing

LARGEST_RESULT = 100_000_000  # bytes of a result.json
FILES = (  # of a run, whether or not its result.json names them
    "result.json",
    "trajectory.csv",
    *(f"{name}.png" for name in ("convergence", "path", "joints", "accuracy", "redundancy")),
    *(f"joint_trajectory.{suffix}" for suffix in ("json", "csv", "npz")),
)


def check_run_folder(folder: Path) -> None:
    """Make sure that a run can be written there: it replaces the whole folder, and so holds nothing else.

    Raises:
        OutputError: the folder cannot be written, or holds files that are not of a run.
    """
    check_writable(folder)
    with writing(folder, make=False):
        target = folder.resolve()
        check_writable(target.parent)
        names = sorted(path.name for path in target.iterdir()) if target.exists() else []
    strangers = [name for name in names if name not in {*FILES, *_recorded_files(target)}]
    if strangers:
        raise OutputError(
            f"{folder}: holds {strangers[0]}, which is not of a run; a run replaces its whole folder, say another"
        )


def scenario_in(folder: Path) -> object:
    """The scenario of the run in a folder, as plain data that nobody has checked; None where there is none."""
    return _unchecked(folder).get("scenario")


def _recorded_files(folder: Path) -> set[str]:
    """The names of the files of the run in a folder, if there is one."""
    files = _unchecked(folder).get("files")
    return set(files) if isinstance(files, dict) else set()


def _unchecked(folder: Path) -> dict[str, Any]:
    """What ``result.json`` in a folder holds; nothing where it cannot be read."""
    try:
        return parsed_json(read_text(folder / "result.json", LARGEST_RESULT))
    except (ScenarioError, NotJSON):
        return {}


def write_run(
    folder: Path,
    plan: Plan,
    plots: bool = True,
    further: Sequence[Callable[[Path], object]] = (),
    interruption: Interruption | None = None,
) -> list[str]:
    """Write the files of a plan in place of everything in the folder: at every moment it holds one run, complete.

    Args:
        folder: of the run.
        plan: to be written.
        plots: whether to draw the figures.
        further: each writes files into the folder that it is given.
        interruption: after its request, figures and further files that are not complete yet are left out.

    Returns:
        The names of the files.

    Raises:
        OutputError: the folder cannot be written, or holds files that are not of a run; it is left as it was. Or a
            figure or a further file cannot be; the plan is written without it.
    """
    check_run_folder(folder)
    failures: list[Exception] = []
    with writing(folder, make=False), replacing(folder) as staged:
        write_motion(staged / "trajectory.csv", plan.motion, plan.times)
        figures: list[Callable[[Path], object]] = [partial(_draw, plan)] if plots else []
        for write in [*figures, *further]:
            try:
                (interruption or Interruption()).attempt(partial(write, staged))
            except Exception as error:  # no reason to lose the plan
                failures.append(error)
        result = result_of(plan).model_copy(update={"files": _digests(staged)})
        write_text(staged / "result.json", lambda file: file.write(result.to_json()))
    if failures:
        _report(folder, failures[0])
    return ["result.json", *result.files]


def _report(folder: Path, failure: Exception) -> NoReturn:
    """Raise what kept a figure or a further file from being written."""
    if isinstance(failure, (OSError, OutputError)):
        reason = failure.strerror if isinstance(failure, OSError) else failure
        raise OutputError(f"{folder}: the plan is written, but not all of its files: {reason}") from failure
    raise failure


def _draw(plan: Plan, folder: Path) -> None:
    from tpbso_casadi.figures.run import draw_figures  # noqa: PLC0415 (matplotlib is slow to load)

    draw_figures(folder, plan)


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
