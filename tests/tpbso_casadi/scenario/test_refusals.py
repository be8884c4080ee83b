"""What is wrong with a scenario is one line that names its key, or, of a call in Python, its argument.

Types and bounds in general are those of ``problems/base/test_tables.py``. What is refused of keys, and of files that
are named, stands in ``helpers/refused.py`` and ``helpers/refused_files.py``; both front ends read it here.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.calls import in_python
from helpers.refused import BASES, FILES, IN_FILES, NO_CALL, OUT_OF_BOUNDS, REFUSED, WITH_FILES
from helpers.refused_files import NAMING, REFUSED_FILES, SCENES
from helpers.running import changed, line_of
from helpers.scenes import toml

import tpbso_casadi as tp
from tpbso_casadi.facade.arguments import as_argument
from tpbso_casadi.scenario import InputFolder, parse_scenario, read_scenario


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    for name, text in FILES.items():
        Path(name).write_text(text)


def content_of(base: str, changes: dict[str, Any]) -> dict[str, Any]:
    content = BASES[base]
    for key, value in changes.items():
        content = changed(content, key, value)
    return content


def refusal(content: dict[str, Any], read: Callable[[dict[str, Any]], tp.Scenario] = parse_scenario) -> str:
    """What is said of a scenario, or of its solver where all else is right."""

    def build() -> None:
        scenario = read(content)
        scenario.problem()
        scenario.solver.build()

    return line_of(build)


def check(line: str, expected: str) -> None:
    first, *others = (part.strip() for part in expected.split("... "))
    assert line.startswith(first) and all(other in line for other in others), f"{line}\nin place of\n{expected}"


def bounds(base: str) -> list[tuple[dict[str, Any], str]]:
    """Each value that is out of bounds, with the key that the line begins with."""
    return [({key: value}, key) for key, values in OUT_OF_BOUNDS.get(base, {}).items() for value in values]


def reader_of(base: str) -> Callable[[dict[str, Any]], tp.Scenario]:
    """A folder is there where files are named; else what names one says that it has not been read."""
    return lambda content: parse_scenario(content, InputFolder(Path()) if base in WITH_FILES else None)


@pytest.mark.parametrize("base", BASES)
def test_what_is_wrong_with_a_file_is_named_by_its_key(base: str) -> None:
    for changes, expected in REFUSED.get(base, []) + IN_FILES.get(base, []) + bounds(base):
        check(refusal(content_of(base, changes), reader_of(base)), expected)


@pytest.mark.parametrize("base", [base for base in BASES if base not in NO_CALL])
def test_what_is_wrong_with_a_call_is_named_by_its_argument(base: str) -> None:
    for changes, expected in REFUSED.get(base, []) + bounds(base):
        check(as_argument(refusal(content_of(base, changes), in_python)), as_argument(expected))


@pytest.mark.parametrize("kind", SCENES)
def test_what_is_wrong_with_a_file_that_is_named_is_said_of_scenarios_and_calls(kind: str) -> None:
    scene, named = SCENES[kind], Path("named.csv")
    Path("mine.toml").write_text(toml(**scene))
    for text, expected in [(None, "named.csv: cannot be read: No such file"), *REFUSED_FILES[kind]]:
        if text is not None:
            named.write_text(text)
        line = line_of(lambda: read_scenario(Path("mine.toml")).problem())
        assert expected in line and NAMING[kind] in line, f"{line}\nin place of\n{expected}"
        line = as_argument(refusal(scene, in_python))
        assert as_argument(expected) in line, f"{line}\nin place of\n{expected}"
