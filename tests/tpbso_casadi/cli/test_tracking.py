"""``tpbso tracking``: the bound that logs need, as a line of a scenario."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from problems.base import FloatArray
from problems.robots import TrackingError
from tpbso_casadi.cli.commands.tracking import main, toml_line

TIMES = np.linspace(0.0, 2.0, 300)
COMMANDED = np.column_stack([np.sin(2.0 * TIMES), 0.5 * np.cos(3.0 * TIMES)])
SPEED = np.gradient(COMMANDED, TIMES, axis=0, edge_order=2)


def written(errors: FloatArray, name: str) -> None:
    rows = np.column_stack([TIMES, COMMANDED, COMMANDED + errors])
    np.savetxt(name, rows, delimiter=",", header="t,q1,q2,m1,m2", comments="")


def test_logs_are_bounded_together_by_shares_or_a_constant(
    in_an_empty_folder: None, capsys: pytest.CaptureFixture[str]
) -> None:
    def printed(*arguments: str) -> dict[str, list[float]]:
        assert main([*arguments]) == 0
        text = capsys.readouterr().out
        assert f"# {300 * len(list(Path().glob('*.csv')))} rows, 2 joints" in text
        stated = tomllib.loads(text)["tracking_error"]
        return stated if isinstance(stated, dict) else {"constant": stated}

    written(0.003 * SPEED, "log.csv")  # a delay is a share of the speed
    stated = printed("log.csv")
    np.testing.assert_allclose(np.broadcast_to(stated["speed"], 2), 0.003, rtol=2e-3)
    assert np.max(stated.get("constant", 0.0)) < 1e-5
    more = printed("log.csv", "--margin", "1.2")
    np.testing.assert_allclose(np.broadcast_to(more["speed"], 2), 0.0036, rtol=2e-3)
    alone = printed("log.csv", "--constant")
    np.testing.assert_allclose(alone["constant"], 0.003 * np.abs(SPEED).max(axis=0), rtol=2e-3)
    written(0.006 * SPEED, "slower.csv")  # the bound holds for all logs
    for logs in (["log.csv", "slower.csv"], ["slower.csv", "log.csv"]):
        both = printed(*logs, "--constant")
        np.testing.assert_allclose(both["constant"], 0.006 * np.abs(SPEED).max(axis=0), rtol=2e-3)
        assert (np.array(both["constant"]) >= 0.006 * np.abs(SPEED).max(axis=0) - 1e-12).all()  # rounded up


def test_what_is_printed_is_no_less() -> None:
    error = TrackingError((0.00123456, 0.00123456), (0.0, 0.0), (0.0, 0.0))
    assert toml_line(error) == "tracking_error = 0.001235"
