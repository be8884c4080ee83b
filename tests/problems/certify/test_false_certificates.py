"""Attempts at a certificate that is false and accepted; at files that are none."""

from __future__ import annotations

import gzip
import json
import shutil
import subprocess
import sys
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.certificates import case

from problems.certify import check_certificate as checker

Content = dict[str, Any]


def changed(content: Content, *path: Any, value: Any) -> Content:
    """The content with another value at a place; a function makes it of the one that is there."""
    new = deepcopy(content)
    place = new
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value(place[path[-1]]) if callable(value) else value
    return new


def outcome(content: Any) -> str:
    """What the checker says: accepted, or why not."""
    try:
        checker.check(content)
    except (checker.RefusedError, checker.NoCertificateError) as error:
        return f"{type(error).__name__[:7]}: {error}"
    return "accepted"


@pytest.fixture(scope="module")
def content() -> Content:
    return case("sliding").content


def test_as_it_is_it_is_accepted(content: Content) -> None:
    assert outcome(content) == "accepted"
    assert outcome(json.loads(json.dumps(content))) == "accepted"


@pytest.mark.parametrize("name", ["upright", "sliding"])
@pytest.mark.parametrize("key", ["obstacles", "own"])
def test_no_cell_of_any_pair_can_be_left_out(name: str, key: str) -> None:
    made = case(name).content
    items = [(i, k) for i, item in enumerate(made["proof"][key]) for k in range(len(item[2]))]
    for place in np.random.default_rng(5).permutation(len(items))[:25]:
        i, k = items[place]
        less = changed(made, "proof", key, i, 2, value=lambda cells, k=k: [*cells[:k], *cells[k + 1 :]])
        assert "no cell holds t = " in outcome(less)
    assert "no cell holds" in outcome(changed(made, "proof", key, value=[]))
    assert "no cell holds" in outcome(changed(made, "proof", key, value=lambda rows: rows[1:]))


def test_cells_that_are_longer_than_what_they_prove_are_refused(content: Content) -> None:
    """One for each piece holds all the time, but the bound in it does not hold."""
    everything = content["motion"]["breakpoints"][1]
    whole = [[0, 0.0, everything], [1, 0.0, content["motion"]["breakpoints"][2] - everything]]
    rows = [[*item[:2], [0, 1]] for item in content["proof"]["obstacles"]]
    proof = {**content["proof"], "cells": whole, "obstacles": rows, "own": []}
    assert outcome(changed(content, "proof", value=proof)).startswith("Refused: clearance of ")


NUMBERS = [
    ("robot", "margin"),
    ("robot", "links", 1, "balls", 0, 3),
    ("robot", "joints", 0, "speed"),
    ("robot", "joints", 1, "axis", 2),
    ("obstacles", 0, "center", 1),
    ("obstacles", 1, "velocity", 0),
    ("motion", "breakpoints", 1),
    ("motion", "coefficients", 0, 1, 2),
    ("tolerances", "limits"),
    ("ends", "goal", "position", 0),
    ("proof", "cells", 3, 1),
    ("proof", "obstacles", 0, 0),
]
NONE = [float("nan"), float("inf"), -float("inf"), 10**400, -(10**230), "1", True, [1.0], None, {}]


@pytest.mark.parametrize("path", NUMBERS, ids=str)
@pytest.mark.parametrize(
    "value", [float("nan"), float("inf"), -float("inf"), 10**400, -(10**30), "1", True, [1.0], None, {}]
)
def test_what_is_no_number_is_no_certificate(content: Content, path: tuple[Any, ...], value: Any) -> None:
    if value is None and path[-1] == "speed":
        return  # no limit
    assert outcome(changed(content, *path, value=value)).startswith(("NoCerti: ", "Refused: "))


