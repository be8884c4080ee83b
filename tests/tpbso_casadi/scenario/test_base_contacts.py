"""A base that touches obstacles: planned, said beside the certificate, and claimed by it where it is clear."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from problems.assembly import certificate_of
from problems.certify import check
from problems.motions import Trajectory
from tpbso_casadi.cli.commands import audit
from tpbso_casadi.scenario import parse_scenario

START, GOAL = [0.0, -1.2, 1.4, -1.8, -1.5, 0.2], [1.0, -1.2, 1.4, -1.8, -1.5, 0.2]
TASK = {"kind": "point-to-point", "start": {"joints": START}, "goal": {"joints": GOAL}}
TABLE = {"shape": "box", "name": "table", "center": [0.0, 0.0, -0.05], "size": [1.0, 1.0, 0.1]}
WALL = {"shape": "box", "name": "bin left", "center": [-0.1, 0.0, 0.05], "size": [0.1, 0.2, 0.06]}
CART = WALL | {"name": "cart", "center": [0.0, -1.0, 0.05], "velocity": [0.0, 1.0, 0.0]}
FAR = {"shape": "box", "name": "shelf", "center": [0.0, 0.9, 0.5], "size": [0.1, 0.1, 0.1]}
ON_TABLE = (
    "contact of base_link, which no joint moves, with table: 0.0021 m deep, "
    "within the 0.0041 m by which its cover sticks out"
)
IN_WALL = "contact of base_link, which no joint moves, with bin left: 0.026 m deep"


def told(lines: tuple[str, ...] | list[str]) -> list[str]:
    return [line for line in lines if "no joint moves" in line]


def planned(*obstacles: dict[str, Any], **keys: Any) -> tp.Plan:
    content = {"robot": {"model": "ur5e"}, "task": TASK, "obstacles": list(obstacles), "solver": {"name": "direct"}}
    return tp.plan(parse_scenario(content | keys))


@pytest.fixture(scope="module")
def beside_a_bin() -> tp.Plan:
    return planned(TABLE, WALL, CART, FAR)


def test_a_base_in_a_table_a_wall_and_the_way_of_a_cart_is_told(
    beside_a_bin: tp.Plan, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert beside_a_bin.certified
    on_table, in_wall, under_cart = told(beside_a_bin.not_judged)
    assert (on_table, in_wall) == (ON_TABLE, IN_WALL)
    assert under_cart.startswith("contact of base_link, which no joint moves, with cart: ") and " at t = " in under_cart
    run = str(tmp_path / "run")
    beside_a_bin.save(run, figures=())
    assert tp.audit(run).not_judged == list(beside_a_bin.not_judged)
    assert audit.main([run]) == 0
    assert f"not judged: {IN_WALL}" in capsys.readouterr().out


def test_a_certificate_claims_what_is_clear_of_the_base_alone(beside_a_bin: tp.Plan) -> None:
    motion = beside_a_bin.motion
    content = certificate_of(motion.criteria, motion.trajectory)
    lines = "\n".join(check(content)[0].lines())
    for name in ("table", "bin left", "cart"):
        assert f"    but 'base_link' and {name!r}\n" in lines
    assert "but 'base_link' and 'shelf'" not in lines and f"not in this certificate: {IN_WALL!r}" in lines


def test_what_may_touch_is_told_as_allowed_alone() -> None:
    plan = planned(TABLE, may_touch=[["base_link", "table"]])
    assert told(plan.not_judged) == [] and "contact of base_link and table, which may touch" in plan.not_judged


def test_a_cart_that_comes_after_the_motion_is_told_where_the_arm_has_to_stay() -> None:
    late = CART | {"center": [0.0, -4.0, 0.05]}
    assert told(planned(late).not_judged) == []  # after 1.1 s it is 2.8 m away
    (line,) = told(planned(late, task=TASK | {"stay": 4.0}).not_judged)
    assert "with cart: " in line


def test_the_base_of_an_arm_that_stands_in_a_cell_is_told_too() -> None:
    robots = {
        "left": {"model": "ur5e"},
        "right": {"model": "ur5e", "base": {"position": [0.0, 2.0, 0.0]}, "stays_at": START},
    }
    task = {"kind": "point-to-point", "start": {"left": {"joints": START}}, "goal": {"left": {"joints": GOAL}}}
    under_right = TABLE | {"center": [0.0, 2.0, -0.05]}
    stated = parse_scenario({"robots": robots, "task": task, "obstacles": [under_right]})
    assert told(stated.criteria().not_judged(Trajectory.standing(np.array(START), 1.0))) == [
        ON_TABLE.replace("base_link", "right/base_link")
    ]


def test_stages_of_a_sequence_tell_where_they_do_not_allow_it() -> None:
    stages = [
        {"kind": "move", "goal": {"joints": GOAL}, "may_touch": [["base_link", "table"]]},
        {"kind": "move", "goal": {"joints": START}},
    ]
    plan = planned(TABLE, task={"kind": "sequence", "start": {"joints": START}, "stages": stages})
    assert plan.certified and told(plan.not_judged) == [f"{ON_TABLE}, in {plan.motion.stages[1].label}"]


def test_the_room_of_the_base_is_asked_of_the_arm() -> None:
    arm = tp.robot("ur5e")
    assert arm.base_clearance([TABLE]) == pytest.approx(-0.0021, abs=5e-5)
    assert arm.base_clearance([FAR, WALL]) == arm.among([WALL]).base_clearance < -0.02
    raised = tp.robot("ur5e", base={"position": [0.0, 0.0, 0.3]})
    assert raised.base_clearance([TABLE]) == pytest.approx(arm.base_clearance([TABLE]) + 0.3)
    assert arm.base_clearance([]) == np.inf
    with pytest.raises(tp.ScenarioError, match="moves; the others stand still"):
        arm.base_clearance([CART])
