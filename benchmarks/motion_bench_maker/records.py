"""What planners found, one JSON object a line, written the moment it is known: the same command resumes."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from benchmarks.motion_bench_maker.problem_file import InvalidFile


@dataclass(frozen=True)
class Record:
    """A planner's answer to a problem.

    Attributes:
        problem: its name.
        planner: with its settings.
        seed: of the planner.
        setup: a digest of everything else that decides the answer: robot, limits, goal.
        bound: least time of a motion that ignores obstacles, s.
        duration: of the motion, s; None where there is none.
        seconds: CPU time of planning.
        clearance: the least distance at samples, m.
        excess: the largest shares by which speed, acceleration and jerk exceed their limits at samples,
            joint ranges, rad, and with a payload torques.
        certified: proven to keep all limits for all t by our certificates; None where that was not asked.
        error: why there is no motion.
        details: whatever else is worth keeping.
    """

    problem: str
    planner: str
    seed: int
    setup: str
    bound: float
    duration: float | None = None
    seconds: float = 0.0
    clearance: float | None = None
    excess: list[float] | None = None
    certified: bool | None = None
    error: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def key(self) -> tuple[str, str, int, str]:
        """What is not done twice."""
        return self.problem, self.planner, self.seed, self.setup


class Records:
    """A file of records, to which they are appended.

    Args:
        path: of the file; made if there is none.

    Raises:
        InvalidFile: a line that is not a record; an incomplete last line, of a run that was killed, is cut off.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            text = path.read_text() if path.exists() else ""
            complete = text[: text.rfind("\n") + 1]
            self.every = [self._record(number, line) for number, line in enumerate(complete.splitlines(), start=1)]
            if complete != text:
                os.truncate(path, len(complete.encode()))
        except (OSError, UnicodeError) as error:
            raise InvalidFile(f"{path}: cannot be read: {error}") from error

    def _record(self, number: int, line: str) -> Record:
        try:
            content = json.loads(line)
            return Record(**{key.name: content[key.name] for key in fields(Record)})
        except (ValueError, KeyError, TypeError) as error:
            raise InvalidFile(f"{self.path}: line {number}: is not a record ({type(error).__name__})") from error

    def missing(self, keys: Iterable[tuple[str, str, int, str]]) -> list[tuple[str, str, int, str]]:
        """Those of these keys for which there is no record."""
        done = {record.key for record in self.every}
        return [key for key in keys if key not in done]

    def add(self, record: Record) -> None:
        """Write a record; it is on the disk when this returns.

        Raises:
            InvalidFile: it cannot be written.
        """
        try:
            with self.path.open("a") as file:
                file.write(json.dumps(asdict(record)) + "\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise InvalidFile(f"{self.path}: cannot be written: {error}") from error
        self.every.append(record)
