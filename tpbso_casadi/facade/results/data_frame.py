"""Tables for pandas, which is optional."""

from __future__ import annotations

from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

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
