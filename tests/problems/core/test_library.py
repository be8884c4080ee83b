"""The compiled core as a library: its source, and what there is without it."""

from __future__ import annotations

import ctypes
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.core_robots import SCENE, postures, robot_of

from problems.core import Kept
from problems.core.compiled import CompiledCore
from problems.core.description import described
from problems.core.interface import Core
from problems.core.library import FILES, FLAGS, SIGNATURES, SOURCES, SWITCH, core_library, source
from problems.core.world import known_robot
from problems.evaluation import usable_compiler

ROOT = Path(__file__).parents[3]


def bodies() -> dict[str, str]:
    """Of each file what it says itself."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in sorted(SOURCES.glob("*.[ch]pp"))}
    own = r'#pragma once\n|#include "\w+\.hpp"\n'
    return {name: max(re.split(own, text), key=len) for name, text in texts.items()}


def test_every_file_is_in_the_joined_source_once() -> None:
    text = source()
    assert set(FILES) <= set(bodies())
    assert {name: text.count(body) for name, body in bodies().items()} == dict.fromkeys(bodies(), 1)
    assert '#include "' not in text and "#pragma once" not in text


def test_what_a_file_includes_of_ours_is_there() -> None:
    for path in SOURCES.glob("*.[ch]pp"):
        for name in re.findall(r'#include "([^"]+)"', path.read_text(encoding="utf-8")):
            assert (SOURCES / name).is_file(), f"{path.name}: {name}"


@pytest.fixture
def library() -> ctypes.CDLL:
    found = core_library()
    if found is None:
        pytest.skip("there is no compiled core, and no compiler that makes one")
    return found


def test_functions_that_python_calls_are_defined(library: ctypes.CDLL) -> None:
    assert all(hasattr(library, name) for name in SIGNATURES)
    defined = re.findall(r"\b(core_\w+)\(", re.sub(r"//.*", "", source()))
    assert set(defined) == set(SIGNATURES)


def test_this_processor_has_a_variant(library: ctypes.CDLL) -> None:
    assert library.core_variant() in (0, 1, 2)


def without_a_core(code: str) -> None:
    """Run code in a process in which the core is switched off."""
    places = os.pathsep.join(map(str, (ROOT, ROOT / "tests")))
    subprocess.run(
        [sys.executable, "-c", code], check=True, timeout=300, cwd=ROOT,
        env=os.environ | {SWITCH: "off", "PYTHONPATH": places},
    )  # fmt: skip


PLANNED = """
from helpers.space_scenarios import space_scenario
from problems.core import core
from solvers import StopReason
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario

assert core().name == "NumPy"
found = plan(parse_scenario(space_scenario(solver={"name": "ladder", "evaluations": 300})))
assert found.motion.feasible
assert found.search.evaluations == 0, found.search.evaluations
"""


def test_switched_off_numpy_answers_and_the_ladder_plans_all_the_same() -> None:
    without_a_core(PLANNED)


def variant(folder: Path, name: str, *flags: str) -> ctypes.CDLL:
    path = folder / f"{name}.so"
    path.write_bytes(usable_compiler().library(source(), (*FLAGS, *flags)))
    library = ctypes.CDLL(str(path))
    for function, (result, arguments) in SIGNATURES.items():
        getattr(library, function).restype, getattr(library, function).argtypes = result, arguments
    return library


@pytest.mark.process
def test_without_the_instructions_of_this_processor_the_same_numbers_are_computed(
    tmp_path: Path, compiled: Core
) -> None:
    robot = robot_of("upright")
    told, theta = described(robot, known_robot(robot), SCENE), postures(robot, np.random.default_rng(1), 50)
    worlds = [each.world(*told) for each in (compiled, CompiledCore(variant(tmp_path, "portable")))]
    rooms = [np.full(50, np.inf), np.full(50, np.inf)]
    for world, found in zip(worlds, rooms, strict=True):
        world.lower_to_rooms(theta, found, Kept.ALL, False)
    np.testing.assert_array_equal(*rooms)
    near, same = (world.nearest(theta, 0.1, Kept.ALL) for world in worlds)
    np.testing.assert_array_equal(near.rooms, same.rooms)
    np.testing.assert_array_equal(near.gradients, same.gradients)
