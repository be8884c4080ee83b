"""Exports of a motion, and kinds of files, by the names that Python code gives."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial

from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.exporting import DEFAULT_RATE, EXPORTS, export_motion
from tpbso_casadi.storage.run_folder import Writer

RATE = DEFAULT_RATE  # Hz


def chosen(argument: str, kinds: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Kinds of files, one alone or several.

    Raises:
        ValueError: there is no such kind; lists those that there are.
    """
    kinds = (kinds,) if isinstance(kinds, str) else tuple(kinds)
    unknown = next((kind for kind in kinds if kind not in known), None)
    if unknown is not None:
        raise ValueError(f"{argument}: there is no kind {unknown!r}; there are {', '.join(known)}")
    return kinds


def exports_of(motion: Motion, kinds: Sequence[str], rate: float = RATE) -> list[Writer]:
    """What writes each export, at a rate in Hz.

    Raises:
        ValueError: there is no such kind.
    """
    return [partial(export_motion, motion=motion, kind=kind, rate=rate) for kind in chosen("export", kinds, EXPORTS)]
