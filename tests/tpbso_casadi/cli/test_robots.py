"""``tpbso robots``: lists, shows and draws; one line for what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.meshed import write_meshed
from helpers.running import refusal, status
from helpers.urdf import ARM

from problems.robots import BUILT_IN
from tpbso_casadi.cli.commands.robots import main

SPHERES = '[[spheres]]\nlink = "mast"\ncenter = [0.1, 0, 0.2]\nradius = 0.05\n'


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("arm.urdf").write_text(ARM)
    Path("spheres.toml").write_text(SPHERES)


def run(*arguments: str) -> int:
    return status(main, *arguments)


@pytest.mark.parametrize("arguments", [[], ["list"]])
def test_the_list(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*arguments) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[3:]] == list(BUILT_IN)
    assert "Franka Emika Panda with its hand" in lines[3]


def test_a_built_in_robot_fits_80_columns(capsys: pytest.CaptureFixture[str]) -> None:
    for name in BUILT_IN:
        assert run("show", name) == 0
        tables = [line for line in capsys.readouterr().out.splitlines() if not line.startswith("note: ")]
        assert len(tables[0]) <= 110 and max(map(len, tables[1:])) <= 80


def test_a_urdf(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("show", "arm.urdf", "--tip-link", "tool0") == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["turn", "revolute", "-2", "2.5", "1.5", "-", "-", "40"] in lines
    assert ["slide", "prismatic", "0.1", "0.8", "0.5", "-", "-", "300"] in lines
    assert ["mast", "3", "0.16667", "0", "0.16667"] in lines
    assert ["all", "3.5"] in lines
    assert ["turn", "40", "0", "0%", "0.7", "0.2"] in lines  # about the vertical: gravity does not matter
    assert ["slide", "300", "0", "0%", "0", "0"] in lines
    assert ["jib", "1", "0.06", "0.06"] in lines
    assert lines[-1][:3] == ["note:", "joint", "'grip'"]


def test_what_nothing_is_known_of_is_shown_all_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    joint = '<joint name="j" type="revolute"><parent link="a"/><child link="b"/>{origin}</joint>'
    text = f'<robot><link name="a"/><link name="b"/>{joint}</robot>'
    Path("bare.urdf").write_text(text.replace("{origin}", '<origin xyz="0 0 1"/>'))
    assert run("show", "bare.urdf", "--tip-link", "b", "--figure", "bare.png") == 0
    out = capsys.readouterr().out
    assert "no collision spheres: nothing is kept clear" in out
    assert "note: no position limits stated for j" in out
    assert "note: no masses stated for b: torques are unknown" in out
    assert Path("bare.png").stat().st_size > 1_000
    Path("bare.urdf").write_text(text.replace("{origin}", ""))
    assert run("show", "bare.urdf", "--figure", "bare.png") == 2
    assert "nothing to draw" in capsys.readouterr().err


def test_what_the_motors_hold(capsys: pytest.CaptureFixture[str]) -> None:
    """2 kg half a metre out, straight out at some posture, take 9.81 N m of 20."""
    inertial = '<inertial><mass value="2"/><origin xyz="0.5 0 0"/></inertial>'
    limit = '<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="20"/>'
    joint = f'<joint name="j" type="revolute"><parent link="a"/><child link="b"/>{limit}</joint>'
    Path("rod.urdf").write_text(f'<robot><link name="a"/><link name="b">{inertial}</link>{joint}</robot>')
    assert run("show", "rod.urdf") == 0
    assert ["j", "20", "9.81", "49%", "0", "0"] in [line.split() for line in capsys.readouterr().out.splitlines()]


def test_spheres_of_another_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("show", "arm.urdf", "--tip-link", "tool0", "--spheres", "spheres.toml") == 0
    assert ["mast", "1", "0.05", "0.05"] in [line.split() for line in capsys.readouterr().out.splitlines()]


WRONG = [
    (["show", "puma.urdf"], "puma.urdf: cannot be read: No such file or directory"),
    (["show", "."], ".: cannot be read: it is a folder"),
    (["show", "spheres.toml"], "spheres.toml: urdf: no XML: syntax error: line 1, column 0"),
    (["show", "arm.urdf", "--tip-link", "hook"], "arm.urdf: tip_link: no link 'hook' in the URDF; there are world"),
    (["show", "panda", "--base-link", "panda_link1"], "panda: base_link: a robot that is built in has its own"),
    (["show", "panda", "--spheres", "spheres.toml"], "spheres.toml: spheres: sphere 1: no link 'mast' in the chain"),
    (["show", "panda", "--spheres", "none.toml"], "none.toml: cannot be read: No such file or directory"),
    (["show", "panda", "--figure", "panda.txt"], "panda.txt: the name of a figure ends with .png, .pdf, .svg"),
    (["show", "panda", "--figure", "arm.urdf/panda.png"], "arm.urdf/panda.png: cannot be written"),
    (["show"], "the following arguments are required: NAME|FILE.urdf"),
    (["draw"], "argument COMMAND: invalid choice: 'draw'"),
]


def test_one_line_for_what_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, message in WRONG:
        assert refusal(capsys, main, *arguments).startswith(message), arguments


# Meshes


def test_spheres_are_listed_and_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    urdf, out = write_meshed(tmp_path), tmp_path / "spheres.toml"
    assert main(["spheres", str(urdf), "--overhang", "0.01", "-o", str(out)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "spheres that hold meshes, proven, for searches; how far beyond, mm"
    assert [line.split()[0] for line in lines[3:7]] == ["lower", "middle", "upper", "all"]
    count, usual, largest, volume = map(float, lines[3].split()[1:])
    assert 4 <= count <= 120 and 0.0 < usual <= largest <= 10.01 and 1.0 < volume < 3.0
    assert lines[-1] == f"{out}: {int(lines[6].split()[1])} spheres"
    assert main(["show", str(urdf), "--spheres", str(out)]) == 0
    assert "collision spheres, m" in capsys.readouterr().out


def test_show_has_covers_and_what_could_not_be_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    urdf = write_meshed(tmp_path)
    assert main(["show", str(urdf), "--pairs"]) == 0
    shown = capsys.readouterr().out
    assert "spheres that hold meshes, boxes and cylinders, proven, for proofs" in shown
    assert "no two links that have to keep apart touch at almost every posture" in shown
    (tmp_path / "bars" / "meshes" / "upper.stl").unlink()
    assert main(["show", str(urdf)]) == 0
    shown = capsys.readouterr().out
    assert "note: link 'upper': its mesh package://bars/meshes/upper.stl is not read" in shown
    assert "there is no such file; packages = { bars = " in " ".join(shown.split())
    assert main(["spheres", str(urdf)]) == 2
    assert capsys.readouterr().err.startswith(f"error: {urdf}: urdf: link 'upper': its mesh ")
    assert main(["spheres", str(urdf), "--package", "bars"]) == 2
    assert capsys.readouterr().err == "error: --package bars: NAME=FOLDER is needed\n"


def test_links_that_always_touch_are_listed_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three boxes around nearly the same point."""
    urdf = write_meshed(tmp_path)
    urdf.write_text(urdf.read_text().replace('"0 0 0.36"', '"0 0 0.02"').replace('"0 0 0.17"', '"0 0 0"'))
    assert main(["show", str(urdf), "--pairs"]) == 0
    assert 'disabled_pairs = [["lower", "upper"]]' in capsys.readouterr().out
