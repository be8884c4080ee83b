"""Whether stored numbers are those that a recomputation gives."""

from __future__ import annotations

import numpy as np
import pytest

from tpbso_casadi.storage.recomputation import Contradiction, agree


@pytest.mark.parametrize(("stored", "computed"), [(1.0, 1.0 + 1e-10), (0.0, 0.0), (None, np.inf), (None, np.nan)])
def test_what_agrees(stored: float | None, computed: float) -> None:
    agree("key", stored, computed)


@pytest.mark.parametrize(
    ("stored", "computed"),
    [(1.0, 1.0 + 1e-8), (None, 1.0), (99.0, np.inf), (-99.0, np.inf), (1.0, -np.inf), (1.0, np.nan)],
)
def test_what_does_not(stored: float | None, computed: float) -> None:
    """No number is infinite to some tolerance."""
    with pytest.raises(Contradiction, match=r"^key: .* is stored, .* is computed$"):
        agree("key", stored, computed)
    with pytest.raises(Contradiction, match=r"^key: "):
        agree("key", stored, computed, scale=0.5, tolerance=1e-9)
