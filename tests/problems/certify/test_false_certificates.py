"""Attempts at a certificate that is false and accepted; at files that are none."""

from __future__ import annotations

import gzip
import json
import shutil
import subprocess
import sys
from copy import deepcopy
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.certificates import Content, case, changed
from helpers.slow import slow_except

from problems.certify import check_certificate as checker
from problems.certify import divided


def outcome(content: Any) -> str:
    """What the checker says: accepted, or why not."""
    try:
        checker.check(content)
    except checker.RefusedError as error:
        return f"refused: {error}"
    except ValueError as error:
        return f"no certificate: {error}"
    return "accepted"


@pytest.fixture(scope="module")
def content() -> Content:
    return case("sliding").content


def test_planes_whose_length_vanishes_prove_nothing_more(content: Content) -> None:
    """Squares of 1e-200 are 0: divided by such a length a room would be as large as one likes."""
    tiny = changed(content, "planes", value=lambda planes: (1e-200 * np.array(planes)).tolist())
    assert outcome(changed(tiny, "margins", 0, value=0.5)).startswith("refused: clearance of ")
    assert outcome(tiny).startswith("refused: clearance of ")


def test_who_pauses_has_come_to_rest_and_so_has_all_else(content: Content) -> None:
    assert "rest before a pause" in outcome(changed(content, "pause", value=1.0))  # a cart drives by


@pytest.mark.parametrize(
    ("name", "key"),
    slow_except(
        product(("upright", "sliding"), ("limits", "obstacles", "own")),
        [("upright", "limits"), ("upright", "own"), ("sliding", "obstacles")],
    ),
)
def test_nothing_of_any_proof_can_be_left_out(name: str, key: str) -> None:
    """A cell that is not said to hold is divided, and of its halves nothing is said; or a ball is, and of its parts."""
    made = case(name).content
    levels = made["stages"][0]["proof"][key]
    places = [(i, k) for i, level in enumerate(levels) for k, digit in enumerate(level) if digit == "0"]
    for choice in np.random.default_rng(5).permutation(len(places))[:8]:
        i, k = places[choice]
        for digit in "12":
            other = changed(made, "proof", key, i, value=lambda level, k=k, d=digit: level[:k] + d + level[k + 1 :])
            assert "accepted" not in outcome(other)
    assert "no proof" in outcome(changed(made, "proof", key, value=[]))
    assert "no proof" in outcome(changed(made, "proof", key, value=levels[:-1]))
    assert "no proof" in outcome(changed(made, "proof", key, -1, value=levels[-1][:-1]))
    assert "one digit" in outcome(changed(made, "proof", key, -1, value=levels[-1] + "0"))
    assert "one digit" in outcome(changed(made, "proof", key, value=[*levels, "0"]))


def test_cells_that_are_longer_than_what_they_prove_are_refused(content: Content) -> None:
    """All of a piece at once, of each pair: every digit 0."""
    proof = content["stages"][0]["proof"]
    for key, name in (("obstacles", "clearance of "), ("limits", "speed of ")):
        assert outcome(changed(content, "proof", key, value=["0" * len(proof[key][0])])).startswith(f"refused: {name}")


def test_a_ball_without_parts_cannot_be_divided(content: Content) -> None:
    """Nothing would be left of it."""
    for key in ("limits", "obstacles", "own"):
        levels, count = [], len(content["stages"][0]["proof"][key][0])
        while "a ball that has parts" not in (
            said := outcome(changed(content, "proof", key, value=[*levels, "2" * count]))
        ):
            assert key != "limits"
            assert "no proof" in said
            stage = checker.Stage(checker.formed(content["stages"][0], "STAGE", "stage", {}), "stage")
            levels.append("2" * count)
            for level in levels:
                stage.claims[key].divide(np.array([int(digit) for digit in level]))
            count = len(stage.claims[key].cells)


def test_planes_may_be_anything_and_prove_no_more_than_they_do(content: Content) -> None:
    planes = np.array(content["stages"][0]["planes"])
    assert "planes" in outcome(changed(content, "planes", value=planes[:-1].tolist()))
    for other in (
        -planes,
        0.0 * planes,
        1e-6 * np.ones_like(planes),
        np.random.default_rng(2).normal(size=planes.shape),
    ):
        assert outcome(changed(content, "planes", value=other.tolist())).startswith("refused: clearance of ")
    assert outcome(changed(content, "planes", value=(3.0 * planes).tolist())) == "accepted"