FAULTS: list[tuple[tuple[Any, ...], Any, str]] = [
    (("format",), "another", "format"),
    (("version",), 2, "version"),
    (("version",), True, "version"),
    (("robot", "margin"), -0.01, "no negative"),
    (("robot", "own_margin"), -1e-12, "no negative"),
    (("robot", "tracking_error", 0), -0.1, "no negative"),
    (("robot", "tracking_error"), [], "one of each joint"),
    (("robot", "joints", 0, "speed"), -1.0, "no negative"),
    (("robot", "joints", 0, "axis"), [0.0, 0.0, 0.5], "of length 1"),
    (("robot", "joints", 0, "axis"), [0.0, 0.0, 0.0], "of length 1"),
    (("robot", "joints", 0, "rotation"), [-1.0, 0, 0, 0, 1, 0, 0, 0, 1], "a rotation"),
    (("robot", "joints", 0, "rotation"), [0.0] * 9, "a rotation"),
    (("robot", "joints", 0, "turns"), 1, "bool"),
    (("robot", "joints"), [], "one"),
    (("robot", "links", 0, "balls", 0, 3), -0.5, "no negative"),
    (("robot", "links", 0, "balls", 0, 3), 0.0, "no negative"),
    (("robot", "links", 0, "balls"), [], "a tree"),
    (("robot", "links", 2, "balls", 0, 4), 1, "a tree"),
    (("robot", "links", 2, "balls", 0, 4), 2.5, "whole number"),
    (("robot", "links", 0, "body"), 9, "whole number"),
    (("robot", "links", 0, "body"), -1, "whole number"),
    (("robot", "own_pairs", 0), [1, 1], "a joint between"),
    (("robot", "own_pairs", 0), [0, 10**6], "whole number"),
    (("may_touch",), [[0, 99]], "whole number"),
    (("may_touch",), [[-1, 0]], "whole number"),
    (("obstacles", 0, "shape"), "torus", "one of"),
    (("obstacles", 0, "sizes"), [-0.1] * 3, "what the shape has"),
    (("obstacles", 0, "sizes"), [0.1], "what the shape has"),
    (("obstacles", 0, "rotation"), [2.0, 0, 0, 0, 1, 0, 0, 0, 1], "a rotation"),
    (("obstacles", 0, "growth"), -1.0, "no negative"),
    (("obstacles",), {}, "a list"),
    (("motion", "breakpoints"), [0.0, 2.0, 1.0], "rises"),
    (("motion", "breakpoints"), [-1.0, 0.0, 1.0], "rises"),
    (("motion", "breakpoints"), [], "rises"),
    (("motion", "coefficients"), [], "each joint"),
    (("ends", "goal", "velocity"), [0.0], "one number of each joint"),
    (("tolerances", "position"), 1.0, "no more than"),
    (("tolerances", "limits"), -1.0, "no more than"),
    (("not_covered",), ["two\nlines"], "one line"),
    (("proof", "cells", 0), [0, 0.5, 0.1], "begins before it ends"),
    (("proof", "cells", 0), [0, 0.0, 1e5], "within its piece"),
    (("proof", "cells", 0), [7, 0.0, 0.1], "whole number"),
    (("proof", "cells", 0), [0, -0.1, 0.1], "begins before"),
    (("proof", "obstacles", 0, 2), [10**5], "whole number"),
    (("proof", "obstacles", 0, 2), [-1], "whole number"),
    (("proof", "obstacles", 0), [0, 0], "a list"),
    (("proof", "own", 0, 0), -3, "whole number"),
]


@pytest.mark.parametrize(("path", "value", "reason"), FAULTS, ids=lambda part: str(part)[:40])
def test_faults_are_named(content: Content, path: tuple[Any, ...], value: Any, reason: str) -> None:
    said = outcome(changed(content, *path, value=value))
    assert said.startswith("NoCerti: ")
    assert reason in said


