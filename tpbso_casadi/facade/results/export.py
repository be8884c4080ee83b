"""Exports of a motion by the names that Python code gives."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.exporting import EXPORTS, export_motion
from tpbso_casadi.storage.run_folder import Writer


def exports_of(motion: Motion, kinds: Sequence[str]) -> list[Writer]:
    """What writes each export.

    Raises:
        ValueError: there is no such kind; lists those that there are.
    """
    kinds = [kinds] if isinstance(kinds, str) else kinds
    unknown = next((kind for kind in kinds if kind not in EXPORTS), None)
    if unknown is not None:
        raise ValueError(f"export: there is no kind {unknown!r}; there are {', '.join(EXPORTS)}")
    return [partial(export_motion, motion=motion, kind=kind) for kind in kinds]
