"""What is kept of a program's structure: equal names mean equal C++, and a second process writes none."""

from __future__ import annotations

from pathlib import Path

import pytest

from problems.evaluation import EvaluationOptions, PopulationFunction, Program, structure
from problems.evaluation.codegen import cpp
from problems.evaluation.kernel import kernels
from problems.evaluation.native import name_of
from problems.evaluation.structure import ProgramStructure
from tests.helpers.evaluation import needs_compiler, points, same_bits, small
from tpbso_casadi.scenario import builtin, read_scenario
from tpbso_casadi.scenario.cases import TITLES

EXAMPLES = Path(__file__).parents[3] / "examples"
pytestmark = pytest.mark.usefixtures("cache_folder")


def programs() -> dict[str, Program]:
    """Of the built-in scenarios and of examples, each also with other numbers."""
    files = {name: read_scenario(EXAMPLES / f"{name}.toml") for name in ("jerk-limited", "energy")}
    named = {**{name: builtin(name) for name in TITLES}, **files}
    return {name: scenario.problem().program for name, scenario in named.items() if scenario.task.is_searched}


@pytest.mark.slow
def test_equal_names_mean_equal_sources() -> None:
    sources: dict[str | None, set[str]] = {}
    for program in programs().values():
        for each in (program, program.with_numbers(program.parameters + 1.0)):
            known = ProgramStructure(each)
            source = cpp(kernels(each), each.sizes)
            sources.setdefault(known.key, set()).add(source)
            assert known.source_name == name_of(source)
            assert ProgramStructure(each).source_name == name_of(source)  # as it is kept
    assert None not in sources
    assert all(len(texts) == 1 for texts in sources.values())
    assert len({*sources}) == len(set().union(*sources.values()))


@needs_compiler
def test_where_a_library_is_found_no_kernel_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = PopulationFunction(small(), EvaluationOptions("native"))(points())

    def fail(*_: object) -> None:
        pytest.fail("made again")

    monkeypatch.setattr(structure, "kernels", fail)
    monkeypatch.setattr(structure, "cpp", fail)
    again = PopulationFunction(small(), EvaluationOptions("native"))
    assert same_bits(again(points()), expected)
    assert again.backend == "native"
