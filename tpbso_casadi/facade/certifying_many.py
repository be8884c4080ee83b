"""Many motions of one robot judged one after the other, or by several processes at once; a table of them is resumed."""

from __future__ import annotations

import csv
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
from tpbso_casadi.scenario import FIELDS, READERS, Scenario, ScenarioError, parse_scenario, read_motion, read_text
from tpbso_casadi.storage import OutputError, check_file, check_writable, write_csv, writing

UNREADABLE = "unreadable"
AT_ONCE = 8  # files that a process is given at a time
TABLE = "certificates.csv"
LARGEST_TABLE = 100_000_000  # bytes


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
        notes: on how the file was read, and what its numbers look like.
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
    notes: str = ""

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
            notes="; ".join(motion.criteria.task.notes),
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


@dataclass(frozen=True)
class CertificateTable:
    """A CSV file of certificates, which grows while files are judged.

    Args:
        path: of the file.
        statement: by which the files are judged; rows by another one are not kept.
    """

    path: Path
    statement: Statement

    def judged(self, files: Sequence[Path], processes: int = 1) -> list[Certificate]:
        """The certificates of files: those of the table where nothing has changed, and new ones, which are added to it.

        Args:
            files: of motions.
            processes: that share the work.

        Raises:
            OutputError: it cannot be written, or there is another one.
            ScenarioError: what is there cannot be read, or the robot cannot be built.
        """
        check_writable(self.path.parent)
        check_file(self.path)
        known = self._known(files)
        judged = [known[file.name] for file in files if file.name in known]
        left = [file for file in files if file.name not in known]
        with writing(self.path.parent):
            self._write(judged)
            with self.path.open("a", encoding="utf-8", newline="") as rows:
                for certificate in certificates(self.statement, left, processes):
                    csv.writer(rows, lineterminator="\n").writerow(certificate.row)
                    rows.flush()  # what was judged is kept, whatever comes after
                    judged.append(certificate)
            self._write(judged)
        return judged

    def _known(self, files: Sequence[Path]) -> dict[str, Certificate]:
        """The rows of files that have not changed, by their names."""
        lines = read_text(self.path, LARGEST_TABLE).splitlines() if self.path.exists() else []
        if "".join(lines).strip() and lines[0].strip() != ",".join(Certificate.columns()):
            raise OutputError(f"{self.path}: is no table of certificates; --out says where else it is to be")
        try:
            stored = {each.file: each for each in _read(list(csv.DictReader(lines)))}
        except csv.Error:
            return {}
        digests = {file.name: self.statement.digest_of(file) for file in files if file.name in stored}
        return {name: stored[name] for name, digest in digests.items() if digest and digest == stored[name].digest}

    def _write(self, certificates: Sequence[Certificate]) -> None:
        """Write all rows in the order of the files' names."""
        ordered = sorted(certificates, key=lambda each: each.file)
        write_csv(self.path, Certificate.columns(), [each.row for each in ordered])


def _read(rows: Sequence[dict[str, str]]) -> Iterator[Certificate]:
    for row in rows:
        try:
            yield Certificate.from_row(row)
        except (ValueError, TypeError):  # cut short
            continue
