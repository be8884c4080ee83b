"""Default run folders: their names say what was run, and none is another plan's."""

from __future__ import annotations

from pathlib import Path

import pytest

from tpbso_casadi.cli.commands.solve import main

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

QUICK = ["--evaluations", "500", "--no-plots", "--quiet", "--solver", "bso"]


def folders(*arguments: str) -> list[str]:
    main([*QUICK, *arguments])
    return sorted(path.name for path in Path("runs").iterdir())


def test_names_say_what_the_command_changes() -> None:
    assert folders("time-3") == ["time-3-bso-1-500-evaluations"]
    assert "time-3-bso-1-4-links-rotation-500-evaluations" in folders(
        "time-3", "--links", "4", "--objective", "rotation"
    )
    changed = ["--elbow", "down", "--formulation", "reduced", "--population", "20", "--iterations", "3", "--polish"]
    assert "time-2-bso-7-elbow-down-reduced-population-20-3-iterations-500-evaluations-polish" in folders(
        "time-2", "--seed", "7", *changed
    )


def test_the_same_plan_has_the_same_folder() -> None:
    assert folders("time-2") == folders("time-2")


def test_another_plan_of_the_same_name_gets_a_number() -> None:
    for number, speed in enumerate((4.0, 5.0, 4.0), start=1):
        Path("mine.toml").write_text(
            f"[arm]\nlink_lengths = [1.0, 1.0]\nmax_speed = {speed}\nmax_acceleration = 20.0\n"
            '[task]\nkind = "point-to-point"\nstart = [1.0, 0.0]\ngoal = [0.5, 1.5]\n'
        )
        expected = ["mine-bso-1-500-evaluations", "mine-bso-1-500-evaluations-2"][: min(number, 2)]
        assert folders("mine.toml") == expected


def test_what_is_no_run_is_left_alone() -> None:
    taken = Path("runs/time-2-bso-1-500-evaluations")
    taken.mkdir(parents=True)
    (taken / "notes.txt").write_text("mine")
    assert folders("time-2") == [taken.name, f"{taken.name}-2"]
    assert [path.name for path in taken.iterdir()] == ["notes.txt"]
