"""The optimum near a plan, its ranking in JSON and in words, and what is left out on the way there."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.massive import massive_arm
from helpers.space_plans import space_plan

from problems.limits import Proximity, TorqueLimit, proximity
from problems.motions import Samples
from tpbso_casadi import parse_scenario
from tpbso_casadi.cli.commands.audit import main
from tpbso_casadi.display.audit_tables import of_one, print_optimum, saved, sentences
from tpbso_casadi.display.console import OutputConsole
from tpbso_casadi.planning import PlannedMotion, nearest_optimum, plan
from tpbso_casadi.planning import optimum as replanned
from tpbso_casadi.planning.optimum import ProgramPlanner
from tpbso_casadi.storage import write_plan

pytestmark = pytest.mark.optimum
SHARE = 0.3  # of the reach


@cache
def planned() -> PlannedMotion:
    arm = {
        "link_lengths": [0.5, 0.5], "max_speed": 4.0, "max_acceleration": 40.0, "link_masses": 2.0,
        "payload": {"mass": 1.0}, "max_torque": [40.0, 10.0],
    }  # fmt: skip
    task = {"kind": "point-to-point", "start": [0.6, -0.3], "goal": [0.3, 0.6], "elbow": "down"}
    return plan(parse_scenario({"arm": arm, "task": task, "solver": {"evaluations": 1500}}))


@pytest.mark.slow
def test_a_run_is_told_what_holds_it_back(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replanned, "LONGEST", np.inf)
    write_plan(tmp_path / "run", planned())
    assert main([str(tmp_path / "run"), "--json"]) == 0
    audit: dict[str, Any] = json.loads(capfd.readouterr().out)
    found = audit["optimum"]
    assert found["residuals"]["stationarity"] < 1e-4
    assert found["objective"] * (1.0 + found["excess"]) == pytest.approx(audit["objective"]["value"])
    ranked = [(price["constraint"], price["column"]) for price in found["ranking"]]
    assert {("torque", "joint 1"), ("payload", "mass")} <= set(ranked)
    shares = [price["per_cent"] for price in found["ranking"]]
    assert shares == sorted(shares) and all(share <= 0.0 for share in shares)
    print_optimum(audit, OutputConsole())
    text = " ".join(capfd.readouterr().out.split())
    assert "as a motion of its own, certified: time" in text and "% more" in text
    assert "what holds the motion back" in text
    assert "or the plan just timed again" in text
    assert "0.4 N m more in joint 1 saves" in text and "0.01 kg less in the hand saves" in text


def test_a_path_in_the_plane_is_descended_from_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its program holds arrays, by which programs can be neither compared nor hashed."""
    task = {"kind": "path", "points": [[0.3, -0.6], [0.6, -0.3], [0.6, 0.1]], "accuracy": 0.02}
    arm = {
        "link_lengths": [0.5, 0.5, 0.4], "max_speed": 4.0, "max_acceleration": 40.0, "link_masses": 1.0,
        "max_torque": 60.0,
    }  # fmt: skip
    found = plan(parse_scenario({"arm": arm, "task": task, "solver": {"name": "bso", "evaluations": 300}}))
    monkeypatch.setattr(replanned, "LONGEST", 0.0)
    assert nearest_optimum(found.problem, found.motion, found.motion, retimes=True) is None


def test_no_optimum_is_found_in_no_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replanned, "LONGEST", 0.0)
    assert nearest_optimum(planned().problem, planned().motion, planned().motion, retimes=True) is None


@pytest.mark.parametrize(("most", "kept"), [(60.0, False), (20.0, True)])
def test_a_limit_that_a_motion_is_far_from_is_left_out(most: float, kept: bool) -> None:
    robot = massive_arm(max_torque=(most, most))
    stretched = Samples(robot=robot, derivatives=(ca.DM.zeros(2, 2),) * 3, duration=ca.DM(1.0))
    # held horizontally: 2 kg at 0.25 m and 1.5 kg at 0.7 m take 15.2 N m
    assert (TorqueLimit(robot).near(stretched) is not None) == kept


def test_pairs_that_stay_apart_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proximity, "NEAR", SHARE)
    motion = space_plan().motion
    samples, counts = motion.trajectory.samples(motion.times, motion.criteria.robot), list[int]()
    for limit in motion.criteria.limits:
        near = limit.near(samples)
        if not isinstance(limit, Proximity):
            assert near is limit
            continue
        kept = set() if near is None else set(near.pairs)
        reach = motion.criteria.robot.reach()[1]
        apart = np.array(limit.clearances(samples)).min(axis=0) - float(limit.required_clearance(0.0))
        assert kept == {pair for pair, room in zip(limit.pairs, apart, strict=True) if room < SHARE * reach}
        assert len(kept) < len(limit.pairs)
        counts.append(len(kept))
    assert max(counts) > 0


def test_what_was_left_out_is_put_back_where_the_optimum_breaks_it(monkeypatch: pytest.MonkeyPatch) -> None:
    found = planned()
    expected = ProgramPlanner(found.problem, False, np.inf).descended(found.motion)
    monkeypatch.setattr(TorqueLimit, "near", lambda self, samples: None)
    back = ProgramPlanner(found.problem, False, np.inf).descended(found.motion)
    assert expected is not None and back is not None
    assert back.program == pytest.approx(expected.program, rel=1e-6)
    assert back.motion.feasible


def test_units_are_those_that_differences_are_read_in() -> None:
    clearance = {"constraint": "clearance", "column": "margin", "per_unit": -0.3, "limit_unit": "m", "step": -0.006}
    motor = {"constraint": "torque", "column": "joint 4", "per_unit": -0.012, "limit_unit": "N m", "step": 0.5}
    assert saved(0.012, "s") == "12 ms" and saved(0.5, "rad") == "0.5 rad"
    assert saved(0.012, "") == "0.012"
    assert of_one(clearance, "s") == "0.3 ms per mm"
    assert sentences([clearance, motor], "s") == ["0.5 N m more in joint 4 saves 6 ms"]
    assert sentences([clearance], "s") == []


@pytest.mark.parametrize(
    ("excess", "verdict", "said"),
    [
        (0.0964, "certified", "certified: length 1.6 m; the plan takes 9.64% more"),
        (1e-6, "certified", "the plan takes the same"),
        (-0.0002, "certified", "the plan takes 0.02% less: it is better than that"),
        (-0.1, "violated", "the plan, which is violated, takes 10.00% less"),
    ],
)
def test_the_plan_beside_the_optimum_in_words(
    excess: float, verdict: str, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    optimum = {
        "objective": 1.6, "excess": excess, "program": 1.576, "status": "Solve_Succeeded", "seconds": 0.2,
        "residuals": {"stationarity": 1e-8}, "ranking": [], "unpriced": ["slow elbow"],
    }  # fmt: skip
    objective, certificate = {"name": "length", "unit": "m"}, {"verdict": verdict}
    print_optimum({"optimum": optimum, "objective": objective, "certificate": certificate}, OutputConsole())
    told = capfd.readouterr().out
    assert said in told
    assert "its nonlinear program says 1.576 m, 1.50% less" in told
    assert "nothing is saved by planning again" in told
    assert "near, but not planned again with more of it: slow elbow" in told
