"""The folder of a front: its points, tables and figure."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

from problems import Trajectory
from problems.base import InvalidTable, plain_value, reader
from tpbso_casadi.figures.palette import FORMATS
from tpbso_casadi.plain import NotJSON, as_json, parsed_json, plain, versions
from tpbso_casadi.scenario import ScenarioError, read_text
from tpbso_casadi.storage import (
    LARGEST_RESULT,
    BrokenSeal,
    InvalidRun,
    OutputError,
    check_run_folder,
    check_seal,
    check_writable,
    read_result,
    sealed,
    stored_content,
    write_csv,
    write_text,
    writing,
)
from tpbso_casadi.trade_off.front import Point, TradeOff

FRONT, METHODS, FIGURE = "front.csv", "methods.csv", "front"  # the figure has a suffix for each format
MANIFEST = "front.json"
POINTS = "points"  # the folder of the run folders
RESULT = "result.json"


class FrontStore:
    """The points of a trade-off by method. A point is on the disk when :meth:`add` returns.

    Args:
        folder: of the trade-off.
        asked: what all methods share: scenario and objectives, plain data.
    """

    def __init__(self, folder: Path, asked: dict[str, Any]) -> None:
        self.folder = folder
        self._content: dict[str, Any] = {"asked": plain(asked), "versions": versions(), "methods": {}}

    @classmethod
    def open(cls, folder: Path, asked: dict[str, Any], method: str, settings: dict[str, Any], overwrite: bool) -> Self:
        """The store in a folder, with what an earlier command of the same scenario and settings has left there.

        Args:
            folder: of the trade-off; made with the first point.
            asked: what all methods share.
            method: that will add points.
            settings: of the method.
            overwrite: whether to drop what another scenario, or other settings, have left there.

        Raises:
            OutputError: it cannot be written, or holds anything else.
        """
        check_writable(folder)
        if (folder / RESULT).exists():
            raise OutputError(f"{folder}: is the folder of a run; say another")
        store = cls(folder, asked)
        if not (folder / MANIFEST).exists():
            store._begin(method, settings)
            return store
        held = _read(folder / MANIFEST)
        if overwrite:
            _remove(folder, held)
        else:
            store._resume(held, method, settings)
        store._begin(method, settings)
        return store

    def _begin(self, method: str, settings: dict[str, Any]) -> None:
        self._content["methods"].setdefault(method, {"settings": plain(settings), "points": []})

    def _resume(self, held: dict[str, Any], method: str, settings: dict[str, Any]) -> None:
        """Go on with what is held, if it is of the same scenario, settings and versions."""
        for key in ("asked", "versions"):
            if held[key] != self._content[key]:
                raise OutputError(f"{self.folder}: {_difference(held[key], self._content[key])}; {_WAYS_OUT}")
        known = held["methods"].get(method)
        if known is not None and known["settings"] != plain(settings):
            raise OutputError(f"{self.folder}: {_difference(known['settings'], plain(settings))}; {_WAYS_OUT}")
        self._content = held
        for name in self.methods:
            for point in self.points(name):
                if point.folder and not stored_content(self.folder / point.folder):
                    raise OutputError(f"{self.folder / point.folder}: is gone, or was changed; {_WAYS_OUT}")

    @property
    def methods(self) -> list[str]:
        """The methods that have points."""
        return [name for name, method in self._content["methods"].items() if method["points"]]

    def points(self, method: str) -> list[Point]:
        """The complete points of a method, in the order in which they were made."""
        found: list[Point] = reader(list[Point])(self._content["methods"][method]["points"])
        return found

    def trajectory(self, point: Point) -> Trajectory:
        """The motion of a point, as its run folder has it.

        Raises:
            OutputError: it cannot be read.
        """
        try:
            return read_result(self.folder / point.folder).solution.trajectory
        except InvalidRun as error:
            raise OutputError(str(error)) from error

    def add(self, method: str, *points: Point) -> None:
        """Store points that are complete.

        Raises:
            OutputError: they cannot be written.
        """
        self._content["methods"][method]["points"] += plain_value(list(points))
        self._write()

    def _write(self) -> None:
        with writing(self.folder):
            write_text(self.folder / MANIFEST, lambda file: file.write(as_json(sealed(self._content))))


_WAYS_OUT = "say --overwrite, or another folder"


def _read(path: Path) -> dict[str, Any]:
    """The content of a manifest.

    Raises:
        OutputError: it is none, or was changed.
    """
    try:
        content = parsed_json(read_text(path, LARGEST_RESULT))
        check_seal(content)
        for method in content["methods"].values():
            reader(list[Point])(method["points"])
    except (ScenarioError, NotJSON, BrokenSeal, InvalidTable, LookupError, TypeError, AttributeError) as error:
        reason = "not of a trade-off" if not isinstance(error, BrokenSeal) else error
        raise OutputError(f"{path}: {reason}") from error
    return {key: content[key] for key in ("asked", "versions", "methods")}


def _remove(folder: Path, held: dict[str, Any]) -> None:
    """Remove the runs of a manifest, if they hold nothing else, tables and figure, and then the manifest.

    Raises:
        OutputError: a folder holds anything but a run.
    """
    points = [point for method in held["methods"].values() for point in reader(list[Point])(method["points"])]
    runs = [folder / point.folder for point in points if point.folder and (folder / point.folder).exists()]
    for run in runs:
        check_run_folder(run)
    with writing(folder):
        for run in runs:
            shutil.rmtree(run)
        for name in (FRONT, METHODS, *(f"{FIGURE}.{kind}" for kind in FORMATS)):
            (folder / name).unlink(missing_ok=True)
        (folder / MANIFEST).unlink()


def _difference(held: dict[str, Any], asked: dict[str, Any], path: Sequence[str] = ()) -> str:
    """The first key in which two documents differ, and how, in words."""
    for key in [*held, *asked]:
        old, new = held.get(key), asked.get(key)
        if old == new:
            continue
        if isinstance(old, dict) and isinstance(new, dict):
            return _difference(old, new, (*path, key))
        return f"was made with {'.'.join((*path, key))} = {old!r}, not {new!r}"
    return "was made with other settings"


def save_front(folder: Path, trade_off: TradeOff, formats: Sequence[str]) -> None:
    """Write both tables of a trade-off, and its figure in each of the formats.

    Raises:
        OutputError: they cannot be written.
    """
    first, second = trade_off.headings
    header = ["point", first, second, "duration [s]", "certified", "standing", "method", "seed", "evaluations"]
    unit = f"hypervolume [{_unit(first)} {_unit(second)}]"
    with writing(folder):
        write_csv(folder / FRONT, [*header, "seconds", "folder"], trade_off.rows)
        write_csv(
            folder / METHODS,
            ["method", "points", "on front", unit, "evaluations", "seconds"],
            [
                [s.method, s.points, s.on_front, s.hypervolume, s.evaluations, round(s.seconds, 3)]
                for s in trade_off.summaries
            ],
        )
        if formats:
            from tpbso_casadi.figures.style import write_figure  # noqa: PLC0415 (matplotlib is slow to load)
            from tpbso_casadi.trade_off.front_figures import front_figure  # noqa: PLC0415

            write_figure(folder, FIGURE, front_figure(trade_off), formats)


def _unit(heading: str) -> str:
    return heading[heading.index("[") + 1 : -1]
