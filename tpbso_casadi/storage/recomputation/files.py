"""The files of a run folder beside ``result.json``: the table of the motion, and those that have a digest."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.scenario.input_files import read_text
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.motion_table import TORQUE, table_of
from tpbso_casadi.storage.recomputation.agreement import TOLERANCE, Contradiction
from tpbso_casadi.storage.run_folder import LARGEST_RESULT, SUFFIXES, digest_of


def check_table(path: Path, motion: Motion) -> None:
    """The rows of ``trajectory.csv`` are those of the motion; older ones have no torques.

    Raises:
        Contradiction: they are not, or cannot be read; the message begins with the file.
    """
    header, expected = table_of(motion, motion.times)
    try:
        stored_header, *rows = csv.reader(read_text(path, LARGEST_RESULT).splitlines())
        without = [name for name in header if not name.startswith(TORQUE)]
        if stored_header == without:
            header, expected = without, expected[:, : len(without)]
        if stored_header != header or len(rows) != len(expected) or {len(row) for row in rows} != {len(header)}:
            raise Contradiction(f"{path}: {expected.shape[0]} rows of {','.join(header)} are needed")
        stored = np.array(rows, dtype=np.float64)
    except ScenarioError as error:
        raise Contradiction(str(error)) from error
    except csv.Error as error:
        raise Contradiction(f"{path}: not a table of numbers: {error}") from error
    except Contradiction:
        raise
    except ValueError as error:
        raise Contradiction(f"{path}: not a table of numbers") from error
    away = np.abs(stored - expected) > TOLERANCE * np.maximum(1.0, np.abs(expected).max(axis=0))
    if away.any() or not np.isfinite(stored).all():
        row, column = np.argwhere(away | ~np.isfinite(stored))[0]
        raise Contradiction(
            f"{path} line {row + 2}: {header[column]} = {stored[row, column]!r} where the stored motion has "
            f"{expected[row, column]!r}"
        )


def check_files(folder: Path, digests: Mapping[str, str]) -> None:
    """The other files in a run folder are those that were written with it; one that was removed does not matter.

    Files of kinds that no run has, notes for example, do not matter either.

    Raises:
        Contradiction: one is not; the message begins with the file.
    """
    for path in sorted(folder.iterdir()):
        of_interest = path.name in digests or path.suffix in SUFFIXES
        if path.name == "result.json" or not of_interest:
            continue
        if not path.is_file() or path.is_symlink() or digest_of(path) != digests.get(path.name):
            raise Contradiction(f"{path}: is not of this run")
