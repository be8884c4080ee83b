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

from problems.core import World, core_library
from problems.core.library import FILES, FLAGS, SIGNATURES, SOURCES, SWITCH, source
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


def test_functions_that_python_calls_are_defined() -> None:
    library = core_library()
    assert library is not None
    assert all(hasattr(library, name) for name in SIGNATURES)
    defined = re.findall(r"\b(core_\w+)\(", re.sub(r"//.*", "", source()))
    assert set(defined) == set(SIGNATURES)


def test_this_processor_has_a_variant() -> None:
    library = core_library()
    assert library is not None
    assert library.core_variant() in (0, 1, 2)


def without_a_core(code: str) -> None:
    """Run code in a process in which the core is switched off."""
    places = os.pathsep.join(map(str, (ROOT, ROOT / "tests")))
    subprocess.run(
        [sys.executable, "-c", code], check=True, timeout=300, cwd=ROOT,
        env=os.environ | {SWITCH: "off", "PYTHONPATH": places},
    )  # fmt: skip


PLANNED = """
from helpers.core_robots import SCENE, robot_of
from helpers.space_scenarios import space_scenario
from problems.core import World, core_library
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario

assert core_library() is None
assert World.of(robot_of("upright"), SCENE) is None
assert plan(parse_scenario(space_scenario(solver={"evaluations": 300}))).motion.feasible
"""


def test_switched_off_there_is_no_world_and_plans_are_certified_all_the_same() -> None:
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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    portable, robot = variant(tmp_path, "portable"), robot_of("upright")
    theta = postures(robot, np.random.default_rng(1), 50)
    native = World(robot, SCENE)
    monkeypatch.setattr("problems.core.world.core_library", lambda: portable)
    other = World(robot, SCENE)
    np.testing.assert_array_equal(other.rooms(theta), native.rooms(theta))
    near, same = other.nearby(theta, 0.1), native.nearby(theta, 0.1)
    np.testing.assert_array_equal(near.rooms, same.rooms)
    np.testing.assert_array_equal(near.gradients, same.gradients)
