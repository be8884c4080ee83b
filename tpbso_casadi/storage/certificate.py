"""Certificates of motions as files, for others to check."""

from __future__ import annotations

import gzip
import io
import json
import zlib
from contextlib import suppress
from pathlib import Path

from problems.assembly import certificate_of, check_certifiable
from problems.base import InvalidProblem
from problems.certify import FORMAT
from tpbso_casadi.planning import JudgedMotion
from tpbso_casadi.scenario import Scenario
from tpbso_casadi.storage.files import OutputError, write_with, writing

HEAD, ZIPPED = 200, b"\x1f\x8b"  # bytes at the beginning: of a certificate, which say what it is; of a zipped file


def check_certificate(path: Path, scenario: Scenario) -> None:
    """Make sure before a motion is planned that there are certificates of such.

    Raises:
        OutputError: there are none.
        ScenarioError: the robot cannot do the task.
    """
    try:
        check_certifiable(scenario.judged())
    except InvalidProblem as error:
        raise OutputError(f"{path}: {error}") from error


def check_certificate_file(path: Path) -> None:
    """Make sure that nothing else than a certificate would be written over.

    Raises:
        OutputError: there is another file.
    """
    if not path.is_file():
        return
    data = path.read_bytes()[:HEAD]
    with suppress(OSError, EOFError, zlib.error):
        data = gzip.GzipFile(fileobj=io.BytesIO(path.read_bytes())).read(HEAD) if data[:2] == ZIPPED else data
    if FORMAT.encode() not in data:
        raise OutputError(f"{path}: is there already, and is no certificate")


def write_certificate(path: Path, motion: JudgedMotion) -> Path:
    """Write a certificate, JSON; zipped where the name ends with .gz.

    Args:
        path: of the file; its folder is made.
        motion: that is certified.

    Raises:
        OutputError: it is not certified, so that a certificate that was there is removed; there is none of such a
            motion, or the file cannot be written.
    """
    if not motion.feasible:
        path.unlink(missing_ok=True)  # it would be taken for one of this motion
        raise OutputError(f"{path}: no certificate: the motion is not certified")
    try:
        content = certificate_of(motion.criteria, motion.trajectory)
    except InvalidProblem as error:
        raise OutputError(f"{path}: {error}") from error
    data = json.dumps(content, allow_nan=False, separators=(",", ":"), ensure_ascii=False).encode()
    zipped = gzip.compress(data, mtime=0) if path.suffix == ".gz" else data
    with writing(path.parent):
        return write_with(path, lambda temporary: temporary.write_bytes(zipped))
