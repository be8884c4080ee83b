"""Certificates of motions as files, for others to check."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

from problems.assembly import certificate_of
from problems.base import InvalidProblem
from tpbso_casadi.planning import Motion
from tpbso_casadi.storage.files import OutputError, write_with, writing


def write_certificate(path: Path, motion: Motion) -> Path:
    """Write a certificate, JSON; zipped where the name ends with .gz.

    Args:
        path: of the file; its folder is made.
        motion: that is certified.

    Raises:
        OutputError: it is not certified, there is no certificate of such a motion, or the file cannot be written.
    """
    if not motion.feasible:
        raise OutputError(f"{path}: no certificate: the motion is not certified")
    try:
        content = certificate_of(motion.criteria, motion.trajectory)
    except InvalidProblem as error:
        raise OutputError(f"{path}: {error}") from error
    data = json.dumps(content, allow_nan=False, separators=(",", ":"), ensure_ascii=False).encode()
    zipped = gzip.compress(data, mtime=0) if path.suffix == ".gz" else data
    with writing(path.parent):
        return write_with(path, lambda temporary: temporary.write_bytes(zipped))
