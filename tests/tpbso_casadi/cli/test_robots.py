"""``tpbso robots``: what it lists, shows, draws and writes."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.meshed import write_meshed
from helpers.running import status
from helpers.urdf import ARM

from problems.robots import BUILT_IN
from tpbso_casadi.cli.commands.robots import main

SPHERES = '[[spheres]]\nlink = "mast"\ncenter = [0.1, 0, 0.2]\nradius = 0.05\n'
# 2 kg half a metre out take 9.81 N m of 20 at some posture
ROD = """<robot name="rod"><link name="a"/><link name="b"><inertial><mass value="2"/><origin xyz="0.5 0 0"/></inertial>
</link><joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="20"/></joint></robot>"""
BARE = """<robot><link name="a"/><link name="b"/><joint name="j" type="revolute"><parent link="a"/><child link="b"/>
{origin}</joint></robot>"""

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def printed(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> list[str]:
    """The lines of a command with this exit status."""
    assert status(main, *arguments) == code
    return capsys.readouterr().out.splitlines()


def cells(lines: list[str]) -> list[list[str]]:
    return [line.split() for line in lines]


def test_the_list(capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(capsys)
    assert lines == printed(capsys, "list")
    assert [line.split()[0] for line in lines[3:]] == list(BUILT_IN)
    assert "Franka Emika Panda with its hand" in lines[3]


def test_a_built_in_robot_fits_80_columns(capsys: pytest.CaptureFixture[str]) -> None:
    for name in BUILT_IN:
        tables = [line for line in printed(capsys, "show", name) if not line.startswith("note: ")]
        assert len(tables[0]) <= 110 and max(map(len, tables[1:])) <= 80


def test_a_urdf_with_spheres_of_its_own_or_of_another_file(capsys: pytest.CaptureFixture[str]) -> None:
    Path("arm.urdf").write_text(ARM)
    Path("spheres.toml").write_text(SPHERES)
    Path("rod.urdf").write_text(ROD)
    lines = cells(printed(capsys, "show", "arm.urdf", "--tip-link", "tool0"))
    for row in (
        "turn revolute -2 2.5 1.5 - - 40", "slide prismatic 0.1 0.8 0.5 - - 300", "mast 3 0.16667 0 0.16667", "all 3.5",
        "turn 40 0 0% 0.7 0.2",  # about the vertical: gravity does not matter
        "slide 300 0 0% 0 0", "jib 1 0.06 0.06",
    ):  # fmt: skip
        assert row.split() in lines
    assert lines[-1][:3] == ["note:", "joint", "'grip'"]
    lines = cells(printed(capsys, "show", "arm.urdf", "--tip-link", "tool0", "--spheres", "spheres.toml"))
    assert ["mast", "1", "0.05", "0.05"] in lines
    assert ["j", "20", "9.81", "49%", "0", "0"] in cells(printed(capsys, "show", "rod.urdf", code=1))


def test_what_nothing_is_known_of_is_shown_all_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    Path("bare.urdf").write_text(BARE.format(origin='<origin xyz="0 0 1"/>'))
    out = "\n".join(printed(capsys, "show", "bare.urdf", "--tip-link", "b", "--figure", "bare.png", code=1))
    assert "no collision spheres: nothing is kept clear" in out
    assert "a plan among obstacles is refused: no collision geometry of a link that moves is known" in out
    assert "note: no position limits stated for j" in out
    assert "note: no masses stated for b: torques are unknown" in out
    assert Path("bare.png").stat().st_size > 1_000
    Path("bare.urdf").write_text(BARE.format(origin=""))
    assert status(main, "show", "bare.urdf", "--figure", "bare.png") == 2
    assert "nothing to draw" in capsys.readouterr().err


def test_meshes_have_covers_and_spheres_that_are_listed_and_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    urdf, out = write_meshed(tmp_path), tmp_path / "spheres.toml"
    lines = printed(capsys, "spheres", str(urdf), "--overhang", "0.01", "-o", str(out))
    assert lines[0] == "spheres that hold meshes, proven, for searches; how far beyond, mm"
    assert [line.split()[0] for line in lines[3:7]] == ["lower", "middle", "upper", "all"]
    count, usual, largest, volume = map(float, lines[3].split()[1:])
    assert 4 <= count <= 120 and 0.0 < usual <= largest <= 10.01 and 1.0 < volume < 3.0
    assert lines[-1] == f"{out}: {int(lines[6].split()[1])} spheres"
    larger = printed(capsys, "spheres", str(urdf), "--overhang", "0.01", "--fine-overhang", "0.008")
    assert float(larger[-1].split()[1]) < float(lines[-2].split()[1])
    shown = "\n".join(printed(capsys, "show", str(urdf), "--spheres", str(out)))
    assert "collision spheres, m" in shown
    shown = "\n".join(printed(capsys, "show", str(urdf), "--pairs"))
    assert "spheres that hold meshes, boxes and cylinders, proven, for proofs" in shown
    assert "no two links that have to keep apart touch at almost every posture" in shown
    touching = urdf.read_text().replace('"0 0 0.36"', '"0 0 0.02"').replace('"0 0 0.17"', '"0 0 0"')
    urdf.with_name("touching.urdf").write_text(touching)  # three boxes around nearly the same point
    shown = "\n".join(printed(capsys, "show", str(urdf.with_name("touching.urdf")), "--pairs"))
    assert 'disabled_pairs = [["lower", "upper"]]' in shown
    (tmp_path / "bars" / "meshes" / "upper.stl").unlink()
    shown = " ".join(" ".join(printed(capsys, "show", str(urdf), code=1)).split())
    assert "note: link 'upper': its mesh package://bars/meshes/upper.stl is not read" in shown
    assert "a plan among obstacles is refused: link 'lower': its mesh package://bars/meshes/lower.stl" in shown
    assert "there is no such file in " in shown and "; packages = { bars = " in shown
    assert main(["spheres", str(urdf)]) == 2
    assert capsys.readouterr().err.startswith(f"error: {urdf}: urdf: link 'upper': its mesh ")