NUMBERS = [
    ("margins", 0),
    ("robot", "balls", 1, 3),
    ("robot", "limits", 0, 0),
    ("robot", "axes", 1, 2),
    ("obstacles", 0, "center", 1),
    ("obstacles", 1, "velocity", 0),
    ("breakpoints", 1),
    ("coefficients", 0, 1, 2),
    ("tolerances", 0),
    ("goal", 0, 0),
    ("planes", 3, 1),
    ("proof", "obstacles", 0),
]


@pytest.mark.parametrize("path", NUMBERS, ids=str)
@pytest.mark.parametrize(
    "value", [float("nan"), float("inf"), -float("inf"), 10**400, -(10**30), "1", True, [1.0], None, {}]
)
def test_what_is_no_number_is_no_certificate(content: Content, path: tuple[Any, ...], value: Any) -> None:
    if value is None and "limits" in path:
        return  # no limit
    assert outcome(changed(content, *path, value=value)).startswith(("no certificate: ", "refused: "))


PLACE: Content = {"at_goal": 1, "carrier": 0, "points": [[0.0] * 3], "places": [[0.0] * 3], "within": 1.0}
FAULTS: list[tuple[tuple[Any, ...], Any, str]] = [
    (("format",), "another", "format"),
    (("version",), 1, "tpbso-casadi certificate 2"),
    (("version",), True, "version"),
    (("stages",), [], "tpbso-casadi certificate 2"),
    (("margins", 0), -0.01, "from 0"),
    (("pause",), -1.0, "from 0"),
    (("robot", "tracking_error", 0, 0), -0.1, "from 0"),
    (("robot", "tracking_error"), [], "a list of 3"),
    (("robot", "limits", 0, 0), -1.0, "from 0"),
    (("robot", "axes", 0), [0.0, 0.0, 0.5], "of length 1"),
    (("robot", "rotations", 0), [[-1.0, 0, 0], [0, 1, 0], [0, 0, 1]], "a rotation"),
    (("robot", "rotations", 0, 0, 1), 1e-9, "a rotation"),
    (("robot", "turns", 0), 2, "whole number below 2"),
    (("robot", "joints"), [], "a list of 0"),
    (("robot", "balls", 0, 3), -0.5, "radii from 0"),
    (("robot", "long_balls"), [0], "a list of 1"),
    (("robot", "long_balls"), [99], "whole number"),
    (("robot", "ball_parents", 1), 3, "ball_parents"),
    (("robot", "ball_parents", 2), 2.5, "whole number"),
    (("robot", "link_bodies", 0), 9, "a joint"),
    (("robot", "own_pairs", 0), [1, 1], "a joint between"),
    (("robot", "own_pairs", 0), [0, 10**5], "whole number"),
    (("may_touch", "links"), [0], "a list of 1"),
    (("may_touch",), {"links": [0], "obstacles": [99]}, "whole number"),
    (("obstacles", 0, "shape"), "torus", "one of"),
    (("obstacles", 0, "sizes"), [-0.1] * 3, "from 0"),
    (("obstacles", 0, "sizes"), [0.1], "its sizes"),
    (("obstacles", 0, "rotation"), [[2.0, 0, 0], [0, 1, 0], [0, 0, 1]], "a rotation"),
    (("obstacles", 0, "growth"), -1.0, "from 0"),
    (("obstacles",), {}, "a list"),
    (("breakpoints",), [0.0, 2.0, 1.0], "rising"),
    (("breakpoints",), [], "rising"),
    (("goal", 1), [0.0], "a list of 4"),
    (("tolerances", 1), 1.0, "no more than"),
    (("tolerances", 0), -1.0, "from 0"),
    (("not_covered",), [3], "text in quotes"),
    (("not_covered",), ["so", "so"], "every name once"),
    (("places",), [PLACE | {"at_goal": 2}], "whole number below 2"),
    (("places",), [PLACE | {"carrier": 4}], "whole number below 4"),
    (("places",), [PLACE | {"within": -1e-6}], "from 0"),
    (("places",), [PLACE | {"places": []}], "a list of 1"),
    (("places",), [PLACE | {"name": "goal"}], "an object with the keys"),
    (("proof", "obstacles"), ["3"], "digits"),
    (("proof", "obstacles"), "0", "a list"),
    (("proof", "own"), ["1" * 8] * 50, "levels"),
]


