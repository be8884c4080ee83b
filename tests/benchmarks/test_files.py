"""Files of problems, robots and spheres: what is read, and what is wrong with them in one line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.motion_bench_maker.limits import PANDA, limits_of
from benchmarks.motion_bench_maker.problem_file import InvalidFile, chosen, read_problems
from benchmarks.motion_bench_maker.setting import Setting

WRONG: list[tuple[dict[str, Any], str]] = [
    ({"name": ...}, "name: is missing"),
    ({"name": 3}, "name: is not a name"),
    ({"start": [0.0, "a"]}, "start: is not a list of numbers"),
    ({"goal": [0.0]}, "goal: 1 angles where start has 3"),
    ({"obstacles": {}}, "obstacles: is not a list"),
    ({"obstacles": [3]}, "obstacle 1: shape: is missing"),
    ({"shape": "cone"}, "obstacle 1: shape: 'cone' is neither box nor cylinder"),
    ({"quaternion": [0, 0, 0, 2]}, "obstacle 1: quaternion: is not of length 1"),
    ({"position": [0, 0]}, "obstacle 1: position: is not 3 numbers"),
    ({"size": [1, 1, 0]}, "obstacle 1: its sizes are not all positive"),
    ({"size": ...}, "obstacle 1: size: is missing"),
]


def test_what_is_wrong_with_a_problem_is_said(folder: Path) -> None:
    path = folder / "wrong.jsonl"
    for change, reason in WRONG:
        problem = json.loads((folder / "small.jsonl").read_text())
        for key, value in change.items():
            table = problem if key in problem else problem["obstacles"][0]
            table[key] = value
            if value is ...:
                del table[key]
        path.write_text("\n" + json.dumps(problem))
        with pytest.raises(InvalidFile) as error:
            read_problems(path)
        assert str(error.value) == f"{path}: line 2: {reason}"


def test_the_first_of_each_class_are_chosen(folder: Path) -> None:
    problem = json.loads((folder / "small.jsonl").read_text())
    names = ["table_small-0001", "table_small-0002", "cage_small-0001"]
    (folder / "three.jsonl").write_text("\n".join(json.dumps(problem | {"name": name}) for name in names))
    problems = read_problems(folder / "three.jsonl")
    assert [one.name for one in chosen(problems, 1, None)] == ["table_small-0001", "cage_small-0001"]
    assert [one.name for one in chosen(problems, None, "0002")] == ["table_small-0002"]


def test_frames_are_those_computed_by_hand(setting: Setting) -> None:
    kinematics = setting.kinematics
    assert kinematics.names == ("turn", "lift", "roll")
    assert kinematics.bodies["finger"][0] == 3
    upright = kinematics.pose(np.array([0.0, np.pi / 2.0, 0.0]), "tool0")
    assert upright[:3, 3] == pytest.approx([1.0, 0.0, 2.0])
    aside = kinematics.pose(np.array([np.pi / 2.0, 0.0, np.pi / 2.0]), "finger")
    assert aside[:3, 3] == pytest.approx([0.1, 2.5, 0.5])


def test_limits_are_given_once_for_each_joint_or_for_all(setting: Setting) -> None:
    assert setting.limits.acceleration == (5.0, 5.0, 5.0)
    assert limits_of(setting.kinematics, (1.0, 2.0, 3.0)).acceleration == (1.0, 2.0, 3.0)
    assert len(PANDA[0]) == len(PANDA[1]) == 7
    for wrong in ((1.0, 2.0), (1.0, 2.0, 0.0)):
        with pytest.raises(InvalidFile, match="--max-jerk"):
            limits_of(setting.kinematics, None, wrong)


def test_a_digest_is_of_robot_limits_and_problem(folder: Path, setting: Setting) -> None:
    (problem,) = read_problems(folder / "small.jsonl")
    digest = setting.digest(problem)
    assert Setting(setting.urdf, setting.spheres_file, (5.0,), (50.0,)).digest(problem) == digest
    slower = Setting(setting.urdf, setting.spheres_file, (4.0,), (50.0,))
    others = slower.digest(problem), setting.digest(replace(problem, goal=(0.5, 0.5, 0.0)))
    assert len({digest, *others}) == 3
