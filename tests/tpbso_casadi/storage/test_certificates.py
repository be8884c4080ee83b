"""Certificates of plans as files: from Python, from the command line, of a run that is read back."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.certificates import criteria_of, straight
from helpers.scenes import toml
from helpers.space_scenarios import space_scenario

import tpbso_casadi as tp
from problems.assembly import certificate_of
from problems.base import as_array
from problems.certify import check_certificate as checker
from problems.robots import PlanarArm, planar_payload
from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.storage import OutputError

TOWARD = {"goal": {"joints": [0.4, 0.9, 0.5]}}
HALTS = {"shape": "box", "center": [0.4, 0.0, 0.62], "size": [0.1, 0.1, 0.1]}


def planned(**tables: Any) -> Plan:
    content = space_scenario(task=TOWARD, obstacles=[], solver={"name": "direct", "evaluations": None}, **tables)
    return Plan(plan(parse_scenario(content)))


@pytest.fixture(scope="module")
def scenario_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    content = space_scenario()
    folder = tmp_path_factory.mktemp("scenario")
    (folder / "short.urdf").write_text(content["robot"]["urdf_text"])
    (folder / "spheres.toml").write_text(content["robot"]["spheres_text"])
    path = folder / "short.toml"
    robot = {"urdf": "short.urdf", "spheres": "spheres.toml", "max_acceleration": 8.0}
    task = {"kind": "point-to-point", "start": {"joints": [-0.5, 0.8, 0.6]}} | TOWARD
    crate = {"shape": "box", "center": [0.0, 0.7, 0.6], "size": [0.1, 0.1, 0.1], "name": "crate"}
    path.write_text(toml(robot=robot, task=task, obstacles=[crate]))
    return path


GANTRY = """<robot name="gantry"><link name="base"/>
<joint name="x" type="prismatic"><parent link="base"/><child link="beam"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" velocity="1" effort="100"/></joint><link name="beam"/>
<joint name="z" type="prismatic"><parent link="beam"/><child link="tool"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="100"/></joint>
<link name="tool"><collision><geometry><sphere radius="0.05"/></geometry></collision></link></robot>"""


def test_arms_in_which_nothing_turns_have_one(tmp_path: Path) -> None:
    (tmp_path / "gantry.urdf").write_text(GANTRY)
    robot = tp.robot(str(tmp_path / "gantry.urdf"), max_acceleration=4.0)
    found = tp.plan(
        robot, start=[-0.5, 0.0], goal=[0.5, 0.1], obstacles=[tp.Sphere(center=(0.0, 0.0, -0.6), radius=0.1)]
    )
    assert checker.main([str(found.certificate(tmp_path / "c.json"))]) == 0


def test_a_plan_writes_one_that_is_accepted(tmp_path: Path) -> None:
    found = planned()
    path = found.certificate(tmp_path / "new" / "motion.json.gz")
    assert checker.main([str(path)]) == 0
    content = json.loads(gzip.decompress(path.read_bytes()))
    (stage,) = content["stages"]
    assert stage["breakpoints"] == found.trajectory.breakpoints.tolist()
    assert stage["goal"][0] == TOWARD["goal"]["joints"]
    assert "limit: torque" not in stage["not_covered"]
    again = found.certificate(str(tmp_path / "again.json.gz"))
    assert again.read_bytes() == path.read_bytes()


def test_the_command_line_writes_one_and_an_audit_of_the_run_the_same(
    tmp_path: Path, scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two, folder = tmp_path / "one.json", tmp_path / "two.json", tmp_path / "run"
    options = ["--no-plots", "--quiet", "--certificate"]
    assert solve.main([str(scenario_file), "--out", str(folder), *options, str(one)]) == 0
    assert audit.main([str(folder), "--quiet", "--certificate", str(two)]) == 0
    assert one.read_bytes() == two.read_bytes()
    capsys.readouterr()
    assert checker.main([str(one)]) == 0
    assert "  name 'crate', shape box, sizes [0.05, 0.05, 0.05], rotation [[1.0," in capsys.readouterr().out


def test_what_is_not_claimed_is_listed(tmp_path: Path) -> None:
    task = {"goal": {"position": [0.3, 0.3, 0.6]}, "via": [{"position": [0.3, 0.4, 0.6]}]}
    content = space_scenario(task=task, obstacles=[])
    found = Plan(plan(parse_scenario(content)))
    path = found.certificate(tmp_path / "motion.json")
    (stage,) = json.loads(path.read_text())["stages"]
    assert "condition: via 1" in stage["not_covered"]
    assert "condition: goal" not in stage["not_covered"]
    assert checker.main([str(path)]) == 0


def test_a_plan_that_is_not_certified_has_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = tp.certify(([0.0, 0.1], [[0.0] * 7, [1.0] * 7]), "panda")
    with pytest.raises(OutputError, match="not certified"):
        found.certificate(tmp_path / "motion.json")
    assert not (tmp_path / "motion.json").exists()


def test_planar_arms_without_obstacles_have_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tp.plan("time-3", evaluations=300, seed=1).certificate(tmp_path / "motion.json")
    assert checker.main([str(path)]) == 0
    said = capsys.readouterr().out
    assert "'joint 3': speed 4.0, acceleration 20.0, tracking error" in said
    assert "not in this certificate: 'condition: goal'" not in said
    assert "at_goal 1, carrier 2, points [[" in said


def test_torques_of_planar_arms_are_those_of_the_models() -> None:
    """Masses, payload, friction, an inclined base; against the recursion of the models."""
    arm = PlanarArm(
        link_lengths=(0.5, 0.4, 0.3), max_speed=(4.0,) * 3, max_acceleration=(20.0,) * 3, max_torque=(1e4,) * 3,
        link_masses=(3.0, 2.0, 1.0), viscous_friction=(0.3, 0.2, 0.1), base_angle=0.4, base_point=(0.1, 0.2),
        payload=planar_payload(0.5, (0.05, 0.02), 0.01),
    )  # fmt: skip
    motion = straight(arm, np.array([0.1, -0.4, 0.8]), np.array([1.2, 0.7, -0.3]))
    content = certificate_of(criteria_of(arm, motion, ()), motion)
    checker.check(json.loads(json.dumps(content)))
    with np.errstate(invalid="ignore"):
        stage = checker.Stage(checker.formed(content["stages"][0], "STAGE", "stage", {}), "stage")
    cells = checker.Cells(stage, np.arange(512 * stage.pieces, 1024 * stage.pieces))
    low, high = cells.torques(stage.given.robot)
    states = [ca.DM(motion.at(cells.times, order)) for order in range(3)]
    torques = as_array(arm.dynamics.torques(*states))
    assert (low <= torques).all()
    assert (torques <= high).all()
    assert (high - low < 0.05 * np.abs(torques).max(axis=0)).all()


def test_planar_arms_among_obstacles_have_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tp.plan("obstacle-3", evaluations=2000, seed=1).certificate(tmp_path / "motion.json")
    assert checker.main([str(path)]) == 0
    said = capsys.readouterr().out
    assert "name 'obstacle 1', shape ellipsoid, sizes [0.15, 0.25, 0.15], rotation [[" in said
    assert "center [0.8, 0.8, 0.0], velocity" in said
    assert "0.0 m between links ('link 1', 'link 2', 'link 3') and obstacles\n" in said


def test_a_scenario_has_no_certificate(scenario_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main([str(scenario_file), "--certificate", "c.json"]) == 2
    assert "--certificate" in capsys.readouterr().err


def test_the_place_is_checked_before_the_search(
    tmp_path: Path, scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert solve.main([str(scenario_file), "--out", str(tmp_path / "run"), "--certificate", str(tmp_path)]) == 2
    assert "is a folder" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_no_other_file_is_written_over_and_none_of_another_motion_stays(
    tmp_path: Path, scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place, mine = tmp_path / "c.json.gz", tmp_path / "mine.csv"
    mine.write_text("t,q1\n")
    assert solve.main([str(scenario_file), "--quiet", "--json", "--certificate", str(mine)]) == 2
    assert "mine.csv: is there already, and is no certificate" in capsys.readouterr().err
    assert mine.read_text() == "t,q1\n"
    found = planned()
    assert found.certificate(place) == found.certificate(place)
    with pytest.raises(OutputError, match="not certified"):
        tp.certify(([0.0, 0.1], [[0.0] * 7, [1.0] * 7]), "panda").certificate(place)
    assert not place.exists()