@pytest.mark.parametrize(("path", "value", "reason"), FAULTS, ids=lambda part: str(part)[:40])
def test_faults_are_named(content: Content, path: tuple[Any, ...], value: Any, reason: str) -> None:
    said = outcome(changed(content, *path, value=value))
    assert said.startswith("no certificate: ")
    assert reason in said


@pytest.mark.parametrize("path", [("robot",), ("obstacles", 0), ("may_touch",), ("proof",), ()])
def test_keys_are_those_of_the_format_and_no_others(content: Content, path: tuple[Any, ...]) -> None:
    place = content["stages"][0]
    for key in path:
        place = place[key]
    for key in place:
        less = deepcopy(content)
        inner = less["stages"][0]
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
    rng, places = np.random.default_rng(7), _leaves(content["stages"][0])[1:]
    outer = [path for path in places if len(path) <= 3]
    chosen = [*outer, *(places[k] for k in rng.integers(len(places), size=40))]
    values = [None, "x", [], {}, -1, 1e9, 0, True, [[]], [0.0], 3, 10**400]
    said = [outcome(changed(content, *path, value=values[rng.integers(len(values))])) for path in chosen]
    assert sum(line.startswith("no certificate: ") for line in said) > 0.7 * len(said)


REFUSALS: list[tuple[tuple[Any, ...], Any, str]] = [
    (("robot", "balls", 3, 3), lambda r: r + 1.0, "clearance"),
    (("robot", "limits", 0, 0), lambda v: 0.01 * v, "speed of 'one'"),
    (("robot", "limits", 0, 1), lambda v: 0.01 * v, "acceleration of 'one'"),
    (("robot", "ranges", 2), [-0.01, 0.01], "joint range of 'three'"),
    (("robot", "tracking_error", 0, 0), 5.0, "joint range of 'one'"),
    (("robot", "tracking_error", 1, 0), 5.0, "joint range of 'one'"),
    (("robot", "tracking_error", 2, 0), 5.0, "joint range of 'one'"),
    (("margins", 0), 0.5, "clearance"),
    (("margins", 1), 0.5, "self clearance"),
    (("goal", 0, 0), lambda q: q + 1e-6, "position of 'motion' jumps by 1.00000"),
    (("start", 0, 3), lambda q: q - 1e-6, "up to t = 0.0 s"),
    (("start", 1, 0), 1e-3, "velocity of 'motion' jumps by 0.00100000"),
    (("coefficients", 1, 0, 0), lambda c: c + 1e-6, "position of 'motion' jumps"),
    (("coefficients", 0, 0, 4), lambda c: c + 1e-4, "position of 'motion' jumps"),
    (("obstacles", 0, "sizes"), lambda s: [10.0 * part for part in s], "clearance"),
    (("obstacles", 0, "velocity"), [0.0, 0.0, 100.0], "clearance"),
    (("obstacles", 0, "growth"), 10.0, "clearance"),
]  # fmt: skip


def test_jumps_that_are_each_small_enough_may_be_too_many(content: Content) -> None:
    tolerance = content["stages"][0]["tolerances"][1]
    one = changed(
        content, "coefficients", 0, 0, 0, value=lambda c: c + 0.3 * tolerance
    )  # at the start, and in the middle
    assert outcome(one) == "accepted"
    two = changed(one, "goal", 0, 0, value=lambda q: q + 0.6 * tolerance)
    assert "position of 'motion' jumps by" in outcome(two)


@pytest.mark.parametrize(
    ("path", "value", "reason"), REFUSALS, ids=lambda part: "changed" if callable(part) else str(part)[:40]
)
def test_other_numbers_are_refused(content: Content, path: tuple[Any, ...], value: Any, reason: str) -> None:
    said = outcome(changed(content, *path, value=value))
    assert said.startswith("refused: ")
    assert reason in said


