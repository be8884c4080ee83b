"""Results as data frames and files: what a call may ask for, checked."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from problems.base import shown_value
from tpbso_casadi.facade.arguments import in_words_of_python, positive
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.programs import EXPORTERS, exporter_at
from tpbso_casadi.storage import Writer

if TYPE_CHECKING:
    import pandas as pd


def data_frame(content: Any) -> pd.DataFrame:
    """A data frame of columns by name, or of rows.

    Raises:
        ImportError: pandas is not installed; says how to install it.
    """
    if find_spec("pandas") is None:
        raise ImportError("a data frame needs the package pandas: pip install 'tpbso-casadi[pandas]'")
    import pandas as pd  # noqa: PLC0415 (optional, and slow to load)

    return pd.DataFrame(content)


def chosen(argument: str, kinds: Sequence[str], known: Collection[str]) -> tuple[str, ...]:
    """Kinds of files, one alone or several.

    Raises:
        ValueError: there is no such kind; lists those that there are.
    """
    if not isinstance(kinds, Iterable):
        raise ValueError(
            f"{argument}: kinds are needed, of {', '.join(known)}, or () for none; not {shown_value(kinds)}"
        )
    kinds = (kinds,) if isinstance(kinds, str) else tuple(kinds)
    unknown = next((kind for kind in kinds if not isinstance(kind, str) or kind not in known), None)
    if unknown is not None:
        raise ValueError(f"{argument}: there is no kind {unknown!r}; there are {', '.join(known)}")
    return kinds


def exports_of(plan: PlannedMotion, kinds: Sequence[str], rate: float | None = None) -> list[Writer]:
    """The writers of exports, at a rate in Hz where one is stated.

    Raises:
        ValueError: there is no such kind, or the rate is no number above 0.
        OutputError: it makes too many rows.
    """
    hertz = None if rate is None else positive("rate", rate, "Hz")
    exports = chosen("export", kinds, EXPORTERS.names())
    with in_words_of_python():
        return [exporter_at(kind, hertz).program(plan).write for kind in exports]
