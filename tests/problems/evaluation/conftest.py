"""What is compiled in the tests of evaluation is compiled once, though every test has an empty cache."""

from __future__ import annotations

import pytest

from problems.evaluation.compiler import Compiler


@pytest.fixture(scope="session")
def libraries() -> dict[tuple[Compiler, str], bytes]:
    return {}


@pytest.fixture
def compiled_once(libraries: dict[tuple[Compiler, str], bytes], monkeypatch: pytest.MonkeyPatch) -> None:
    """A source that a compiler has compiled before is not given to it again."""
    library = Compiler.library

    def remembered(compiler: Compiler, source: str) -> bytes:
        if (compiler, source) not in libraries:
            libraries[compiler, source] = library(compiler, source)
        return libraries[compiler, source]

    monkeypatch.setattr(Compiler, "library", remembered)
