"""Folders of MoveIt and files of xacro: what is read of them, what scenarios say by their names, what is refused."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.refused import SHORT
from helpers.running import status

import tpbso_casadi as tp
from tpbso_casadi import ScenarioError, parse_scenario, read_scenario
from tpbso_casadi.cli.commands import robots
from tpbso_casadi.scenario import RobotFiles

LIMITS = "joint_limits: {turn: {max_acceleration: 4.0}, lift: {max_acceleration: 3.0}}"
SRDF = """<robot name="short"><group name="arm"><chain base_link="foot" tip_link="hand"/></group>
<group_state name="ready" group="arm"><joint name="turn" value="0.1"/><joint name="lift" value="-0.2"/></group_state>
<group_state name="home" group="arm"><joint name="turn" value="1"/><joint name="lift" value="0.5"/></group_state>
<group_state name="half" group="arm"><joint name="turn" value="1"/></group_state></robot>"""
ASSISTANT = """moveit_setup_assistant_config:
  URDF: {package: short_description, relative_path: urdf/short.urdf}
  SRDF: {relative_path: config/short.srdf}
  CONFIG: {author_name: nobody}
"""
SCENARIO = """[robot]
moveit_config = "short_moveit_config"
[task]
kind = "point-to-point"
start = "ready"
goal = ["home", { joints = [0.5, 0.5] }]
"""
XACRO = """<robot name="short" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="height" default="0.3"/><xacro:arg name="limited" default="true"/>
<xacro:include filename="$(find short_description)/urdf/links.xacro"/><xacro:links/>
<joint name="turn" type="revolute"><parent link="foot"/><child link="upper"/><origin xyz="0 0 $(arg height)"/>
 <axis xyz="0 0 1"/><limit lower="-2" upper="${3 - 1}" velocity="1.5" effort="10"/></joint>
<xacro:if value="$(arg limited)"><joint name="lift" type="revolute"><parent link="upper"/><child link="lower"/>
 <origin xyz="0 0 0.1"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="2.5" effort="10"/></joint></xacro:if>
<joint name="grip" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="${sqrt(0.25)} 0 0"/></joint>
</robot>"""
LINKS = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="links">
<link name="foot"/><link name="upper"/><link name="lower"/><link name="hand"/></xacro:macro></robot>"""


@pytest.fixture(autouse=True)
def configured(in_an_empty_folder: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """A configuration of MoveIt, and the package of its robot in a folder of another name."""
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)
    files = {
        "short_moveit_config/config/short.srdf": SRDF,
        "short_moveit_config/config/joint_limits.yaml": LIMITS,
        "short_moveit_config/.setup_assistant": ASSISTANT,
        "description/package.xml": "<package><name>short_description</name></package>",
        "description/urdf/short.urdf": SHORT,
        "cell.toml": SCENARIO,
    }
    for name, text in files.items():
        write(name, text)


def write(name: str, text: str) -> None:
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_text(text)


CONFIG, ENDS = Path("short_moveit_config"), {"start": "ready", "goal": "home"}


def test_a_scenario_of_names_alone_is_planned_and_its_result_needs_no_files() -> None:
    scenario = read_scenario("cell.toml")
    assert scenario.robot is not None and scenario.robot.title == "short_moveit_config"
    assert scenario.table()["task"]["start"] == {"joints": [0.1, -0.2]}
    plan = tp.plan(scenario)
    assert plan.certified
    limits = scenario.problem().criteria.robot.limits
    assert (limits.speed, limits.acceleration) == ((1.5, 2.5), (4.0, 3.0))
    stored = json.loads(json.dumps(scenario.table()))
    assert parse_scenario(stored) == scenario
    stored["robot"]["max_acceleration"] = [1.0, 2.0]
    assert parse_scenario(stored).problem().criteria.robot.limits.acceleration == (1.0, 2.0)


def test_the_same_in_python_in_degrees_and_of_a_urdf_with_an_srdf() -> None:
    plan = tp.plan(tp.robot(CONFIG), **ENDS)
    again = tp.plan("cell.toml", goal="home", start="ready")
    apart = {"srdf": CONFIG / "config/short.srdf", "limits": CONFIG / "config/joint_limits.yaml"}
    other = tp.plan(tp.robot("description/urdf/short.urdf", **apart), **ENDS)
    assert plan.duration == again.duration == other.duration
    write("deg.toml", SCENARIO.replace("[robot]", 'unit = "deg"\n[robot]').replace("[0.5, 0.5]", "[30.0, 10.0]"))
    task = read_scenario("deg.toml").table()["task"]
    assert task["start"] == {"joints": [0.1, -0.2]} and task["goal"][1]["joints"] == pytest.approx(np.deg2rad([30, 10]))
    assert tp.retime([[0.1, -0.2], [0.5, 0.5]], CONFIG).certified


