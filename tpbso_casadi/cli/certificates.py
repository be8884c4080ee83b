"""The certificates of many trajectories: a table that grows on disk, so that it is resumed, and on the terminal."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from rich.text import Text

from tpbso_casadi.display.console import OutputConsole, number, prose, table_of, word
from tpbso_casadi.facade.certifying_many import Certificate, Statement
from tpbso_casadi.scenario import read_text
from tpbso_casadi.storage import OutputError, check_file, check_writable, write_csv, writing

TABLE = "certificates.csv"
LISTED = 40  # certificates on the terminal, those that are not proven first
LARGEST_TABLE = 100_000_000  # bytes


@dataclass(frozen=True)
class CertificateTable:
    """A CSV file of certificates.

    Args:
        path: of the file.
        statement: by which the files are judged; rows by another one are not kept.
    """

    path: Path
    statement: Statement

    def check(self) -> None:
        """Make sure before anything is judged that it can be written.

        Raises:
            OutputError: it cannot, or there is another one.
            ScenarioError: what is there cannot be read.
        """
        check_writable(self.path.parent)
        check_file(self.path)
        content = read_text(self.path, LARGEST_TABLE) if self.path.exists() else ""
        if content.strip() and content.partition("\n")[0].strip() != ",".join(Certificate.columns()):
            raise OutputError(f"{self.path}: is no table of certificates; --out says where else it is to be")

    def known(self, files: Sequence[Path]) -> dict[str, Certificate]:
        """The rows of files that have not changed, by their names."""
        try:
            rows = list(csv.DictReader(read_text(self.path, LARGEST_TABLE).splitlines())) if self.path.exists() else []
        except csv.Error:
            return {}
        stored = {each.file: each for each in _read(rows)}
        digests = {file.name: self.statement.digest_of(file) for file in files if file.name in stored}
        return {name: stored[name] for name, digest in digests.items() if digest and digest == stored[name].digest}

    @contextmanager
    def growing(self, known: Sequence[Certificate]) -> Iterator[IO[str]]:
        """The file with the rows that are known, to which others are added.

        Raises:
            OutputError: it cannot be written.
        """
        with writing(self.path.parent):
            self.write(known)
            with self.path.open("a", encoding="utf-8", newline="") as file:
                yield file

    def write(self, certificates: Sequence[Certificate]) -> None:
        """Write all rows in the order of the files' names.

        Raises:
            OutputError: it cannot be written.
        """
        ordered = sorted(certificates, key=lambda each: each.file)
        with writing(self.path.parent):
            write_csv(self.path, Certificate.columns(), [each.row for each in ordered])


def add_row(file: IO[str], certificate: Certificate) -> None:
    """Add a row at once: what was judged is kept, whatever comes after."""
    csv.writer(file, lineterminator="\n").writerow(certificate.row)
    file.flush()


def _read(rows: Sequence[dict[str, str]]) -> Iterator[Certificate]:
    for row in rows:
        try:
            yield Certificate.from_row(row)
        except (ValueError, TypeError):  # cut short
            continue


def print_certificates(certificates: Sequence[Certificate], console: OutputConsole) -> None:
    """How many there are of each, and those that are not proven first."""
    table = table_of(word("file"), number("T, s"), number("ms"), word(""), prose("what is not proven"))
    proven_last = sorted(certificates, key=lambda each: (not (each.broken or each.reason), each.file))
    for each in proven_last[:LISTED]:
        times = ["" if value is None else f"{value:.4g}" for value in (each.duration, _milliseconds(each))]
        table.add_row(Text(each.file), *times, Text(each.in_words), Text(each.worst or each.reason))
    counts = Counter(each.in_words for each in certificates)
    console.print_table(", ".join(f"{count} {status}" for status, count in counts.most_common()), table)
    if len(certificates) > LISTED:
        console.say(f"and {len(certificates) - LISTED} more in the table")


def _milliseconds(certificate: Certificate) -> float | None:
    return None if certificate.seconds is None else 1e3 * certificate.seconds