def test_an_obstacle_in_the_way_is_found(content: Content) -> None:
    """A polytope around everything, whatever planes there are."""
    corners = (np.array(list(np.ndindex(2, 2, 2))) - 0.5) * 9.0
    given = content["stages"][0]["obstacles"]
    for place in range(len(given)):
        solid = {**given[place], "shape": "polytope", "sizes": [], "points": corners.tolist(), "center": [0.0] * 3}
        assert outcome(changed(content, "obstacles", place, value=solid)).startswith("refused: clearance")
    empty = {**given[0], "shape": "polytope", "sizes": [], "points": []}
    assert outcome(changed(content, "obstacles", 0, value=empty)).startswith("no certificate: ")


def test_a_limit_of_torque_needs_masses(content: Content) -> None:
    assert "robot.masses" in outcome(changed(content, "robot", "limits", 0, 3, value=5.0))


# Files


def run(path: Path) -> int:
    return checker.main([str(path)])


def test_a_file_is_accepted_zipped_or_not(tmp_path: Path, content: Content, capsys: pytest.CaptureFixture[str]) -> None:
    plain, zipped = tmp_path / "c.json", tmp_path / "c.json.gz"
    data = json.dumps(changed(content, "not_covered", value=["own constraint x"])).encode()
    plain.write_bytes(data)
    zipped.write_bytes(gzip.compress(data))
    assert (run(plain), run(zipped)) == (0, 0)
    lines = capsys.readouterr().out.splitlines()
    assert "  not in this certificate: 'own constraint x'" in lines
    assert lines[-1].endswith("accepted: all that is claimed is proven, for all t")
    assert any(line.startswith("assumed: ") for line in lines)


def test_a_refusal_is_one_line(tmp_path: Path, content: Content, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "c.json"
    path.write_text(json.dumps(changed(content, "robot", "limits", 0, 0, value=0.001)))
    assert run(path) == 1
    assert capsys.readouterr().out.startswith("refused: speed of 'one', t = ")


def test_all_that_is_checked_is_said(tmp_path: Path, content: Content, capsys: pytest.CaptureFixture[str]) -> None:
    """Limits and tracking errors of joints, states at the ends and how near, obstacles, pairs, and what is left out."""
    robot = changed(content, "robot", "own_pairs", value=lambda pairs: pairs[:1])
    less = changed(changed(robot, "robot", "limits", 0, 0, value=None), "robot", "limits", 1, 2, value=1e4)
    less["stages"][0] |= divided(less["stages"][0])
    path = tmp_path / "c.json"
    path.write_text(json.dumps(less))
    assert run(path) == 0
    said = capsys.readouterr().out
    assert "'one': joint range [-2.8, 2.8], acceleration 10.0, tracking error [0.0, 0.0, 0.0]: constant" in said
    assert "'two': joint range [-0.3, 0.4], speed 0.5, acceleration 2.0, jerk 10000.0, tracking" in said
    assert "velocity: [0.0, 0.0, 0.0, 0.0] to [0.0, 0.0, 0.0, 0.0], jumps add up to 2.0" in said
    assert "acceleration: [0.0" in said
    assert "limits to 1.001e-09 of them or widths\n" in said
    assert "name 'cart', shape box, sizes [0.1, 0.1, 0.1], rotation [[1.0, 0.0, 0.0], " in said
    assert "center [-3.0, 0.5, 0.3], velocity [0.5, 0.2, 0.0], growth 0.01, points []\n" in said
    assert "('tower', 'boom', 'arm', 'rod') and obstacles\n" in said
    assert "0.01 m between own links: 'arm' from 'tower'; no other pairs\n" in said


def test_pairs_of_single_balls_are_no_pairs_of_links(content: Content) -> None:
    """And what no joint moves keeps clear of obstacles as all else does."""
    upright = case("upright").content
    lines = "\n".join(checker.check(upright)[0].lines())
    assert "'forearm' from 'foot' (some of their balls alone)" in lines
    assert "'hand' from 'upper arm (1)'; 'hand' from 'upper arm (2)';" in lines
    assert "('foot', 'column', 'upper arm (1)', 'upper arm (2)', 'forearm', 'hand') and obstacles\n" in lines


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