def test_postures_stand_in_stages_and_simulations_too() -> None:
    stages = '[task]\nkind = "sequence"\nstart = "ready"\nstages = [{ kind = "move", goal = "home", via = ["ready"] }]'
    write("stages.toml", SCENARIO.partition("[task]")[0] + stages)
    task = read_scenario("stages.toml").table()["task"]
    assert task["start"] == task["stages"][0]["via"][0] == {"joints": [0.1, -0.2]}
    assert task["stages"][0]["goal"] == {"joints": [1.0, 0.5]}
    write("moving.toml", SCENARIO + '[simulation]\ngoals = ["home", "ready"]\n')
    assert read_scenario("moving.toml").table()["simulation"]["goals"][0] == {"joints": [1.0, 0.5]}


def test_files_are_those_of_the_folder_unless_keys_or_the_assistant_name_others() -> None:
    (CONFIG / ".setup_assistant").unlink()
    with pytest.raises(ScenarioError, match=r"^moveit_config: no URDF: .setup_assistant names none, nor is one in con"):
        tp.robot(CONFIG)
    assert tp.robot(CONFIG, urdf="description/urdf/short.urdf").dof == 2
    write("short_moveit_config/config/own.urdf", SHORT)
    write("short_moveit_config/config/second.srdf", SRDF.replace("hand", "lower"))
    with pytest.raises(ScenarioError, match=r"^moveit_config: \S+: srdf: there are second.srdf, short.srdf; srdf = "):
        tp.robot(CONFIG)
    robot = tp.robot(CONFIG, srdf=CONFIG / "config/second.srdf", packages={"short_description": "description"})
    assert robot.table.description().chain.tip_link == "lower"
    (CONFIG / "config/joint_limits.yaml").unlink()
    with pytest.raises(ScenarioError, match=r"^max_acceleration: missing: none is known for joint 'turn'"):
        tp.robot(CONFIG, srdf=CONFIG / "config/second.srdf").model  # noqa: B018


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("short_moveit_config/.setup_assistant", "a: [", "robot.moveit_config: .*: .setup_assistant: not YAML in line"),
        ("short_moveit_config/.setup_assistant", "[]", "robot.moveit_config: no URDF: "),
        ("short_moveit_config/.setup_assistant", ASSISTANT.replace("short_desc", "long_desc"),
            "robot.urdf: package 'long_description' is neither in ROS_PACKAGE_PATH .not set."),
        ("short_moveit_config/.setup_assistant", ASSISTANT.replace("short.urdf", "3.urdf"), "robot.urdf: there is no"),
        ("short_moveit_config/.setup_assistant", ASSISTANT.replace("urdf/short.urdf", "3"),
            "robot.moveit_config: .*: URDF.relative_path: a word is needed, not 3"),
        ("short_moveit_config/.setup_assistant", ASSISTANT.replace("short_description", "[1]"),
            "robot.moveit_config: .*: URDF.package: a word is needed, not .1."),
        ("short_moveit_config/.setup_assistant", ASSISTANT.replace("urdf}", "urdf, xacro_args: height}"),
            "robot.moveit_config: .*: URDF.xacro_args: NAME:=VALUE is needed, not 'height'"),
        ("short_moveit_config/config/short.srdf", "<robot/>", "robot.srdf: states nothing"),
        ("short_moveit_config/config/joint_limits.yaml", "a: 1", "robot.limits: a: unknown key"),
        ("cell.toml", SCENARIO.replace('"short_moveit_config"', '"none"'), "robot.moveit_config: none: no con"),
        ("cell.toml", SCENARIO.replace("[task]", 'model = "panda"\n[task]'), "robot.model: one of model, moveit_con"),
        ("cell.toml", SCENARIO.replace('"ready"', '"redy"'), "task.start: no posture 'redy'; there are ready, home"),
        ("cell.toml", SCENARIO.replace('"home"', '"half"'), "task.goal.0: no posture 'half'; there are ready, home"),
        ("cell.toml", SCENARIO.replace("[task]", 'group = "leg"\n[task]'), "robot.group: the SRDF states no group 'l"),
    ],
)  # fmt: skip
def test_what_is_refused(name: str, text: str, line: str) -> None:
    write(name, text)
    with pytest.raises(ScenarioError, match=f"^cell.toml: {line}") as caught:
        read_scenario("cell.toml").problem()
    assert "\n" not in str(caught.value)


def test_packages_beside_the_scenarios_folder_need_leave(monkeypatch: pytest.MonkeyPatch) -> None:
    write("inner/cell.toml", SCENARIO)
    CONFIG.rename("inner/short_moveit_config")
    with pytest.raises(ScenarioError, match=r"robot.urdf: .* lies outside the scenario's folder; --allow"):
        read_scenario("inner/cell.toml")
    assert read_scenario("inner/cell.toml", outside_allowed=True).robot is not None
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(Path.cwd()))
    assert read_scenario("inner/cell.toml").robot is not None


