"""``tpbso tracking``: logs and the bound that they need; one line for what is wrong."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from helpers.running import refusal

from problems.base import FloatArray
from problems.robots import TrackingError, least_tracking_error
from tpbso_casadi.cli.commands.tracking import main, toml_line

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
TIMES = np.linspace(0.0, 2.0, 300)
COMMANDED = np.column_stack([np.sin(2.0 * TIMES), 0.5 * np.cos(3.0 * TIMES)])


def written(errors: FloatArray, name: str = "log.csv") -> None:
    rows = np.column_stack([TIMES, COMMANDED, COMMANDED + errors])
    np.savetxt(name, rows, delimiter=",", header="t,q1,q2,m1,m2", comments="")


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[dict[str, list[float]], str]:
    assert main([*arguments]) == 0
    text = capsys.readouterr().out
    stated = tomllib.loads(text)["tracking_error"]
    return stated if isinstance(stated, dict) else {"constant": stated}, text


def test_a_delay_is_a_share_of_the_speed(capsys: pytest.CaptureFixture[str]) -> None:
    speed = np.gradient(COMMANDED, TIMES, axis=0, edge_order=2)
    written(0.003 * speed)
    stated, text = printed(capsys, "log.csv")
    np.testing.assert_allclose(np.broadcast_to(stated["speed"], 2), 0.003, rtol=2e-3)
    assert np.max(stated.get("constant", 0.0)) < 1e-5 and "# 300 rows, 2 joints" in text
    more, _ = printed(capsys, "log.csv", "--margin", "1.2")
    np.testing.assert_allclose(np.broadcast_to(more["speed"], 2), 0.0036, rtol=2e-3)
    alone, _ = printed(capsys, "log.csv", "--constant")
    np.testing.assert_allclose(alone["constant"], 0.003 * np.abs(speed).max(axis=0), rtol=2e-3)


def test_the_bound_holds_for_all_logs(capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(1)
    errors = [rng.normal(0.0, 0.002, COMMANDED.shape) for _ in range(2)]
    for number, error in enumerate(errors):
        written(error, f"log{number}.csv")
    stated, _ = printed(capsys, "log0.csv", "log1.csv")
    speed = np.gradient(COMMANDED, TIMES, axis=0, edge_order=2)
    acceleration = np.gradient(speed, TIMES, axis=0, edge_order=2)
    each = [tuple(np.broadcast_to(stated.get(key, 0.0), 2).tolist()) for key in ("constant", "speed", "acceleration")]
    allowed = TrackingError(*each).at(speed, acceleration)
    assert all((np.abs(error) <= allowed).all() for error in errors)


def test_no_smaller_bound_has_the_same_mean() -> None:
    rng = np.random.default_rng(4)
    errors, speed, acceleration = (rng.uniform(0.0, part, (400, 1)) for part in (0.01, 1.0, 5.0))
    found = least_tracking_error(errors, speed, acceleration)
    mean = found.at(speed, acceleration).mean()
    for _ in range(200):  # any other bound of the same rows has a larger mean
        shares = rng.uniform(0.0, [0.01, 0.01, 0.002])
        rows = np.column_stack([np.ones(400), speed, acceleration]) @ shares
        scale = (errors[:, 0] / rows).max()
        assert scale * rows.mean() >= mean * (1.0 - 1e-6)


def test_what_is_printed_is_no_less() -> None:
    error = TrackingError((0.00123456, 0.00123456), (0.0, 0.0), (0.0, 0.0))
    assert toml_line(error) == "tracking_error = 0.001235"


def test_what_is_wrong_is_said_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    written(np.full(COMMANDED.shape, 0.001))
    Path("other.csv").write_text("t,q1,m1\n" + "".join(f"{k},0.{k},0.{k}1\n" for k in range(1, 9)))
    Path("header.csv").write_text("t,q1,q2\n0,1,2\n")
    Path("back.csv").write_text("t,q1,m1\n0,1,1\n0,1,1\n")
    Path("odd.csv").write_text("t,q1,m1\n0,1,1\n1_0,1,1\n")
    Path("short.csv").write_text("t,q1,m1\n0,1,1\n1,1,1\n")
    written(np.zeros(COMMANDED.shape), "exact.csv")
    for arguments, reason in (
        (["log.csv", "other.csv"], "1 joints, log.csv has 2"),
        (["header.csv"], "header.csv line 1: the header t,q1..qk,m1..mk is needed"),
        (["back.csv"], "back.csv line 3: times have to increase"),
        (["odd.csv"], "odd.csv line 3: 3 numbers are needed"),
        (["short.csv"], "2 rows; 5 at least are needed"),
        (["exact.csv"], "it is zero everywhere"),
        (["none.csv"], "none.csv"),
    ):
        assert reason in refusal(capsys, main, *arguments)
