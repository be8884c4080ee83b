"""The benchmark of replanning, with an arm that needs few evaluations."""

from __future__ import annotations

import argparse

import pytest

from benchmarks import replanning


def test_rows_add_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replanning, "SCENES", {"plane": "simulation-plane.toml"})
    monkeypatch.setattr(replanning, "read_scenario", short)
    options = argparse.Namespace(replans=4, seed=1, every=0.1, within=None)
    cells = [dict(zip(replanning.COLUMNS, row, strict=True)) for row in replanning.rows(options)]
    assert [(row["seed"], row["replans"]) for row in cells] == [("1", "3"), ("2", "3"), ("all", "6")]
    assert cells[-1]["collisions"] == "0"
    assert cells[-1]["limits kept"] == "yes"
    shares = sum(float(cells[-1][kind].rstrip("%")) for kind in ("new", "old", "stop"))
    assert shares == pytest.approx(100.0, abs=0.2)


def short(path: object) -> object:
    """Three periods of a scene, with few evaluations."""
    scenario = READ(path)  # type: ignore[arg-type]
    content = scenario.table() | {"model": scenario.model.stated()}
    content["simulation"] |= {"seconds": 0.3, "evaluations": 100}
    return replanning.parse_scenario(content)


READ = replanning.read_scenario