def test_the_command_shows_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert status(robots.main, "show", str(CONFIG)) == 1  # no geometry, so that nothing could be kept clear
    shown = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "short: 2 joints from foot to hand, reach at most 0.9 m" in shown
    assert "turn revolute -2 2 1.5 4 - 10" in shown
    assert [line for line in shown if line.startswith("posture ")] == [
        "posture 'ready': 0.1, -0.2",
        "posture 'home': 1, 0.5",
    ]
    write("slow.yaml", LIMITS.replace("4.0", "1.0, max_jerk: 9"))
    assert status(robots.main, "show", str(CONFIG), "--group", "arm", "--limits", "slow.yaml") == 1
    assert "turn revolute -2 2 1.5 1 9 10" in " ".join(capsys.readouterr().out.split())
    assert status(robots.main, "show", str(CONFIG), "--group", "leg") == 2
    assert "group: the SRDF states no group 'leg'" in capsys.readouterr().err


def expand(file: str = "description/urdf/short.urdf.xacro", text: str = XACRO, **keys: Any) -> tp.Robot:
    write(file, text)
    write("description/urdf/links.xacro", LINKS)
    return tp.robot(file, max_acceleration=5.0, **keys).model


def test_xacro_is_what_it_expands_to() -> None:
    pytest.importorskip("xacro")
    written, model = tp.robot("description/urdf/short.urdf", max_acceleration=5.0).model, expand()
    theta = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 2))
    np.testing.assert_allclose(model.skeleton(theta), written.skeleton(theta), atol=1e-12)
    assert model.limits == written.limits
    higher = expand(xacro_arguments={"height": 1.3, "limited": True})
    rise = np.asarray(higher.skeleton(theta))[:, -1] - np.asarray(written.skeleton(theta))[:, -1]
    np.testing.assert_allclose(rise, np.tile([0.0, 0.0, 1.0], (20, 1)), atol=1e-12)


def test_xacro_of_a_configuration_has_its_arguments() -> None:
    pytest.importorskip("xacro")
    write("description/urdf/short.urdf.xacro", XACRO)
    write("description/urdf/links.xacro", LINKS)
    stated = ASSISTANT.replace("urdf}", 'urdf.xacro, xacro_args: "height:=1.3"}').replace("  SRDF", "  NONE")
    write(str(CONFIG / ".setup_assistant"), stated)
    (CONFIG / "config/short.srdf").rename(CONFIG / "config/short.srdf.xacro")
    robots = [tp.robot(CONFIG, **keys) for keys in ({}, {"xacro_arguments": {"height": 0.3}})]
    tips = [np.asarray(robot.model.skeleton(np.zeros((1, 2))))[0, -1] for robot in robots]
    assert tips[0] == pytest.approx([0.5, 0.0, 1.4]) and tips[1] == pytest.approx([0.5, 0.0, 0.4])
    assert tp.plan(robots[0], **ENDS).certified


def test_what_is_imported_while_xacro_expands_stays_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a module is there twice, and the classes of one are none of the other's."""
    pytest.importorskip("xacro")
    before = RobotFiles.package

    def package(files: RobotFiles, name: str, beside: Path) -> Path:
        import_module("colorsys")
        return before(files, name, beside)

    monkeypatch.delitem(sys.modules, "colorsys", raising=False)
    monkeypatch.setattr(RobotFiles, "package", package)
    expand()
    assert "colorsys" in sys.modules and "ament_index_python" not in sys.modules


@pytest.mark.parametrize(
    ("text", "keys", "line"),
    [
        (XACRO, {"xacro_arguments": {"hight": 1}}, "has no argument 'hight'; there are height, limited"),
        (
            XACRO.replace("short_desc", "long_desc"),
            {},
            "cannot be expanded: .*package 'long_description' is neither",
        ),
        (XACRO.replace("${3 - 1}", "${3 - x}"), {}, "cannot be expanded: .*'x' is not defined"),
        (XACRO.replace("links.xacro", "none.xacro"), {}, "cannot be expanded: No such file or directory"),
        (XACRO.replace("</robot>", ""), {}, "cannot be expanded: .*no element found"),
        (XACRO.replace("<xacro:links/>", "<xacro:lonks/>"), {}, "cannot be expanded: .*lonks"),
    ],
)
def test_xacro_that_is_refused(text: str, keys: dict[str, Any], line: str) -> None:
    pytest.importorskip("xacro")
    with pytest.raises(ScenarioError, match=rf"^urdf: \S*short.urdf.xacro: {line}") as caught:
        expand(text=text, **keys)
    assert "\n" not in str(caught.value)


def test_what_xacro_includes_lies_in_the_folder_or_in_a_package_that_may_be_read() -> None:
    pytest.importorskip("xacro")
    write("links.xacro", LINKS)
    write("inner/short.xacro", XACRO.replace("$(find short_description)/urdf", str(Path.cwd())))
    write("inner/cell.toml", SCENARIO.replace('moveit_config = "short_moveit_config"', 'urdf = "short.xacro"'))
    with pytest.raises(
        ScenarioError, match=r"robot.urdf: \S*/links.xacro: lies outside the scenario's folder; --allow"
    ):
        read_scenario("inner/cell.toml")


def test_without_the_package_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xacro", None)
    how = r"pip install 'tpbso-casadi\[ros\]', or expand it: xacro FILE > robot.urdf"
    with pytest.raises(ScenarioError, match=rf"^urdf: \S*: a file of xacro needs the package xacro: {how}$"):
        expand()
