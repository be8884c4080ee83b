"""Many motions of one robot judged one after the other, or by several processes at once."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, fields
from functools import partial
from hashlib import sha256
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Self

from problems import CertificateStatus, InvalidProblem, Verdict
from tpbso_casadi.facade.certifying import file_content
from tpbso_casadi.plain import one_line, plain, versions
from tpbso_casadi.planning import JudgedMotion
from tpbso_casadi.scenario import FIELDS, READERS, Scenario, ScenarioError, parse_scenario, read_motion

UNREADABLE = "unreadable"
AT_ONCE = 8  # files that a process is given at a time


@dataclass(frozen=True)
class Certificate:
    """The judgement of one file.

    Attributes:
        file: its name.
        digest: of its content and of all that it was judged by.
        status: certified, violated, undecided or unreadable.
        assumed: under what that holds: what was left out, a tracking error; empty where there is nothing to say.
        duration: of the motion, s; as the numbers that follow None where there is none.
        pieces: of the motion.
        seconds: that reading and judging took.
        broken: the names of the constraints that are not proven.
        worst: the first of them: its value, its limit and where.
        reason: why it is unreadable.
    """

    file: str
    digest: str
    status: str
    assumed: str = ""
    duration: float | None = None
    pieces: int | None = None
    seconds: float | None = None
    broken: str = ""
    worst: str = ""
    reason: str = ""

    @classmethod
    def columns(cls) -> list[str]:
        """The header of a table of them."""
        return [field.name for field in fields(cls)]

    @classmethod
    def from_row(cls, row: Mapping[str, str]) -> Self:
        """The certificate that a row of a table states.

        Raises:
            ValueError: it is none.
        """
        numbers: dict[str, Callable[[str], Any]] = {"duration": float, "pieces": int, "seconds": float}
        cells: dict[str, Any] = {name: row.get(name) for name in cls.columns()}
        if None in cells.values():
            raise ValueError("a column is missing")
        return cls(**cells | {name: of(cells[name]) if cells[name] else None for name, of in numbers.items()})

    @property
    def in_words(self) -> str:
        """The status, with what it assumes."""
        return f"{self.status} {self.assumed}".rstrip()

    @property
    def row(self) -> list[object]:
        """The cells of the certificate in a table."""
        return list(asdict(self).values())


def trajectory_files(folder: Path) -> list[Path]:
    """The files of a folder that may hold a motion, by their names."""
    return sorted(path for path in folder.iterdir() if path.suffix.lower() in READERS and path.is_file())


@dataclass(frozen=True)
class Statement:
    """The robot, surroundings and form of rows by which motions are judged.

    Args:
        scenario: the robot and what is around it.
        task: how rows are joined.
    """

    scenario: Scenario
    task: Mapping[str, Any]

    def digest_of(self, file: Path) -> str:
        """A digest of a file's content and of all that it is judged by; empty where it cannot be read."""
        stated = json.dumps([plain(self.scenario.table()), dict(self.task), versions()], sort_keys=True)
        try:
            content = file.read_bytes()
        except OSError:
            return ""
        return sha256(sha256(stated.encode()).digest() + content).hexdigest()[:16]


class Judge:
    """Judges files by a statement; robot and surroundings are built once.

    Args:
        statement: what motions are judged by.

    Raises:
        ScenarioError: the robot cannot be built.
    """

    def __init__(self, statement: Statement) -> None:
        self._statement = statement
        self._scene = statement.scenario.built()

    def __call__(self, file: Path) -> Certificate:
        """The certificate of a file, whatever is in it."""
        began = time.perf_counter()
        digest = self._statement.digest_of(file)
        try:
            motion = self.motion(file)
        except (ScenarioError, InvalidProblem) as error:
            return Certificate(file.name, digest, UNREADABLE, reason=one_line(str(error)))
        failed = [verdict for verdict in motion.verdicts if not verdict.satisfied]
        return Certificate(
            file=file.name,
            digest=digest,
            status=str(motion.status),
            assumed=motion.criteria.assumed,
            duration=motion.trajectory.duration,
            pieces=motion.trajectory.breakpoints.size - 1,
            seconds=time.perf_counter() - began,
            broken="; ".join(verdict.name for verdict in failed),
            worst=_in_words(failed),
        )

    def motion(self, file: Path) -> JudgedMotion:
        """The motion of a file, with its verdicts.

        Raises:
            ScenarioError: it holds none.
            InvalidProblem: it is none of this robot.
        """
        table = read_motion(file_content(file, dict(self._statement.task)))
        try:
            criteria = table.criteria(*self._scene)
        except InvalidProblem as error:
            raise ScenarioError(f"{FIELDS.get(error.field, error.field)}: {error.reason}") from error
        return JudgedMotion(criteria, criteria.given_motion(), {})


def _in_words(failed: Sequence[Verdict]) -> str:
    """The first violated verdict, else the first undecided one."""
    violated = [verdict for verdict in failed if verdict.status is CertificateStatus.VIOLATED]
    for verdict in (violated or failed)[:1]:
        value = verdict.worst_is.number(verdict.worst)
        return f"{verdict.name} {value}, limit {verdict.bound:.6g} {verdict.unit}; {verdict.where}"
    return ""


_JUDGES: list[Judge] = []  # of a worker process: one


def _prepare(content: dict[str, Any], task: Mapping[str, Any]) -> None:
    _JUDGES.append(Judge(Statement(parse_scenario(content), task)))


def _judged(file: Path) -> Certificate:
    return _JUDGES[-1](file)


def certificates(statement: Statement, files: Sequence[Path], processes: int = 1) -> Iterator[Certificate]:
    """The certificates of files, in their order.

    Args:
        statement: what they are judged by.
        files: of motions.
        processes: that share the work.

    Raises:
        ScenarioError: the robot cannot be built.
    """
    judge = Judge(statement)  # whatever is wrong is said at once
    if processes == 1 or len(files) < 2:
        yield from map(judge, files)
        return
    start = partial(_prepare, statement.scenario.table(), dict(statement.task))
    with ProcessPoolExecutor(min(processes, len(files)), get_context("spawn"), start) as pool:
        yield from pool.map(_judged, files, chunksize=AT_ONCE)