@pytest.mark.parametrize("path", [("robot",), ("robot", "joints", 0), ("obstacles", 0), ("motion",), ("proof",), ()])
def test_keys_are_those_of_the_format_and_no_others(content: Content, path: tuple[Any, ...]) -> None:
    place = content
    for key in path:
        place = place[key]
    for key in place:
        less = deepcopy(content)
        inner = less
        for part in path:
            inner = inner[part]
        del inner[key]
        assert "an object with the keys" in outcome(less)
        inner[key], inner[f"{key} "] = 0, 0
        assert "an object with the keys" in outcome(less)


def _leaves(part: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where all values are, objects and lists themselves included."""
    inner = part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ()
    return [path, *(leaf for key, value in inner for leaf in _leaves(value, (*path, key)))]


def test_whatever_stands_anywhere_nothing_else_is_raised(content: Content) -> None:
    rng, places = np.random.default_rng(7), _leaves(content)[1:]
    outer = [path for path in places if len(path) <= 3]
    chosen = [*outer, *(places[k] for k in rng.integers(len(places), size=200))]
    values = [None, "x", [], {}, -1, 1e9, 0, True, [[]], [0.0], 3, 10**400]
    said = [outcome(changed(content, *path, value=values[rng.integers(len(values))])) for path in chosen]
    assert sum(line.startswith("NoCerti: ") for line in said) > 0.7 * len(said)


REFUSALS: list[tuple[tuple[Any, ...], Any, str]] = [
    (("robot", "links", 2, "balls", 0, 3), lambda r: 0.9 * r, "is not within ball 0"),
    (("robot", "links", 2, "balls", 1, 0), lambda x: x + 0.4, "is not within ball 0"),
    (("robot", "joints", 0, "speed"), lambda v: 0.01 * v, "speed of one"),
    (("robot", "joints", 0, "acceleration"), lambda v: 0.01 * v, "acceleration of one"),
    (("robot", "joints", 2, "range"), [-0.01, 0.01], "joint range of three"),
    (("robot", "tracking_error", 0), 5.0, "joint range of one"),
    (("robot", "margin"), 0.5, "clearance"),
    (("robot", "own_margin"), 0.5, "self clearance"),
    (("ends", "goal", "position", 0), lambda q: q + 1e-6, "position at the goal"),
    (("ends", "start", "position", 3), lambda q: q - 1e-6, "position at the start"),
    (("ends", "start", "velocity", 0), 1e-3, "speed at the start"),
    (("motion", "coefficients", 1, 0, 0), lambda c: c + 1e-6, "position at the goal"),
    (("motion", "coefficients", 0, 0, 4), lambda c: c + 1e-4, "position jumps"),
    (("obstacles", 0, "sizes"), lambda s: [10.0 * part for part in s], "clearance"),
    (("obstacles", 0, "velocity"), [0.0, 0.0, 100.0], "clearance"),
    (("obstacles", 0, "growth"), 10.0, "clearance"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("path", "value", "reason"), REFUSALS, ids=lambda part: "changed" if callable(part) else str(part)[:40]
)
def test_other_numbers_are_refused(content: Content, path: tuple[Any, ...], value: Any, reason: str) -> None:
    said = outcome(changed(content, *path, value=value))
    assert said.startswith("Refused: ")
    assert reason in said


def test_an_obstacle_in_the_way_is_found_whatever_the_hints_say() -> None:
    """Normals and edges of a polytope, which are hints, may be anything: bounds get worse, not wrong."""
    made = case("sliding").content
    place = next(k for k, obstacle in enumerate(made["obstacles"]) if obstacle["shape"] in ("capsule", "box"))
    center = made["obstacles"][place]["center"]
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * 3.0
    solid = {**made["obstacles"][place], "shape": "polytope", "sizes": [], "center": center, "points": corners.tolist()}
    for normals, edges in (([], []), ([[0.0, 0.0, 0.0]], [[0, 0]]), ([[1e5, 0.0, 0.0], [0.0, -1e-5, 1e-5]], [[0, 7]])):
        wrong = changed(made, "obstacles", place, value={**solid, "normals": normals, "edges": edges})
        assert outcome(wrong).startswith("Refused: clearance")


def test_a_limit_of_torque_needs_masses(content: Content) -> None:
    assert "robot.dynamics" in outcome(changed(content, "robot", "joints", 0, "torque", value=5.0))


# Files


def run(path: Path) -> int:
    return checker.main([str(path)])


def test_a_file_is_accepted_zipped_or_not(tmp_path: Path, content: Content, capsys: pytest.CaptureFixture[str]) -> None:
    plain, zipped = tmp_path / "c.json", tmp_path / "c.json.gz"
    data = json.dumps({**content, "not_covered": ["own constraint x"]}).encode()
    plain.write_bytes(data)
    zipped.write_bytes(gzip.compress(data))
    assert (run(plain), run(zipped)) == (0, 0)
    lines = capsys.readouterr().out.splitlines()
    assert "not in this certificate: own constraint x" in lines
    assert lines[-1].startswith("accepted: all that is claimed is proven")
    assert any(line.startswith("assumed: bodies are rigid") for line in lines)


def test_a_refusal_is_one_line(tmp_path: Path, content: Content, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps(changed(content, "robot", "joints", 0, "speed", value=0.001)))
    assert run(path) == 1
    assert capsys.readouterr().out.startswith("refused: speed of one, t = ")


def test_what_is_left_out_is_said(tmp_path: Path, content: Content, capsys: pytest.CaptureFixture[str]) -> None:
    """Pairs that need not keep clear, links that need not keep apart, limits that are not stated."""
    robot = changed(content, "robot", "own_pairs", value=[])
    less = changed(changed(robot, "robot", "joints", 0, "speed", value=None), "may_touch", value=[[2, 1]])
    path = tmp_path / "c.json"
    path.write_text(json.dumps({**less, "proof": {**less["proof"], "own": []}}))
    assert run(path) == 0
    said = capsys.readouterr().out
    assert "none is stated for one\n" in said
    assert f"not of arm and {content['obstacles'][1]['name']}\n" in said
    assert "self clearance of 0.01 m: of nothing" in said


BAD_FILES = {
    "empty": b"",
    "text": b"certified",
    "a list": b"[]",
    "a number": b"1e999",
    "no number": b'{"format": NaN}',
    "infinite": b'{"format": -Infinity}',
    "twice": b'{"format": "tpbso-casadi certificate", "format": "tpbso-casadi certificate"}',
    "deep": b"[" * 200_000,
    "digits": b'{"format": ' + b"9" * 10_000 + b"}",
    "not UTF-8": b'{"\xff": 1}',
    "cut short": gzip.compress(b'{"format": 1}')[:-6],
    "spoilt": gzip.compress(b'{"format": 1}' * 50)[:20] + b"\0" * 30,
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_other_files_are_no_certificates(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "c.json"
    path.write_bytes(BAD_FILES[name])
    assert run(path) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"{path}: no certificate: ")
    assert said.err.count("\n") == 1


def test_no_file_is_no_certificate(tmp_path: Path) -> None:
    assert (run(tmp_path), run(tmp_path / "none.json"), checker.main([])) == (2, 2, 2)


@pytest.mark.process
def test_the_file_alone_is_enough(tmp_path: Path, content: Content) -> None:
    """In a folder of its own, in a process that knows NumPy, and finds nothing of this project."""
    shutil.copy(checker.__file__, tmp_path / "check_certificate.py")
    (tmp_path / "c.json").write_text(json.dumps(content))
    hidden = "import sys; sys.modules.update(dict.fromkeys(('problems', 'solvers', 'tpbso_casadi', 'casadi', 'scipy')))"
    program = f"{hidden}; import check_certificate as c; sys.exit(c.main(['c.json']))"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1].startswith("accepted")
