"""Exports of a motion, and kinds of files, by the names that Python code gives."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import partial

from tpbso_casadi.facade.arguments.messages import in_words_of_python
from tpbso_casadi.facade.arguments.values import positive
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.scenario.validation import shown
from tpbso_casadi.storage.exporting import DEFAULT_RATE, EXPORTS, equal_steps, export_motion
from tpbso_casadi.storage.run_folder import Writer

RATE = DEFAULT_RATE  # Hz


def chosen(argument: str, kinds: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Kinds of files, one alone or several.

    Raises:
        ValueError: there is no such kind; lists those that there are.
    """
    if not isinstance(kinds, Iterable):
        raise ValueError(f"{argument}: kinds are needed, of {', '.join(known)}, or () for none; not {shown(kinds)}")
    kinds = (kinds,) if isinstance(kinds, str) else tuple(kinds)
    unknown = next((kind for kind in kinds if not isinstance(kind, str) or kind not in known), None)
    if unknown is not None:
        raise ValueError(f"{argument}: there is no kind {unknown!r}; there are {', '.join(known)}")
    return kinds


def exports_of(motion: Motion, kinds: Sequence[str], rate: float = RATE) -> list[Writer]:
    """What writes each export, at a rate in Hz.

    Raises:
        ValueError: there is no such kind, or the rate is no number above 0.
        OutputError: it makes too many rows.
    """
    hertz, exports = positive("rate", rate, "Hz"), chosen("export", kinds, EXPORTS)
    if exports:
        with in_words_of_python():
            equal_steps(motion, hertz)
    return [partial(export_motion, motion=motion, kind=kind, rate=hertz) for kind in exports]
