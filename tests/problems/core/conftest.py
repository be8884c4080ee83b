"""Without a compiler, and in a package that came without libraries, there is no core to test."""

from __future__ import annotations

import pytest

from problems.core import core_library


@pytest.fixture(scope="session", autouse=True)
def there_is_a_core() -> None:
    if core_library() is None:
        pytest.skip("there is no compiled core, and no compiler that makes one")
